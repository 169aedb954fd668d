"""The component types of a mission, and how many components of each may run."""
