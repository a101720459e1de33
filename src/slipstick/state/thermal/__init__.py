"""Contact parameters that depend on temperature, and the temperature that friction power brings about."""
