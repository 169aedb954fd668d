"""The web console: the console model in a browser, served by one process of the mission's network."""
