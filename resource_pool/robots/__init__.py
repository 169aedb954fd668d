"""One folder per kind of robot."""
