"""The backbone's calls of the operating system that Python does not offer everywhere; see docs/reference/porting.md.

Rule of this folder: its files import nothing of this project, so that a port replaces only them. The docstring of a
function states what holds on every system.
"""
