"""Consoles for people."""
