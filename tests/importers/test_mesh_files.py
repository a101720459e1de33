"""Gmsh files written by meshio, cut and spoilt."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.geometry import volume
from slipstick.importers.import_model import read_mesh


def test_gmsh(gmsh):
    found = read_mesh(gmsh)
    assert volume(found.mesh) == pytest.approx(2.0)
    assert set(found.mesh.element_sets) == {"body"}
    tip = found.mesh.surface("tip")
    corners = found.mesh.nodes[tip.faces["tri3"]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.all(normals[:, 0] > 0.0)
    assert 0.5 * normals[:, 0].sum() == pytest.approx(1.0)


@pytest.mark.parametrize("cut", [20, 200, 700])
def test_gmsh_cut(gmsh, cut):
    gmsh.write_text(gmsh.read_text()[:cut])
    with pytest.raises(InputError):
        read_mesh(gmsh)


def test_gmsh_that_claims_too_much(gmsh):
    text = gmsh.read_text()
    for section in ("$Nodes\n", "$Elements\n"):
        at = text.index(section) + len(section)
        gmsh.write_text(text[:at] + "1000000000000" + text[text.index("\n", at) :])
        with pytest.raises(InputError):
            read_mesh(gmsh)
