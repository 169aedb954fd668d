"""What a console knows and shows: messages in, views out. Pure."""
