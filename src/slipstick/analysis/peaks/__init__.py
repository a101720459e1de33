"""Peaks of a response: located, tracked over a parameter, made lowest."""
