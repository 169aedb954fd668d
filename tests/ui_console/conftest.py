"""Lets the tests in the folders below import what stands here: ``screen_text``, ``console_scenes``."""
