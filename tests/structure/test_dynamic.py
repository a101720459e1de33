"""Named parameters of structures: copies, receptances with other values, exact derivatives."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy import sparse

import slipstick as ss
from slipstick.structure import matrices
from slipstick.structure.modal import LoadShape
from slipstick.structure.receptance import ModalReceptance, PoleReceptance, SolvedReceptance

N = 5
ORDERS = np.array([1.0, 2.0, 5.0])


def matrix_structure(*, proportional: bool, loss_factor: float = 0.03, sparse_form: bool = False) -> ss.MatrixStructure:
    rng = np.random.default_rng(3)
    root = rng.standard_normal((N, N))
    K = 50.0 * (root @ root.T + N * np.eye(N))
    C = 0.01 * K + (0 if proportional else np.diag(rng.uniform(0, 2, N)))
    form = sparse.csc_array if sparse_form else np.asarray
    return ss.MatrixStructure(
        M=form(np.eye(N)), C=form(C), K=form(K), dofs=[f"d{i}" for i in range(N)], loss_factor=loss_factor,
        load_shapes={"wind": np.arange(N)},
    )  # fmt: skip


def modal_structure(loss_factor: float = 0.03) -> ss.ModalStructure:
    """Two modes of four kept."""
    rng = np.random.default_rng(4)
    modes, omega = np.linalg.qr(rng.standard_normal((N, N)))[0][:, :4], np.array([5.0, 9.0, 20.0, 40.0])
    forces = modes.T @ np.arange(N)
    left_out = modes[:, 2:] / omega[2:] ** 2
    shape = LoadShape(participation=forces[:2], static_response=modes @ (forces / omega**2),
                      second_response=left_out @ (forces[2:] / omega[2:] ** 2))  # fmt: skip
    return ss.ModalStructure(
        omega=omega[:2], mode_shapes=modes[:, :2], static_compliance=(modes / omega**2) @ modes.T,
        second_residual=left_out @ left_out.T, dofs=[f"d{i}" for i in range(N)], loss_factor=loss_factor,
        damping_ratio=[0.02, 0.05], load_shapes={"wind": shape},
    )  # fmt: skip


def made(kind: str, loss_factor: float, monkeypatch: pytest.MonkeyPatch) -> tuple[object, type]:
    if kind == "residuals":
        return modal_structure(loss_factor), ModalReceptance
    if kind == "sparse":
        monkeypatch.setattr(matrices, "DENSE_LIMIT", 1)
    found = matrix_structure(
        proportional=kind == "modes", loss_factor=loss_factor, sparse_form=kind in ("sparse", "solved")
    )
    if kind == "solved":
        found.__dict__["_poles"] = None
    return found, {"modes": ModalReceptance, "poles": PoleReceptance}.get(kind, SolvedReceptance)


def projected(structure: object) -> object:
    rng = np.random.default_rng(0)
    return structure.project(rng.standard_normal((N, 2)), rng.standard_normal((N, 3)), ["wind"])  # type: ignore[attr-defined]


@pytest.mark.parametrize("loss_factor", [0.0, 0.03])
@pytest.mark.parametrize(
    "name, value", [("loss_factor", 0.1), ("loss_factor", 0.0), ("damping", 1.7), ("damping", 0.0)]
)
@pytest.mark.parametrize("kind", ["modes", "poles", "solved", "sparse", "residuals"])
def test_receptances_with_other_values(
    kind: str, name: str, value: float, loss_factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A changed receptance is that of the changed structure; its derivative is that of differences."""
    structure, receptance = made(kind, loss_factor, monkeypatch)
    base = projected(structure)
    assert isinstance(base, receptance)
    at, omega = base.changed(**{name: value}), np.array([3.0, 4.6])
    wanted = projected(structure.changed(**{name: value})).at(ORDERS, omega)
    for found, own in zip(at.at(ORDERS, omega), wanted, strict=True):
        assert found == pytest.approx(own, rel=1e-9, abs=1e-9 * np.abs(own).max())
    step = 1e-4
    beyond = [base.changed(**{name: value + k * step}).at(ORDERS, omega)[0] for k in (-2, -1, 1, 2)]
    slope = (8 * (beyond[2] - beyond[1]) - (beyond[3] - beyond[0])) / (12 * step)
    assert at.by_parameter(name, ORDERS, omega) == pytest.approx(slope, abs=1e-8 * np.abs(slope).max())
    assert at.by_parameter(name, ORDERS, 3.0) == pytest.approx(at.by_parameter(name, ORDERS, omega)[0], rel=1e-12)


@pytest.mark.parametrize("kind", ["modes", "poles", "residuals"])
def test_copies(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    structure, _ = made(kind, 0.03, monkeypatch)
    assert structure.values == pytest.approx({"loss_factor": 0.03, "damping": 1.0})
    projected(structure)
    changed = structure.changed(loss_factor=0.2, damping=3.0)
    assert changed.values == pytest.approx({"loss_factor": 0.2, "damping": 3.0})
    assert structure.values["loss_factor"] == pytest.approx(0.03)
    again = pickle.loads(pickle.dumps(changed.changed(damping=0.0).changed(loss_factor=0.03, damping=1.0)))
    value, own = (projected(s).at(ORDERS, 3.0)[0] for s in (again, structure))
    assert value == pytest.approx(own, rel=1e-10)
    made_again = type(structure)(**changed.arguments)
    assert made_again.values == pytest.approx(changed.values)
    value, own = (projected(s).at(ORDERS, 3.0)[0] for s in (made_again, changed))
    assert value == pytest.approx(own, rel=1e-10)
    with raises_fault("damping", expected="none negative"):
        type(structure)(**(changed.arguments | {"damping": -2.0}))
    C, tripled = (s.time_equations(np.eye(N), np.eye(N)).C for s in (structure.changed(loss_factor=0.0), changed))
    assert np.abs(tripled).max() > 2.9 * np.abs(C).max()
    for wrong, words in (({"loss_factor": -0.1}, "loss_factor: found -0.1; expected a number >= 0"),
                         ({"stiffness": 2.0}, "no parameter 'stiffness'")):  # fmt: skip
        with pytest.raises(ss.InputError, match=words):
            structure.changed(**wrong)


def test_without_viscous_damping_there_is_no_factor_on_it() -> None:
    assert "damping" not in ss.MatrixStructure(M=[[1.0]], K=[[1.0]], dofs=["x"]).values
    assert "damping" not in ss.ModalStructure(omega=[1.0], mode_shapes=[[1.0]], dofs=["x"]).values


def test_one_loss_factor_in_place_of_many() -> None:
    """The mean is told; the modes left out have it once it is one."""
    mixed = ss.ModalStructure(
        omega=[5.0, 9.0], mode_shapes=[[1.0, 0.5]], static_compliance=[[0.1]], dofs=["x"], loss_factor=[0.1, 0.3]
    )
    assert mixed.values == {"loss_factor": pytest.approx(0.2)}
    one = ss.ModalStructure(
        omega=[5.0, 9.0], mode_shapes=[[1.0, 0.5]], static_compliance=[[0.1]], dofs=["x"], loss_factor=0.3
    )
    found = mixed.project([[1.0]], [[1.0]]).changed(loss_factor=0.3).at([1.0], 4.0)[0]
    assert found == pytest.approx(one.project([[1.0]], [[1.0]]).at([1.0], 4.0)[0], rel=1e-13)
