"""Core services, and what all components use: bus, clock, life cycle, mission file."""

__version__ = "0.1.0"
