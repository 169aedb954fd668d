"""Core services, and the parts that all components use: bus, clock, life cycle, mission file."""

__version__ = "0.1.0"
