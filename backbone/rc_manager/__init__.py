"""Who holds which resource now and next, and why."""
