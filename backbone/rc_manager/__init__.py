"""The RC manager: messages, loop, context switch and recovery around ``backbone.scheduling``."""
