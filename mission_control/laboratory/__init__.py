"""What is tried with whole missions, and no part of one: fault campaigns, their laws, and the papers' experiments."""
