"""The hardware of a mission, and the RCs that each kind of ARC needs."""
