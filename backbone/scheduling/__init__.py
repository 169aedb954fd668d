"""Who holds which resource now and next, and why: pure decisions on a clock that is an argument."""
