"""Starts, watches, restarts and stops processes on one host."""
