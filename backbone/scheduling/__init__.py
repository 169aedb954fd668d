"""Present and next holders of every RC, with reasons: pure decisions; time is an argument."""
