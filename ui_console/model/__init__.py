"""Knowledge of a console: messages in, views out. Pure."""
