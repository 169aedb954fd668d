"""The papers' experiments on simulated robots: many trials, in lock step, from a seed."""
