"""Lets the tests in the folders below import what stands here: ``pool_on_local_network``."""
