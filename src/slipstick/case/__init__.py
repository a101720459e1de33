"""The case file: its format, the public objects made of it, and the messages about its faults."""

RENAMED = {"cycles": "limit_cycles"}
"""Tables by their old names, which go on working; the command of a table is called by the same word."""
