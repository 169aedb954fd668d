"""Reads mission.xml, checks it, and returns the mission description."""
