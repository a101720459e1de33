"""A sector of a ring, whose receptance differs from order to order: its verdicts against the whole ring's."""

import warnings

import numpy as np
import pytest
from helpers.stability import point_at

import slipstick as ss
from slipstick.structure.protocol import TimeEquations

N = 8
COUPLING = 2.0


def stiffness(diameter):
    return 9.0 + 2.0 * COUPLING * (1.0 - np.cos(2.0 * np.pi * diameter / N))


def at(receptance, orders, omega):
    """Receptances and their derivatives by omega from those of one order at one frequency."""
    w = np.asarray(omega, dtype=float)
    found = [[receptance._one(int(m), m * own) for m in np.asarray(orders)] for own in w.reshape(-1)]
    shape = (*w.shape, len(orders), *receptance.static.shape)
    return tuple(np.array([[f[k] for f in row] for row in found], dtype=complex).reshape(shape) for k in (0, 1))


class WaveReceptance(ss.models.Receptance):
    """One dof a sector, stiffness and damping by nodal diameter, seen from a wave in which order m has diameter m."""

    def __init__(self, damping, rows, columns):
        self._damping, self._rows, self._columns = damping, rows, columns
        self.static = self.of_order(0, 0.0).real

    def of_order(self, order, frequency):
        k, c = stiffness(order), self._damping[int(order) % N]
        return self._rows.T @ self._columns / (k + 1j * frequency * c - frequency**2)

    at = at

    def _one(self, m, w):
        A, c = self.of_order(m, w), self._damping[m % N]
        return A, -m * A * (1j * c - 2.0 * w) / (stiffness(m) + 1j * w * c - w**2)


class WaveSector(ss.models.Structure):
    """One sector of a ring that carries a wave of one nodal diameter."""

    load_shapes, dofs = (), ("x",)
    receptance = WaveReceptance

    def __init__(self, damping):
        self.damping = damping

    @property
    def natural_frequencies(self):
        return np.unique(np.sqrt([stiffness(d) for d in range(N)]).round(12))

    def project(self, rows, columns, shapes=()):
        return self.receptance(self.damping, np.asarray(rows), np.asarray(columns))

    def time_equations(self, rows, columns, shapes=(), **_):
        raise ss.InputError("a travelling wave has no equations in time of one sector")


def damping(active=None):
    """Of each nodal diameter, (N,); negative in one."""
    out = np.full(N, 0.3)
    if active is not None:
        out[[active, -active]] = -0.02
    return out


CONTACT = ss.FrictionContact(kt=3.0, mu=0.3, normal_load=2.0)
ORDERS = range(6)


def sector(own):
    pair = ss.ContactPair(name="shroud", tangential="x", contact=CONTACT)
    return ss.Problem(own, contacts=[pair], loads=[ss.Load(dof="x", cos=3.0)], harmonics=ORDERS)


class Ring(ss.models.Structure):
    """All sectors, with equations in time; plain matrices of negative damping are refused."""

    load_shapes, dofs = (), tuple(f"x{s}" for s in range(N))
    natural_frequencies = WaveSector.natural_frequencies

    def __init__(self, own):
        shift = np.exp(-2j * np.pi * np.outer(np.arange(N), np.arange(N)) / N) / np.sqrt(N)
        self.K = (shift.conj() @ np.diag([stiffness(d) for d in range(N)]) @ shift).real
        self.C = (shift.conj() @ np.diag(own) @ shift).real

    def project(self, rows, columns, shapes=()):
        return RingReceptance(self, np.asarray(rows), np.asarray(columns))

    def time_equations(self, rows, columns, shapes=(), **_):
        still = np.zeros((rows.shape[1], columns.shape[1]))
        return TimeEquations(M=np.eye(N), C=self.C, K=self.K, rows=rows.T, columns=columns, feedthrough=still)


class RingReceptance(ss.models.Receptance):
    """Of all sectors."""

    def __init__(self, own, rows, columns):
        self._own, self._rows, self._columns = own, rows, columns
        self.static = self._one(0, 0.0)[0].real

    def _one(self, m, w):
        Z = self._own.K + 1j * w * self._own.C - w * w * np.eye(N)
        X = np.linalg.solve(Z, self._columns)
        return self._rows.T @ X, -m * self._rows.T @ np.linalg.solve(Z, (1j * self._own.C - 2.0 * w * np.eye(N)) @ X)

    at = at


def ring(own):
    """Each sector is loaded later than its neighbour."""
    structure = Ring(own)
    pairs = [ss.ContactPair(name=f"c{s}", tangential=n, contact=CONTACT) for s, n in enumerate(structure.dofs)]
    loads = [ss.Load(dof=n, amplitude=3.0, phase=-2.0 * np.pi * s / N) for s, n in enumerate(structure.dofs)]
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=ORDERS, outputs=structure.dofs)


def judged(problem, omega):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)
        return point_at(problem, omega, stability=True)


@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
def test_a_sector_meets_each_disturbance_with_the_receptance_of_its_order() -> None:
    """Negative damping with one nodal diameter: the wave is as unstable as in the whole ring, judged in time."""
    omega = 1.2
    own = damping(1)
    wave, whole = judged(sector(WaveSector(own)), omega), judged(ring(own), omega)
    assert wave.stability.unstable == whole.stability.unstable == 4
    assert wave.stability.method == "count by order"
    assert np.abs(whole.x.reshape(N, -1)[0] - wave.x).max() < 1e-12
    calm, steady = judged(sector(WaveSector(damping())), omega), judged(ring(damping()), omega)
    assert calm.stability.unstable == steady.stability.unstable == 0


@pytest.mark.parametrize("omega", [1.0, 1.2, 1.27, 1.6])
def test_a_sector_that_feeds_an_order_is_not_called_stable(omega) -> None:
    """Negative damping with three nodal diameters, which harmonics 3 and 5 excite: friction may hold it, or not."""
    assert judged(sector(WaveSector(damping(3))), omega).stability.unstable != 0


def test_which_disturbances_are_judged_is_said() -> None:
    with pytest.warns(ss.SlipstickWarning, match="that break its symmetry are judged only"):
        branch = ss.forced_response(
            sector(WaveSector(damping())),
            omega=(1.2, 1.22),
            options={"max_step": 0.2, "first_step": 0.2},
            stability=True,
        )
    assert set(branch.dataset.stability_method.values.tolist()) == {"count by order"}
    assert set(branch.dataset.stable.values.tolist()) == {1}


class Mute(ss.models.Receptance):
    """A receptance that can be asked for harmonics alone."""

    def __init__(self, *given):
        self._own = WaveReceptance(*given)
        self.static = self._own.static

    def at(self, orders, omega):
        return self._own.at(orders, omega)


class MuteSector(WaveSector):
    """Its sector."""

    receptance = Mute


def test_a_receptance_that_does_not_tell_order_0_leaves_stability_unknown() -> None:
    with pytest.warns(ss.SlipstickWarning, match="has no of_order"):
        point = point_at(sector(MuteSector(damping())), 1.2, stability=True)
    assert point.stability.unstable == -1
