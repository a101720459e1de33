"""The case file: its format, the public objects made of it, and the messages about its faults."""
