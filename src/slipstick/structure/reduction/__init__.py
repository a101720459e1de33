"""Finite element matrices reduced to modes and residual terms at a few directions."""
