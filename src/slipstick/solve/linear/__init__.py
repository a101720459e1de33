"""Jacobians: what Newton and the continuation ask of one, and the kinds there are."""
