"""Recordings as data for those who train models."""
