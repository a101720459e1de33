"""First and second derivatives of a motion."""
