"""Metrics: what a mission's schedule did so far, in numbers that only grow, for Prometheus."""
