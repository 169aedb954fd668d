"""One behavior a file."""
