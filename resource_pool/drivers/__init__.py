"""How an RC reaches its hardware; a mission picks one by name."""
