"""Which hardware exists and what each kind of ARC needs."""
