"""Whole missions in one process on virtual time, from a seed, with faults on purpose."""
