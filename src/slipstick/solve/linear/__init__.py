"""Jacobians, as Newton and the continuation ask for them, and sparse symmetric matrices: factors and lowest modes."""
