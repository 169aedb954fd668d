"""Drivers: an RC's interface to its hardware; a mission chooses one by name."""
