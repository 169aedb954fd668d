"""Find a red ball in pictures and follow it."""
