"""Verification: closed forms, published claims and independent methods in one table."""
