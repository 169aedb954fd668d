"""Modules: algorithms with declared inputs and outputs, put into execution units by configuration."""
