"""The command line ``scout-backbone``: its commands, options and completions, and its live pictures of a mission."""
