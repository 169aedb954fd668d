"""Registers the components of a mission, resolves their names, and runs the hub."""
