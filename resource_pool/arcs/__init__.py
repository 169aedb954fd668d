"""One file per kind of aggregate."""
