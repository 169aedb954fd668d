"""A four-legged robot."""
