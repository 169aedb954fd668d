"""A video monitor: a receiver whose pictures only people see."""
