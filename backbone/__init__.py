"""Core services, and what all components use: bus, clock, life cycle, mission file."""
