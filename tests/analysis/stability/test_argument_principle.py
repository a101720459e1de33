"""Growing disturbances counted on the imaginary axis, against the multipliers."""

import numpy as np
import pytest
from helpers.oscillator import oscillator
from helpers.stability import point_at, two_dofs

import slipstick as ss
from slipstick.analysis.stability.floquet import StabilityWatch
from slipstick.analysis.stability.harmonic_form import count_unstable, folded, net_turns, strip
from slipstick.balance.balance import Balance

OMEGA = 3.0
NODES = strip([], OMEGA)


@pytest.mark.parametrize("growing", [0, 1, 2, 5])
def test_zeros_of_a_known_function_are_counted(growing) -> None:
    """A periodic determinant over the strip: ``prod (1 - m_i / z)`` with ``z = e^(lambda T)``, some beyond 1."""
    rng = np.random.default_rng(growing)
    pairs = (1.0 + rng.uniform(0.001, 1.0, growing // 2)) * np.exp(1j * rng.uniform(0.3, 2.8, growing // 2))
    inside = rng.uniform(0.1, 0.999, 5) * np.exp(1j * rng.uniform(0.3, 2.8, 5))
    m = np.concatenate([pairs, pairs.conj(), inside, inside.conj(), [-1.05] * (growing % 2), [0.5]])

    def sign(nu):
        value = np.prod(1.0 - m * np.exp(-2j * np.pi * nu / OMEGA))
        return complex(value / abs(value))

    assert net_turns(sign, NODES) == growing


def test_what_does_not_settle_is_not_known() -> None:
    assert net_turns(lambda nu: complex(np.nan), NODES) is None
    assert net_turns(lambda nu: np.exp(1e6j * nu), NODES) is None
    assert net_turns(lambda nu: np.exp(1j * np.pi * nu / OMEGA), NODES) is None, "half a turn too little"


def test_frequencies_are_folded() -> None:
    assert np.allclose(folded([1.0, 2.0, 4.0, 7.4, 9.0], 3.0), [1.0, 1.0, 1.0, 1.4, 0.0])


class Measured(ss.models.Structure):
    """A structure that is known by its receptance alone."""

    load_shapes = ()

    def __init__(self, structure):
        self._own, self.dofs, self.natural_frequencies = structure, structure.dofs, structure.natural_frequencies

    def project(self, rows, columns, shapes=()):
        return self._own.project(rows, columns, shapes)

    def time_equations(self, rows, columns, shapes=()):
        raise ss.InputError("a measured structure has no equations in time")


@pytest.mark.parametrize(("problem", "omega"), [(oscillator(10.0), 4.25), (two_dofs(ss.RubbingMotion()), 6.0)])
def test_a_structure_known_by_receptances_is_judged_by_counting(problem, omega) -> None:
    measured = ss.Problem(
        Measured(problem.structure), contacts=problem.contacts, loads=problem.loads, harmonics=problem.harmonics
    )
    found = point_at(measured, omega, stability=True).stability
    assert (found.unstable, found.method, found.multipliers.size) == (0, "count", 0)


def test_growing_vibration_is_counted() -> None:
    """Sliding of a mode-coupled oscillator beyond its flutter: one pair grows, by pieces and by counting."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.5 * np.eye(2), K=[[100.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"])
    contact = ss.FrictionContact(kt=200.0, mu=0.7, kn=40.0, gap=-50.0 / 40.0)
    pair = ss.ContactPair(
        name="pad", tangential="x", normal="y", contact=contact, rubbing=ss.RubbingMotion(velocity=100.0)
    )
    problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=0.1)], harmonics=range(4))
    point = point_at(problem, 7.0)
    watch = StabilityWatch(Balance(problem))
    form = watch.form(point.x, point.detail)
    assert watch.at(point.x, point.detail).unstable == 2
    assert count_unstable(form, strip([], 7.0)) == 2
