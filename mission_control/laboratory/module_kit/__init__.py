"""Module kit: pytest fixtures for authors of modules and missions; see ``plugin``."""
