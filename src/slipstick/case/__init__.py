"""The case file: its format, what it says made public objects, its faults in its own words."""
