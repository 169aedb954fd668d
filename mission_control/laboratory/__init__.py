"""Trials with whole missions, outside of the product: fault campaigns, their laws, and the papers' experiments."""
