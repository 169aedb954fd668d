"""Bus and Clock: messages between components, and the mission's time."""
