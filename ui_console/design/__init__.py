"""Mission design: a mission file built step by step, checked while it is built."""
