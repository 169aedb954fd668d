"""Chooses a host for each component, with the reasons."""
