"""Structures of the user's own in whole problems: a measured frequency response, a rotor that is not symmetric."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import slipstick as ss
from slipstick.balance.start import FirstPoint
from slipstick.errors import Outcome
from slipstick.structure.protocol import TimeEquations
from slipstick.structure.receptance import SolvedReceptance


class MeasuredReceptance(ss.models.Receptance):
    """``rows^T H columns`` of a spline through a table."""

    def __init__(self, table, static, rows, columns):
        self.table, self.rows, self.columns = table, rows, columns
        self.static = rows.T @ static @ columns

    def at(self, orders, omega):
        m = np.asarray(orders, dtype=float)
        w = np.multiply.outer(omega, m)
        value, slope = (self.rows.T @ self.table(w, order) @ self.columns for order in (0, 1))
        return value, m[:, None, None] * slope


class MeasuredStructure(ss.models.Structure):
    """Frequency response H (n_frequencies, n_dofs, n_dofs), length/force, over rad/s; static compliance apart."""

    load_shapes = ()

    def __init__(self, frequencies, H, static, dofs, natural_frequencies=()):
        self.dofs, self.natural_frequencies = tuple(dofs), np.asarray(natural_frequencies, dtype=float)
        self.table, self.static = CubicSpline(frequencies, H, extrapolate=False), static

    def project(self, rows, columns, shapes=()):
        return MeasuredReceptance(self.table, self.static, np.asarray(rows), np.asarray(columns))

    def time_equations(self, rows, columns, shapes=()):
        raise ss.InputError("a measured structure has no equations in time")


def modal() -> ss.ModalStructure:
    return ss.ModalStructure(
        omega=[6.0, 17.0], mode_shapes=[[0.8, 0.5], [0.5, -0.9]], dofs=["tip", "root"], loss_factor=0.01
    )


def measured(known: ss.ModalStructure, *, known_frequencies: bool = True) -> MeasuredStructure:
    lines = np.linspace(1.0, 60.0, 2951)
    H = known.project(np.eye(2), np.eye(2)).at([1], lines)[0][:, 0]
    frequencies = known.natural_frequencies if known_frequencies else ()
    return MeasuredStructure(lines, H, known.static_compliance, known.dofs, frequencies)


def rubbed(structure, *, velocity: float = 1.0, normal: str | None = None) -> ss.Problem:
    contact = ss.FrictionContact(kt=20.0, mu=0.3, kn=5.0, gap=-2.0)
    pair = ss.ContactPair(
        name="damper", contact=contact, tangential="root", normal=normal, rubbing=ss.RubbingMotion(velocity=velocity)
    )
    return ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="tip", sin=2.0)], harmonics=range(6))


@pytest.mark.parametrize("velocity", [0.0, 1.0])
def test_a_measured_structure_gives_the_curve_of_the_one_measured(velocity: float) -> None:
    known = modal()
    wanted, found = (
        ss.forced_response(rubbed(s, velocity=velocity), omega=(4.0, 9.0), at=[5.0, 7.0])
        for s in (known, measured(known))
    )
    assert found.outcome is Outcome.COMPLETED
    assert wanted.peaks("tip")
    assert found.peaks("tip") == [pytest.approx(peak, rel=1e-4) for peak in wanted.peaks("tip")]
    for omega in (5.0, 7.0):
        a, b = (branch.dataset.displacement.values[branch.at(omega)] for branch in (wanted, found))
        np.testing.assert_allclose(b, a, atol=1e-4 * np.abs(a).max())


def test_without_natural_frequencies_and_equations_in_time() -> None:
    structure = measured(modal(), known_frequencies=False)
    branch = ss.forced_response(rubbed(structure), omega=(5.0, 6.0))
    assert branch.outcome.ok
    with pytest.raises(ss.InputError, match="no equations in time"):
        branch.check_in_time(0)


def test_no_first_point_is_an_outcome_without_equations_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last resort is a time integration; where there is none, it is one more way that failed."""
    monkeypatch.setattr(FirstPoint, "strategies", lambda self: iter([("time integration", self._from_last_resort)]))
    branch = ss.forced_response(rubbed(measured(modal())), omega=(5.0, 6.0))
    assert branch.outcome is Outcome.NO_FIRST_POINT


class Rotor(ss.models.Structure):
    """``M q'' + (C + G) q' + K q = f`` with a gyroscopic G: forward and backward whirl, nothing symmetric."""

    dofs, load_shapes = ("tip", "root"), ()
    M, C, K = np.eye(2), 0.2 * np.eye(2), np.diag([40.0, 50.0])
    G = np.array([[0.0, 1.5], [-1.5, 0.0]])
    natural_frequencies = np.array([5.6, 7.9])

    def stiffness(self, w):
        return self.K + 1j * w * (self.C + self.G) - w * w * self.M, 1j * (self.C + self.G) - 2 * w * self.M

    def project(self, rows, columns, shapes=()):
        static = rows.T @ np.linalg.solve(self.K, columns)
        return SolvedReceptance(stiffness=self.stiffness, rows=rows, columns=columns, static=static)

    def time_equations(self, rows, columns, shapes=()):
        return TimeEquations(
            M=self.M, C=self.C + self.G, K=self.K, rows=rows.T, columns=columns,
            feedthrough=np.zeros((rows.shape[1], columns.shape[1])),
        )  # fmt: skip


def test_a_rotor_without_contacts_is_its_own_linear_response() -> None:
    rotor = Rotor()
    problem = ss.Problem(rotor, loads=[ss.Load(dof="tip", cos=2.0)], harmonics=[0, 1], outputs=["root"])
    found = ss.linear_response(problem, omega=[5.0, 6.5]).dataset.displacement.values[:, 0]
    for w, x in zip((5.0, 6.5), found, strict=True):
        hat = np.linalg.solve(rotor.stiffness(w)[0], [2.0, 0.0])[1]
        assert x == pytest.approx([0.0, hat.real, -hat.imag], rel=1e-10)


def test_a_rubbing_rotor_against_time_integration() -> None:
    branch = ss.forced_response(rubbed(Rotor(), normal=None), omega=(4.0, 10.0), at=[6.0])
    assert branch.outcome is Outcome.COMPLETED
    assert branch.dataset.newton_iterations.values.mean() < 4  # the derivative by omega is right
    assert branch.check_in_time(branch.at(6.0)).relative_difference < 2e-3
