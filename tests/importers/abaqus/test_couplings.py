"""Keywords that tie nodes together: frequencies as CalculiX has them of the same deck, and what is refused."""

import numpy as np
import pytest
from helpers.abaqus import needs_ccx
from helpers.coupled import STEEL, beam, calculix, frequencies, lines_of
from helpers.input_file import CUBE, HELD, write

from slipstick.errors import InputError
from slipstick.importers.import_model import read_model
from slipstick.importers.roles import ImportOptions

COUNT = 6
HEAD = STEEL + lines_of(beam(), "A") + "*BOUNDARY\nAx0, 1, 3\n"
REFERENCE = "*NODE, NSET=REF\n1001, 43., 8., 6.\n1002, 43., 8., 6.\n"
TURNED = "*TRANSFORM, NSET=Ax1, TYPE=R\n1., 0.4, 0.2, -0.3, 1., 0.1\n"
ABOUT = "*TRANSFORM, NSET=Ax1, TYPE=C\n0., -5., 1., 3., -5., 2.\n"

DECKS = {
    "equations in a chain": "*EQUATION\n3\n25, 1, 1., 26, 1, -0.5, 27, 1, -0.5\n2\n28, 2, 2., 25, 1, -1.\n"
    "2\n29, 3, 1., 30, 2, -0.7\n",
    "an equation over two lines": "*EQUATION\n5\n25, 1, 1., 26, 1, -0.25, 27, 1, -0.25, 26, 2, -0.25,\n27, 2, -0.25\n",
    "equations along own directions": TURNED + "*EQUATION\n2\n25, 1, 1., 26, 1, -1.\n2\n25, 3, 1., 27, 2, -1.\n",
    "supports along own directions": TURNED + "*BOUNDARY\nAx1, 2\n",
    "supports about an axis": ABOUT + "*BOUNDARY\nAx1, 1\n",
    "a rigid end": REFERENCE + "*RIGID BODY, NSET=Ax1, REF NODE=1001, ROT NODE=1002\n",
    "a rigid end whose node is held": REFERENCE
    + "*RIGID BODY, NSET=Ax1, REF NODE=1001, ROT NODE=1002\n*BOUNDARY\n1001, 2\n1002, 1\n",
    "a kinematic coupling": REFERENCE + "*COUPLING, REF NODE=1001, SURFACE=SAx1, CONSTRAINT NAME=C\n*KINEMATIC\n1, 3\n",
    "one of two directions": REFERENCE
    + "*COUPLING, REF NODE=1001, SURFACE=SAx1, CONSTRAINT NAME=C\n*KINEMATIC\n2, 3\n*BOUNDARY\n1001, 1, 3\n",
    "a node in the mean of others": "*NODE, NSET=REF\n1001, 43., 8., 6.\n*ELEMENT, TYPE=DCOUP3D, ELSET=D\n9001, 1001\n"
    "*DISTRIBUTING COUPLING, ELSET=D\nAx1, 1.\n*BOUNDARY\n1001, 3\n",
}


@needs_ccx
@pytest.mark.parametrize("more", DECKS.values(), ids=DECKS)
def test_frequencies_are_those_of_calculix(tmp_path, more):
    path = write(tmp_path, HEAD + more)
    model = read_model(path)
    free = read_model(write(tmp_path, HEAD)).n_dofs
    path = write(tmp_path, HEAD + more)
    assert model.n_dofs < free + 6
    ours, plain = frequencies(model, COUNT), frequencies(read_model(write(tmp_path, HEAD)), COUNT)
    theirs = calculix(write(tmp_path, HEAD + more), COUNT)
    np.testing.assert_allclose(ours, theirs, rtol=1e-6)
    assert np.abs(ours / plain - 1.0).max() > 1e-4, "the coupling does nothing here"
    assert model.warnings == ()


def test_joints_of_abaqus_tie_nodes(tmp_path):
    """PIN and TIE: the same motion; BEAM: a rigid lever; sets are taken in pairs."""
    path = write(tmp_path, HEAD + "*NSET, NSET=A1\n25, 26\n*NSET, NSET=A2\n27, 28\n*MPC\nPIN, A1, A2\nBEAM, 29, 30\n")
    model = read_model(path)
    for one, other in (("n25x", "n27x"), ("n26z", "n28z")):
        assert np.array_equal(model.directions([one]).toarray(), model.directions([other]).toarray())
    assert {"n30rx", "n30ry"} <= set(model.dofs)  # the lever lies along z
    with pytest.raises(InputError, match=r"n29x' depends on others"):
        model.index("n29x")


def turned(places: dict[int, np.ndarray]) -> dict[tuple[int, int], float]:
    """A small rigid motion of nodes."""
    shift, turn = np.array([0.1, -0.3, 0.2]), np.array([0.4, 0.1, -0.2])
    moved = {node: shift + np.cross(turn, x) for node, x in places.items()}
    return {(node, axis): float(u[axis]) for node, u in moved.items() for axis in range(3)}


@pytest.mark.parametrize("kind", ["PLANE", "STRAIGHT"])
def test_nodes_kept_in_a_plane_or_on_a_line(tmp_path, kind):
    """Rigid motions are allowed, a node that leaves is not."""
    from slipstick.importers.import_model import read_mesh

    nodes = "1, 2, 6, 5" if kind == "PLANE" else "2, 3, 6"
    imported = read_mesh(write(tmp_path, CUBE + f"*MPC\n{kind}, {nodes}\n"))
    equations = [e for stated in imported.stated for e in stated.equations(imported.mesh)]
    assert len(equations) == (1 if kind == "PLANE" else 2)
    places = dict(zip(imported.mesh.labels.tolist(), imported.mesh.nodes, strict=True))
    motion = turned(places)
    last = int(nodes.split(",")[-1])
    for equation in equations:
        assert sum(v * motion[n, a] for n, a, v in equation.terms) == pytest.approx(0.0, abs=1e-14)
    normal = np.array([0.0, 0.0, 1.0])
    leaves = [sum(v * normal[a] for n, a, v in e.terms if n == last) for e in equations]
    assert max(map(abs, leaves)) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (
            "*EQUATION\n2\n2, 1, 1., 5, 1, -1.\n3\n2, 1, 1., 5, 1, -2., 6, 1, 1.",
            r"makes n2x dependent, which m\.inp, line 25",
        ),
        (
            "*EQUATION\n2\n2, 1, 1., 5, 1, -1.\n2\n5, 1, 1., 2, 1, -2.",
            "makes n5x depend on itself, through m.inp, line 25",
        ),
        ("*EQUATION\n2\n2, 1, 1., 99, 1, -1.", r"\*EQUATION names node 99, which the file does not have"),
        ("*EQUATION\n3\n2, 1, 1., 5, 1, -1.", "3 terms are announced, 2 are there"),
        ("*EQUATION\n2\n2, 1, 1., 5, 11, -1.", "directions beyond 6 together with motions"),
        ("*RIGID BODY, NSET=ROOT, REF NODE=99", "names node 99"),
        ("*RIGID BODY, NSET=NOWHERE, REF NODE=2", "names NOWHERE, which the file does not have"),
        (
            "*COUPLING, REF NODE=2, SURFACE=S, CONSTRAINT NAME=C\n*KINEMATIC\n1, 3",
            "names S, which the file does not have",
        ),
        ("*KINEMATIC\n1, 3", r"no \*COUPLING stands before it"),
        ("*MPC\nPLANE, 1, 3, 7, 5", "its first three nodes lie on a line"),
        ("*TRANSFORM, NSET=ROOT, TYPE=R\n1., 0., 0., 2., 0., 0.", "points on one line"),
    ],
)
def test_couplings_that_cannot_be_applied(tmp_path, more, said):
    with pytest.raises(InputError, match=said):
        read_model(write(tmp_path, CUBE + HELD + more + "\n"))


def test_equations_between_temperatures_have_no_effect(tmp_path):
    model = read_model(write(tmp_path, CUBE + HELD + "*EQUATION\n2\n2, 11, 1., 5, 11, -1.\n"))
    assert model.n_dofs == 12


def test_nodes_named_one_by_one_do_not_fit_a_mesh_made_quadratic(tmp_path):
    corners = "*NODE\n1, 0., 0., 0.\n2, 1., 0., 0.\n3, 0., 1., 0.\n4, 0., 0., 1.\n"
    text = STEEL + corners + "*ELEMENT, TYPE=C3D4, ELSET=E\n1, 1, 2, 3, 4\n"
    text += "*SOLID SECTION, ELSET=E, MATERIAL=STEEL\n*BOUNDARY\n1, 1, 3\n3, 1, 3\n4, 1, 3\n"
    path = write(tmp_path, text + "*EQUATION\n2\n2, 1, 1., 2, 2, -1.\n")
    assert read_model(path, quiet=True).n_dofs == 2
    with pytest.raises(InputError, match=r"\*EQUATION names nodes one by one: those that quadratic adds"):
        read_model(path, ImportOptions(quadratic=True))


@pytest.mark.parametrize("data", ["DI1", "1., 0., 0., 0., 1., 0.\n3, DI2", "1., 0., 0., 2., 0., 0."])
def test_orientations_that_nothing_uses_have_no_effect(tmp_path, data):
    more = f"*ORIENTATION, NAME=O\n{data}\n"
    if data.startswith("1., 0., 0., 2."):
        with pytest.raises(InputError, match="points on one line"):
            read_model(write(tmp_path, CUBE + HELD + more))
    else:
        assert read_model(write(tmp_path, CUBE + HELD + more)).n_dofs == 12
