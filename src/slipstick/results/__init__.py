"""Branches of solutions and what is measured on them."""
