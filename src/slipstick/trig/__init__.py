"""Trigonometric polynomials: layout of harmonics, certified roots, interval integrals. Knows no mechanics."""
