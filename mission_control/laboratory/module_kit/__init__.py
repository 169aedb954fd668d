"""Module kit: pytest fixtures for who writes modules and missions; see ``plugin``."""
