"""One console in a mission: what it hears and says on the bus, and the devices that drive it."""
