"""Resource controllers, their aggregates, and the one door to them."""
