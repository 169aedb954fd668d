"""Explanation, start prediction, blockers: reading the schedule, never changing it."""
