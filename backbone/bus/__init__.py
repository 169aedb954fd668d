"""Bus and Clock: how components talk and what time it is."""
