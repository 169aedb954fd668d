"""A mission in viewers that need no plug-in for it: Foxglove, Lichtblick, Rerun."""
