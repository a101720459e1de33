"""A Craig-Bampton delivery stands for the full model: frequencies and a response with a contact."""

from pathlib import Path

import numpy as np
import pytest
from helpers.superelement import Frame, craig_bampton, write_delivery
from scipy.linalg import eigh

import slipstick as ss
from slipstick.case.case import Case
from slipstick.errors import SlipstickWarning
from slipstick.fem.box import box
from slipstick.fem.model import FiniteElementModel, elastic_model

MODES = 140


@pytest.fixture(scope="module")
def full() -> FiniteElementModel:
    metal = ss.Material(young=200.0, poisson=0.3, density=1.0)
    return elastic_model(box((4.0, 0.5, 0.3), (6, 1, 1), "hex20"), metal, "x0")


@pytest.fixture(scope="module")
def boundary(full) -> np.ndarray:
    """Nodes of the free end."""
    return np.sort(np.flatnonzero(full.mesh.nodes[:, 0] == 4.0))


@pytest.fixture(scope="module")
def delivery(full, boundary, tmp_path_factory) -> Path:
    """Two of the points have their displacements in a cylindrical system."""
    folder = tmp_path_factory.mktemp("se")
    rows = full.indices(boundary).ravel()
    K, M = full.K.toarray(), full.M.toarray()
    k, m = craig_bampton(K, M, rows, MODES)
    points = {int(full.mesh.labels[node]): full.mesh.nodes[node] for node in boundary}
    around = Frame(number=10, origin=np.array([1.0, -2.0, 0.0]))
    frames = dict.fromkeys(list(points)[1:3], around)
    write_delivery(folder, points, frames, {"KAA": k, "MAA": m, "BAA": 0.01 * m + 2e-4 * k})
    return folder


@pytest.fixture(scope="module")
def model(delivery):
    return ss.import_model([delivery / "se.op4", delivery / "se.pch"], units="N, mm, t, s", output=delivery / "se.h5")


def test_frequencies_and_positions_are_those_of_the_full_model(full, boundary, model):
    exact = np.sqrt(eigh(full.K.toarray(), full.M.toarray(), eigvals_only=True)[:10])
    found = np.sqrt(eigh(model.K.toarray(), model.M.toarray(), eigvals_only=True)[:10])
    np.testing.assert_allclose(found, exact, rtol=1e-6)
    assert model.dofs[:3] == tuple(f"n{full.mesh.labels[boundary[0]]}{axis}" for axis in "xyz")
    assert model.dofs[24] == "n995001s"
    assert model.n_dofs == 24 + MODES
    at = model.positions(full.mesh.labels[boundary])
    np.testing.assert_allclose(at, full.mesh.nodes[boundary], atol=1e-8)
    assert any("2 dofs without any stiffness or mass were left out" in note for note in model.notes)
    assert any("without effect here: VA, MUG1" in note for note in model.notes)


def test_rows_point_along_the_global_directions(full, boundary, model):
    """Static displacements under forces on every boundary dof are those of the full model."""
    rows = full.indices(boundary).ravel()
    exact = np.linalg.inv(full.K.toarray())[np.ix_(rows, rows)]
    found = np.linalg.inv(model.K.toarray())[:24, :24]
    np.testing.assert_allclose(found, exact, atol=1e-8 * np.abs(exact).max())


def _problem(structure, tip: str, other: str) -> ss.Problem:
    contact = ss.ContactPair(
        name="damper",
        contact=ss.FrictionContact(kt=0.05, mu=0.3, kn=0.05, gap=-0.5),
        tangential=f"{tip}y",
        normal=f"{tip}z",
        rubbing=ss.RubbingMotion(velocity=0.002),
    )
    load = ss.Load(dof=f"{other}y", harmonic=1, cos=0.01)
    return ss.Problem(structure, contacts=contact, loads=load, harmonics=range(4), outputs=[f"{other}y"])


def test_response_with_a_contact_is_that_of_the_full_model(full, boundary, model):
    labels = full.mesh.labels[boundary].tolist()
    tip, other = f"n{labels[-1]}", f"n{labels[0]}"
    first = float(np.sqrt(eigh(full.K.toarray(), full.M.toarray(), eigvals_only=True)[0]))
    whole = ss.MatrixStructure(K=full.K, M=full.M, C=0.01 * full.M + 2e-4 * full.K, dofs=full.dofs)
    super_ = ss.MatrixStructure(K=model.K, M=model.M, C=model.C, dofs=model.dofs)
    for omega in (0.9 * first, 1.1 * first):
        (a, b) = (
            ss.forced_response(_problem(one, tip, other), omega=(omega, omega * 1.001), options={"max_points": 1})
            for one in (whole, super_)
        )
        exact, found = (float(one.dataset.amplitude[0, 0]) for one in (a, b))
        assert a.outcome.ok == b.outcome.ok
        assert found == pytest.approx(exact, rel=1e-6)
        assert float(a.dataset.stick_fraction[0, 0]) < 1.0  # it slips, or the contact would be a spring


CASE = """
format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
file = "se.h5"
[[load]]
dof = "{other}y"
cos = 0.01
[[contact]]
name = "damper"
tangential = "{tip}y"
kt = 0.05
mu = 0.3
normal_load = 0.02
[response]
from = 0.1
to = 0.11
"""


def test_superelement_in_a_case_file(full, boundary, model, delivery):
    labels = full.mesh.labels[boundary].tolist()
    (delivery / "case.toml").write_text(CASE.format(tip=f"n{labels[-1]}", other=f"n{labels[0]}"))
    case = Case.from_file(delivery / "case.toml")
    np.testing.assert_array_equal(case.body.structure.K, model.K.toarray())
    assert case.body.structure.C is not None
    with pytest.warns(SlipstickWarning, match="a damping matrix"):
        body = ss.reduced_body(model, keep=[f"n{labels[0]}y", f"n{labels[-1]}y"])
    exact = np.sqrt(eigh(full.K.toarray(), full.M.toarray(), eigvals_only=True)[:10])
    np.testing.assert_allclose(body.structure.natural_frequencies[:10], exact, rtol=1e-6)
