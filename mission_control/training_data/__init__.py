"""Conversion of recordings to training data for models."""
