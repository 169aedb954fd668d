"""What the backbone asks of the operating system beyond what Python offers everywhere; see docs/reference/porting.md.

Rule of this folder: its files import nothing of this project, so that a port replaces them and nothing else. A function
says in its docstring what holds on every system.
"""
