"""Core services and everything components need to talk: bus, clock, life cycle, mission file, recording."""
