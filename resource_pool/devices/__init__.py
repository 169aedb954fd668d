"""One folder per kind of device other than robots."""
