"""A mission on a virtual clock, without a process: its hosts and the begin of its master schedule."""
