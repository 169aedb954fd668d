"""A console in a mission: its communication on the bus, and the devices that drive a robot."""
