"""Nastran: bulk data, DMIG, OP4."""
