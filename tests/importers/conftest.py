"""Plain matrices with a map, and a mesh that Gmsh could have written."""

from pathlib import Path

import numpy as np
import pytest

from slipstick.fem.box import box


@pytest.fixture
def plain(tmp_path):
    a = np.random.default_rng(1).normal(size=(6, 6))
    K, M = a @ a.T + np.eye(6), np.diag(np.arange(1.0, 7.0))
    (tmp_path / "map.txt").write_text("".join(f"{node} {d}\n" for node in (4, 2) for d in "xyz"))
    return tmp_path, K, M


@pytest.fixture
def gmsh(tmp_path) -> Path:
    """A box with a volume and a surface group, written by meshio."""
    meshio = pytest.importorskip("meshio")
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "tet4")
    face = mesh.surface("x1").faces["tri3"][:, ::-1]  # inward: the import turns it outward
    tetrahedra = mesh.blocks["tet4"]
    tags = [np.full(len(tetrahedra), 1), np.full(len(face), 2)]
    data = meshio.Mesh(
        mesh.nodes,
        [("tetra", tetrahedra), ("triangle", face)],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"body": np.array([1, 3]), "tip": np.array([2, 2])},
    )
    data.write(tmp_path / "box.msh", file_format="gmsh22", binary=False)
    return tmp_path / "box.msh"
