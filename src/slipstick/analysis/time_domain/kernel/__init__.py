"""Compiled: steps of linear systems without a change of contact state."""
