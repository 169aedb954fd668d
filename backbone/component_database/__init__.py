"""Which component types exist and how many of each may run."""
