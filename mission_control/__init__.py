"""Behaviors, the behavior tree, and computer vision."""
