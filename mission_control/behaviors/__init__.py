"""The shipped behaviors, one in each file."""
