"""A mission on a virtual clock, without a process: its hosts and the first part of its master schedule."""
