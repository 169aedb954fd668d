"""What a mission file may say: each element and attribute declared once, with unit, range, default and meaning."""
