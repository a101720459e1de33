"""A mesh assembled with our own elements."""

from dataclasses import replace

import numpy as np
from helpers.imported import STEEL

from slipstick.fem.box import box
from slipstick.importers.deck import matching_surface, with_surfaces
from slipstick.importers.mesh_model import MeshModel, assemble_mesh


def test_cantilever_bends_as_a_beam():
    """First bending frequency of a slender beam, 1.875^2 sqrt(E I / (rho A L^4)); shear and section take some off."""
    from scipy.linalg import eigh

    mesh = box((4.0, 1.0, 1.0), (4, 1, 1), "hex8")
    cantilever = assemble_mesh(MeshModel(mesh=mesh), source="box", material=STEEL, fixed=["x0"], quadratic=True)
    first = np.sqrt(eigh(cantilever.K.toarray(), cantilever.M.toarray(), eigvals_only=True)[0])
    beam = 1.8751**2 * np.sqrt(2e11 / 12 / (7800.0 * 4.0**4))
    assert 0.93 < first / beam < 1.0


def test_surfaces_by_corners_are_outward_whatever_their_order():
    mesh = box((2.0, 1.0, 1.0), (2, 2, 2), "hex20")
    face = mesh.surface("x1").faces["quad8"]
    turned = np.roll(face[:, 3::-1], 1, axis=1)
    found = matching_surface(mesh, [turned, np.array([[0, 1, 2]])])
    assert sorted(map(tuple, found.faces["quad8"].tolist())) == sorted(map(tuple, face.tolist()))


def test_node_sets_with_whole_faces_become_surfaces():
    mesh = box((2.0, 1.0, 1.0), (2, 2, 2), "tet4")
    tip = np.flatnonzero(mesh.nodes[:, 0] == 2.0)
    mesh = replace(mesh, node_sets={"TIP": tip, "EDGE": tip[mesh.nodes[tip, 1] == 0.0]}, surfaces={})
    assert set(with_surfaces(mesh, ["TIP", "EDGE"]).surfaces) == {"TIP"}
