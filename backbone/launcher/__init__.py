"""Starts a mission in the papers' order, keeps its core services alive, ends it, and finds a running mission."""
