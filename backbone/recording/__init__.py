"""Recordings: everything that crossed the bus, decisions included, in MCAP files."""
