"""A Pioneer 2-class rover: body, on-board program and packets."""
