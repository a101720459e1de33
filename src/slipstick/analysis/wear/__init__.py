"""Contacts that wear on slow time."""
