"""Which host gets the next component, and why not the others."""
