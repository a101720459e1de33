"""Gmsh: mesh files (.msh)."""
