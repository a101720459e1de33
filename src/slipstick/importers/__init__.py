"""Models of other codes: one folder for each, and what they share on the way to one imported model."""
