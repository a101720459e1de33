"""Compiled code of the structure: sums over modes."""
