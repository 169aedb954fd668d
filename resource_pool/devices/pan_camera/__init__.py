"""A camera on a stand, which pans or is fixed: body, on-board program, RC and ARC."""
