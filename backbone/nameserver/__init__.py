"""The registered components of a mission, with host and time; runs the hub."""
