"""Abaqus and CalculiX: input files, matrix storage."""
