"""Base of every component: life cycle, process, questions, log and story."""
