"""Who is registered, where, since when; runs the hub."""
