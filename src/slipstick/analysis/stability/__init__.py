"""Stability of the periodic motion: Floquet multipliers from the contact states that the exact elements know."""
