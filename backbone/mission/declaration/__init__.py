"""Declaration of the mission file: each element and attribute once, with unit, range, default and meaning."""
