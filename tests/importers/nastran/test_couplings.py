"""MPC, RBE2, RBE3, RBAR, CONM2, CELAS: against the same couplings stated otherwise, and beside matrices."""

import numpy as np
import pytest
from helpers.bulk import card, lines_of, write
from helpers.coupled import STEEL, beam, frequencies
from helpers.coupled import lines_of as input_lines
from helpers.nastran import write_text

from slipstick.errors import InputError
from slipstick.importers.import_model import read_model
from slipstick.importers.nastran.couplings import CoupledCard, Points, coupled_equations

BODY = beam()
FREE = lines_of(BODY) + "".join(card("SPC1", 1, 123, n + 1) for n in BODY.surfaces["x0"].nodes.tolist())
TIP = (BODY.surfaces["x1"].nodes + 1).tolist()
POINT = card("GRID", 1001, "", 43.0, 8.0, 6.0)
INPUT = STEEL + input_lines(BODY, "A") + "*BOUNDARY\nAx0, 1, 3\n"
NODE = "*NODE, NSET=REF\n1001, 43., 8., 6.\n"

PAIRS = {
    "MPC": (
        card("MPC", 5, 25, 1, 1.0, 26, 1, -0.5, "", "", 27, 1, -0.5),
        "*EQUATION\n3\n25, 1, 1., 26, 1, -0.5, 27, 1, -0.5\n",
    ),
    "RBE2": (POINT + card("RBE2", 9, 1001, 123, *TIP), NODE + "*RIGID BODY, NSET=Ax1, REF NODE=1001\n"),
    "RBE2 of two directions": (
        POINT + card("RBE2", 9, 1001, 23, *TIP) + card("SPC1", 1, 123, 1001),
        NODE + "*COUPLING, REF NODE=1001, SURFACE=SAx1, CONSTRAINT NAME=C\n*KINEMATIC\n2, 3\n*BOUNDARY\n1001, 1, 3\n",
    ),
    "RBE3 with a mass": (
        POINT + card("RBE3", 9, "", 1001, 123, 1.0, 123, *TIP) + card("CONM2", 8, 1001, "", "2.-6"),
        "*NODE, NSET=REF\n1001, 43., 8., 6.\n*ELEMENT, TYPE=MASS, ELSET=M\n9002, 1001\n*MASS, ELSET=M\n2.e-6\n*MPC\n",
    ),
    "CONM2": (
        card("CONM2", 8, 25, "", "2.-6"),
        "*ELEMENT, TYPE=MASS, ELSET=M\n9001, 25\n*MASS, ELSET=M\n2.e-6\n",
    ),
    "CELAS2": (
        card("CELAS2", 8, "3.+4", 25, 2, 30, 3),
        "*ELEMENT, TYPE=SPRING2, ELSET=P\n9001, 25, 30\n*SPRING, ELSET=P\n2, 3\n3.e4\n",
    ),
    "CELAS1 to ground": (
        card("CELAS1", 8, 4, 25, 2) + card("PELAS", 4, "3.+4"),
        "*ELEMENT, TYPE=SPRING1, ELSET=P\n9001, 25\n*SPRING, ELSET=P\n2\n3.e4\n",
    ),
}


@pytest.mark.parametrize("name", [name for name in PAIRS if name != "RBE3 with a mass"])
def test_the_same_frequencies_as_an_input_file_that_says_the_same(tmp_path, name):
    bulk, keywords = PAIRS[name]
    (tmp_path / "m.inp").write_text(INPUT + keywords)
    ours = frequencies(read_model(write(tmp_path, FREE + bulk), quiet=True), 6)
    theirs = frequencies(read_model(tmp_path / "m.inp", quiet=True), 6)
    np.testing.assert_allclose(ours, theirs, rtol=1e-8)
    plain = frequencies(read_model(write(tmp_path, FREE), quiet=True), 6)
    assert np.abs(ours / plain - 1.0).max() > 1e-4


def test_points_from_one_to_another_are_all_between(tmp_path):
    listed, ranged = (
        read_model(write(tmp_path, FREE + POINT + card("RBE2", 9, 1001, 123, *points)), quiet=True)
        for points in ((25, 26, 27, 28, 30), (25, "THRU", 28, 30))
    )
    assert sorted(ranged.dependent.tolist()) == sorted(listed.dependent.tolist())
    assert ranged.dofs == listed.dofs
    assert abs(ranged.K - listed.K).max() == 0.0


def test_a_mass_on_a_mean_point_lies_on_all_that_it_follows(tmp_path):
    """RBE3: mass m at the mean adds m w w' to the mass matrix, and nothing to the stiffness."""
    plain = read_model(write(tmp_path, FREE), quiet=True)
    model = read_model(write(tmp_path, FREE + PAIRS["RBE3 with a mass"][0]), quiet=True)
    assert model.dofs == plain.dofs
    assert abs(model.K - plain.K).max() < 1e-9 * abs(plain.K).max()
    w = model.directions(["n1001x", "n1001y", "n1001z"]).toarray()
    np.testing.assert_allclose((model.M - plain.M).toarray(), 2e-6 * w @ w.T, atol=1e-20)
    np.testing.assert_allclose(w.sum(), 3.0)


def test_a_mass_away_from_its_point(tmp_path):
    """CONM2 with offset and inertia on a rigid point: the kinetic energy of the body's rigid motion."""
    text = FREE + POINT + card("RBE2", 9, 1001, 123, *TIP)
    heavy = card("CONM2", 8, 1001, "", "2.-6", 1.0, 2.0, 3.0, "", "1.-4", "1.-5", "2.-4", "-2.-5", "0.", "3.-4")
    models = [read_model(write(tmp_path, text + more), quiet=True) for more in ("", heavy)]
    v, w = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.7, -0.4])
    energies = []
    for model in models:
        q = np.zeros(model.n_dofs)
        for axis, value in zip(("x", "y", "z", "rx", "ry", "rz"), (*v, *w), strict=True):
            q[model.index(f"n1001{axis}")] = value
        energies.append(q @ model.M @ q)
    inertia = np.array([[1e-4, -1e-5, 2e-5], [-1e-5, 2e-4, 0.0], [2e-5, 0.0, 3e-4]])
    speed = v + np.cross(w, [1.0, 2.0, 3.0])
    assert energies[1] - energies[0] == pytest.approx(2e-6 * speed @ speed + w @ inertia @ w, rel=1e-9)


def test_inertia_on_a_point_of_solids_is_told(tmp_path):
    path = write(tmp_path, FREE + card("CONM2", 8, 25, "", "2.-6", "", "", "", "", "1.-4"))
    told = read_model(path, quiet=True).warnings
    assert any("CONM2 has an offset or inertia at point 25 of solids" in warning for warning in told)


def equations(text_cards, directions=None, mpc=None):
    cards = [CoupledCard(name=name, line=7, fields=tuple(map(str, fields))) for name, *fields in text_cards]
    places = {n: np.array([float(n), n**2 / 10.0, 0.0]) for n in range(1, 6)}
    return list(coupled_equations(cards, Points(places=places, directions=directions or {}, source="m.bdf"), mpc))


def test_a_bar_and_a_rigid_element_say_the_same():
    bar = equations([("RBAR", 1, 1, 2, "123456", "", "", "123")])
    rigid = equations([("RBE2", 1, 1, "123", 2)])
    assert [equation.terms for equation in bar] == [equation.terms for equation in rigid]
    other = equations([("RBAR", 1, 2, 1, "", "123456", "123", "")])
    assert [equation.terms for equation in other] == [equation.terms for equation in rigid]


def test_own_directions():
    """A point whose first direction is the basic y."""
    turned = {2: np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])}
    (equation,) = equations([("MPC", 1, 2, 1, "1.", 3, 1, "-1.")], turned)
    assert equation.terms == ((2, 1, 1.0), (3, 0, -1.0))


def test_sets_of_equations():
    two = [("MPC", 1, 2, 1, "1.", 3, 1, "-1."), ("MPC", 2, 4, 1, "1.", 5, 1, "-1.")]
    assert len(equations(two, mpc=2)) == 1
    assert len(equations([*two, ("MPCADD", 9, 1, 2)])) == 2
    with pytest.raises(InputError, match=r"m\.bdf: holds the MPC sets \[1, 2\]"):
        equations(two)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("RBE2", 1, 9, "123", 2), "line 7: RBE2: grid point 9 is not in the file"),
        (("RBE2", 1, 1, "127", 2), "RBE2 cannot be read"),
        (("RBAR", 1, 1, 2, "123", "456", "", ""), "has independent directions at both ends"),
        (("RBE3", 1, "", 1, "123", "1.", "123456", 2, 3), "takes rotations into the mean"),
        (("RBE3", 1, "", 1, "123", "1.", "123", 2, 3, "UM", 2, 3), "dependent directions of its own"),
        (("RBE3", 1, "", 1, "123456", "1.", "123", 2), "do not determine the motion"),
        (("MPC", 1, 2, 1, "one", 3, 1, "-1."), "MPC cannot be read"),
        (("MPC", "x", 2, 1, "1.", 3, 1, "-1."), "line 7: MPC cannot be read"),
    ],
)
def test_cards_that_are_refused(given, said):
    with pytest.raises(InputError, match=said):
        equations([given])


def test_equations_beside_a_matrix_of_all_points_are_applied(tmp_path):
    """KGG does not hold them, KFF does: the same model from both."""
    K = np.diag(np.arange(1.0, 13.0)) + 0.1
    M = np.eye(12)
    points = "".join(card("GRID", i, "", float(i), 0.0, 0.0) for i in (1, 2))
    mpc = card("MPC", 5, 1, 1, 1.0, 2, 1, -2.0)
    (tmp_path / "gg.op4").write_text(write_text({"KGG": K, "MGG": M}, "dense"))
    model = read_model([tmp_path / "gg.op4", write(tmp_path, points + mpc)], quiet=True)
    T = np.delete(np.eye(12), 0, axis=1)
    T[0, 5] = 2.0
    np.testing.assert_allclose(model.K.toarray(), T.T @ K @ T, rtol=1e-12)
    assert model.dependent_dofs == ("n1x",)
    assert not any("must hold it" in warning for warning in model.warnings)
    (tmp_path / "ff.op4").write_text(write_text({"KFF": T.T @ K @ T, "MFF": T.T @ M @ T}, "dense"))
    names = read_model([tmp_path / "ff.op4", tmp_path / "m.bdf"], quiet=True)
    np.testing.assert_allclose(names.K.toarray(), model.K.toarray(), rtol=1e-12)
    assert names.dofs == model.dofs
    assert any("MPC ties degrees of freedom to each other: the matrices must hold it" in w for w in names.warnings)


SYSTEMS = {
    "turned by 45 degrees": card("CORD2R", 5, "", 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.0),
    "cylindrical": card("CORD2C", 5, "", 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0),
}


@pytest.mark.parametrize("system", SYSTEMS.values(), ids=SYSTEMS)
def test_whole_points_follow_another_whatever_their_own_directions(tmp_path, system):
    """All three displacements of a point, or of two alike: the systems in which they are written do not matter."""
    ties = card("MPC", 5, 25, 1, 1.0, 26, 1, -1.0) + card("MPC", 5, 25, 2, 1.0, 26, 2, -1.0)
    ties += card("MPC", 5, 25, 3, 1.0, 26, 3, -1.0)
    turned = [line.split(",") for line in FREE.split("\n")]
    for words in turned:
        if words[0] == "GRID" and int(words[1]) in (25, 26, *TIP):
            words.append("5")
    own = "\n".join(",".join(words) for words in turned) + system
    rigid = POINT + card("RBE2", 9, 1001, 123, *TIP)
    for more in (rigid, ties) if system.startswith("CORD2R") else (rigid,):
        ours, plain = (frequencies(read_model(write(tmp_path, text + more), quiet=True), 6) for text in (own, FREE))
        np.testing.assert_allclose(ours, plain, rtol=1e-8)
