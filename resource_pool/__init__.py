"""Resource controllers, their aggregates, and the client interface to them."""
