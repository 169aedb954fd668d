"""The model of a console: messages go in, views come out. Pure."""
