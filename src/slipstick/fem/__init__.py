"""From a mesh to sparse matrices: solid elements, elasticity, heat conduction, surfaces."""
