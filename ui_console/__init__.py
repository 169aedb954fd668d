"""Consoles for operators: terminal, web page, designer."""
