"""Metrics: the history of a mission's schedule, as numbers that only grow, for Prometheus."""
