"""Behaviors, their tree, and what they see."""
