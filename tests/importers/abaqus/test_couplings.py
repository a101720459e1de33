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
AXES = ("x", "y", "z", "rx", "ry", "rz")
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
            "*EQUATION\n2\n2, 1, 1., 5, 1, -1.\n2\n5, 1, 1., 2, 1, -2.",
            r"line 27: \*EQUATION leaves n5x no motion, although nothing holds it, together with m.inp, line 25",
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


NODES = "*NODE\n1001, 43., 3., 2.\n1002, 43., 8., 7.\n"
BETWEEN = """*EQUATION
2
1001, 1, 1., 1002, 1, -1.
2
1002, 5, 1., 1001, 5, -1.
3
1001, 2, 1., 1002, 2, -0.5, 1001, 3, -0.5
"""
MEANS = """*COUPLING, REF NODE=1001, SURFACE=Ax1, CONSTRAINT NAME=L
*DISTRIBUTING, WEIGHTING METHOD=UNIFORM, COUPLING=STRUCTURAL
*COUPLING, REF NODE=1002, SURFACE=Az1, CONSTRAINT NAME=H
*DISTRIBUTING
"""


@pytest.mark.parametrize("order", ["before", "after"])
def test_equations_between_nodes_that_follow_others_in_the_mean(tmp_path, order):
    """The reference nodes are dependent; the equations between them hold the two surfaces to each other."""
    cards = BETWEEN + MEANS if order == "before" else MEANS + BETWEEN
    model = read_model(write(tmp_path, HEAD + NODES + cards))
    assert model.warnings == ()
    motion = {dof: model.directions([dof]).toarray()[:, 0] for dof in (f"n{n}{d}" for n in (1001, 1002) for d in AXES)}
    np.testing.assert_allclose(motion["n1001x"], motion["n1002x"], atol=1e-12)
    np.testing.assert_allclose(motion["n1001ry"], motion["n1002ry"], atol=1e-12)
    np.testing.assert_allclose(motion["n1001y"], (motion["n1002y"] + motion["n1001z"]) / 2.0, atol=1e-12)
    loose = read_model(write(tmp_path, HEAD + NODES + MEANS))
    assert loose.n_dofs == model.n_dofs + 3
    T = model.directions(loose.dofs).toarray().T
    np.testing.assert_allclose(T.T @ (loose.K @ T), model.K.toarray(), atol=1e-10 * abs(model.K).max())


def test_a_dependent_reference_node_is_loaded_and_observed(tmp_path):
    """The static motion of a body reduced to it is that of the whole model."""
    import slipstick as ss

    model = read_model(write(tmp_path, HEAD + NODES + BETWEEN + MEANS))
    body = ss.reduced_body(model, keep=["n1001z", "n1002rx"], modes=4)
    force = model.directions(["n1001z"]).toarray()[:, 0]
    exact = force @ np.linalg.solve(model.K.toarray(), force)
    at = body.structure.dofs.index("n1001z")
    assert body.structure.static_compliance[at, at] == pytest.approx(exact, rel=1e-9)


def test_a_node_between_two_others(tmp_path):
    model = read_model(
        write(
            tmp_path,
            HEAD + "*NODE\n1001, 30., 0., 0.\n1002, 40., 0., 0.\n1003, 37.5, 0., 0.\n"
            "*MPC\nPIN, 1001, 25\nPIN, 1002, 30\nLINEAR, 1003, 1001, 1002\n",
        )
    )
    a, b, between = (model.directions([dof]).toarray() for dof in ("n25z", "n30z", "n1003z"))
    np.testing.assert_array_equal(between, 0.25 * a + 0.75 * b)
    with pytest.raises(InputError, match="MPC LINEAR nodes 25 and 1001 are at the same place"):
        read_model(
            write(
                tmp_path,
                CUBE.replace("10, 0.", "25, 1., 1., 1.\n1001, 1., 1., 1.\n10, 0.")
                + HELD
                + "*MPC\nLINEAR, 2, 25, 1001\n",
            )
        )


def test_levers_between_nodes_that_turn_hold_their_rotations(tmp_path):
    """Two reference nodes of couplings joined by a beam: a rigid motion of the second carries the first."""
    cards = NODES + MEANS.replace("DISTRIBUTING, WEIGHTING METHOD=UNIFORM, COUPLING=STRUCTURAL", "KINEMATIC")
    model = read_model(write(tmp_path, HEAD + cards + "*MPC\nBEAM, 1001, 1002\n"))
    alone = read_model(write(tmp_path, HEAD + cards))
    assert alone.n_dofs - model.n_dofs == 6
    one, other = (np.hstack([model.directions([f"n{n}{d}"]).toarray() for d in AXES]) for n in (1001, 1002))
    np.testing.assert_allclose(one[:, 3:], other[:, 3:], atol=1e-12)
    np.testing.assert_allclose(one[:, :3], other[:, :3] + np.cross(other[:, 3:], [0.0, -5.0, -5.0]), atol=1e-12)


@pytest.mark.parametrize(
    ("method", "weight"),
    [("LINEAR", lambda s: 1 - s), ("QUADRATIC", lambda s: 1 - s * s), ("CUBIC", lambda s: 1 - 3 * s**2 + 2 * s**3)],
)
def test_weights_by_distance_within_a_radius(tmp_path, method, weight):
    """Of a node set, translations alone: the weighted mean of the nodes within the radius."""
    cards = NODES + "*COUPLING, REF NODE=1001, SURFACE=Ax1, CONSTRAINT NAME=L, INFLUENCE RADIUS=7.\n"
    model = read_model(write(tmp_path, HEAD + cards + f"*DISTRIBUTING, WEIGHTING METHOD={method}\n"))
    end = model.nodes_of("AX1")
    distances = np.linalg.norm(model.positions(end) - [43.0, 3.0, 2.0], axis=1)
    near = distances <= 7.0
    assert 3 < near.sum() < len(end)
    weights = weight(distances[near] / distances[near].max())
    shift = model.directions(["n1001x"]).toarray()[:, 0]
    rows = [model.index(f"n{n}x") for n in end[near].tolist()]
    x = np.array([[1.0, 0.0, z, -y] for _, y, z in (model.positions(end[near]) - [43.0, 3.0, 2.0]).tolist()])
    fit = np.linalg.lstsq(np.sqrt(weights)[:, None] * x[:, [0, 2, 3]], np.diag(np.sqrt(weights)), rcond=None)[0][0]
    np.testing.assert_allclose(shift[rows], fit, atol=1e-12)
    assert np.count_nonzero(shift) <= 3 * near.sum()
    with pytest.raises(InputError, match="no node of AX1 lies within INFLUENCE RADIUS"):
        read_model(write(tmp_path, HEAD + cards.replace("7.", "0.1", 1).replace("=7.", "=0.1") + "*DISTRIBUTING\n"))


def test_a_reference_node_in_a_rigid_body_turns_with_it(tmp_path):
    """The end of the beam follows node 1001, which is in the rigid body of node 1002; pinned, it only moves with it."""
    end = "*COUPLING, REF NODE=1001, SURFACE=Ax1, CONSTRAINT NAME=L\n*KINEMATIC\n*NSET, NSET=ONE\n1001\n"
    found = {}
    for kind in ("NSET", "TIE NSET", "PIN NSET"):
        model = read_model(write(tmp_path, HEAD + NODES + end + f"*RIGID BODY, {kind}=ONE, REF NODE=1002\n"))
        assert {"n1002rx", "n1002x"} <= {*model.dofs, *model.dependent_dofs}
        found[kind] = model.n_dofs
    assert found == {"NSET": found["NSET"], "TIE NSET": found["NSET"], "PIN NSET": found["NSET"] + 3}
