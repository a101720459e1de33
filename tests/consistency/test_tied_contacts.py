"""Contacts and loads on a body that is glued together: as on the same body meshed in one piece."""

import numpy as np
import pytest
from helpers.coupled import STEEL, lines_of
from helpers.faults import raises_fault
from helpers.input_file import write

from slipstick.fem.box import box
from slipstick.importers.import_model import read_model
from slipstick.models.reduced_body import ReducedBody, reduced_body

HALF, WHOLE = box((20.0, 10.0, 8.0), (2, 2, 1), "hex20"), box((40.0, 10.0, 8.0), (4, 2, 1), "hex20")
GLUED = lines_of(HALF, "A") + lines_of(HALF, "B", 500, (20.0, 0.0, 0.0)) + "*BOUNDARY\nAx0, 1, 3\n"
TIE = "*TIE, NAME=T, POSITION TOLERANCE=0.1\nSBx0, SAx1\n"


def receptance(body: ReducedBody, omega: float) -> np.ndarray:
    n = 3 * body.points.count
    at = body.structure.project(np.eye(n), np.eye(n), ["push"]).at([1], omega)
    return np.column_stack([np.asarray(at[0][0]), np.asarray(at[1][0])])


@pytest.mark.parametrize("omega", [0.0, 2.0e4])
def test_contacts_beside_a_glued_joint_see_one_body(tmp_path, omega):
    """Patches at the joint take in nodes of both sides: those of one side have no row of their own."""
    places = np.array([[20.5, 3.0, 8.0], [22.0, 8.0, 8.0], [35.0, 5.0, 8.0]])
    options = {"contacts": places, "radius": 2.0, "modes": 40}
    tied = read_model(write(tmp_path, STEEL + GLUED + TIE))
    one = read_model(write(tmp_path, STEEL + lines_of(WHOLE, "A") + "*BOUNDARY\nAx0, 1, 3\n"))
    assert len(tied.dependent) == 3 * len(HALF.surfaces["x0"].nodes)
    assert tied.n_dofs == one.n_dofs
    ours = reduced_body(tied, surface="SBZ1", pressure={"push": "SBY1"}, **options)
    half = one.mesh.surfaces["SAZ1"].faces["quad8"]
    right = half[one.mesh.nodes[half][:, :, 0].min(axis=1) >= 20.0 - 1e-9]
    from dataclasses import replace

    from slipstick.fem.mesh import Surface

    sides = one.mesh.surfaces["SAY1"].faces["quad8"]
    pushed = sides[one.mesh.nodes[sides][:, :, 0].min(axis=1) >= 20.0 - 1e-9]
    surfaces = {"top": Surface(faces={"quad8": right}), "side": Surface(faces={"quad8": pushed})}
    one = replace(one, mesh=replace(one.mesh, surfaces=surfaces))
    theirs = reduced_body(one, surface="top", pressure={"push": "side"}, **options)
    found, wanted = receptance(ours, omega), receptance(theirs, omega)
    np.testing.assert_allclose(found, wanted, atol=1e-7 * np.abs(wanted).max())


def test_heat_does_not_cross_a_glued_joint_in_silence(tmp_path):
    """Conduction is that of the mesh, which the joint does not connect."""
    tied = read_model(write(tmp_path, STEEL + "*CONDUCTIVITY\n25.\n" + GLUED + TIE))
    with raises_fault("films", says="heat is not conducted through those here"):
        reduced_body(tied, surface="SBZ1", contacts=2, films={"SBZ1": 10.0}, modes=5)
