"""One folder per kind of device that is no robot."""
