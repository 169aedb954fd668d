"""Blackboard: large named values of one writer for many readers on one host, without a copy for each reader."""
