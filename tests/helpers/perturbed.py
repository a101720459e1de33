"""Random structures with rubbing contacts, and what integration in time says of a disturbed start."""

import warnings

import numpy as np

import slipstick as ss
from slipstick.analysis.time_domain.event_integrator import ChatteringError, Stepper
from slipstick.analysis.time_domain.initial_state import HarmonicStart, start_from_motion
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.analysis.time_domain.shooting import periods

_GROWTH = 40.0
"""What a disturbance is to grow or shrink by, at the rate of the largest multiplier."""


def random_contacts(seed):
    """One to eight contacts on two to six dofs, all states: a problem and a frequency."""
    rng = np.random.default_rng(seed)
    n, count = int(rng.integers(2, 7)), int(rng.integers(1, 9))
    root = rng.normal(size=(n, n))
    K = 12.0 * root @ root.T + 20.0 * np.eye(n)
    C = rng.choice([0.01, 0.03]) * K / np.sqrt(40.0) + rng.choice([0.1, 0.3]) * np.eye(n)
    structure = ss.MatrixStructure(M=np.eye(n), C=C, K=K, dofs=[f"q{i}" for i in range(n)])
    pairs = []
    for c in range(count):
        a, b = rng.permutation(n)[:2]
        normal = None if rng.random() < 0.2 else {f"q{b}": float(rng.choice([-1.0, 1.0]))}
        gap = float(
            rng.choice([-1.0, -0.3, -2.0] if normal is None else [-1.0, -0.3, 0.1, -2.0]) * rng.uniform(0.5, 1.5)
        )
        contact = ss.FrictionContact(
            kt=rng.uniform(10.0, 100.0), mu=rng.uniform(0.1, 0.9), kn=rng.uniform(5.0, 60.0), gap=gap
        )
        rubbing = ss.RubbingMotion(velocity=float(rng.choice([0.0, 0.0, 1.0, -3.0, 10.0])))
        pairs.append(ss.ContactPair(name=f"c{c}", tangential=f"q{a}", normal=normal, contact=contact, rubbing=rubbing))
    loads = [ss.Load(dof=f"q{i}", cos=rng.normal() * 30.0, sin=rng.normal() * 30.0) for i in range(2)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(11)), float(rng.uniform(3.0, 12.0))


def random_stops(seed):
    """One or two stiff stops with a gap on one to three dofs, some with friction, few harmonics: problem, frequency."""
    rng = np.random.default_rng(seed)
    n, count = int(rng.integers(1, 4)), int(rng.integers(1, 3))
    root = rng.normal(size=(n, n))
    K = 0.3 * root @ root.T + np.eye(n)
    structure = ss.MatrixStructure(
        M=np.eye(n), C=rng.choice([0.02, 0.05, 0.1]) * K, K=K, dofs=[f"q{i}" for i in range(n)]
    )
    mu, pairs = float(rng.choice([0.0, 0.0, 0.3])), []
    for c in range(count):
        a, b = int(rng.integers(n)), int(rng.integers(n))
        normal = {f"q{b}": float(rng.choice([-1.0, 1.0]))}
        contact = ss.FrictionContact(
            kt=float(rng.uniform(1.0, 20.0)), mu=mu, kn=float(np.exp(rng.uniform(np.log(3.0), np.log(100.0)))),
            gap=float(rng.choice([1.0, 0.5, 0.1, -0.1])),
        )  # fmt: skip
        pairs.append(ss.ContactPair(name=f"c{c}", tangential=f"q{a}", normal=normal, contact=contact))
    loads = [ss.Load(dof=f"q{int(rng.integers(n))}", cos=float(rng.uniform(0.1, 2.0)))]
    highest = int(rng.choice([5, 10, 15, 21]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(highest + 1)), float(
            rng.uniform(0.4, 3.0)
        )


def grows_in_time(problem, omega, X, Y, largest, *, most=400):
    """Whether a disturbed start leaves the periodic motion; None where that motion is not found in time.

    ``largest`` is the magnitude that says how many periods tell.
    """
    system = friction_system(problem, omega)
    stepper = Stepper(PiecewiseLinear(system))
    z, states = start_from_motion(stepper, HarmonicStart(harmonics=problem.harmonics, tangential=X, normal=Y))
    size = np.abs(z[: 2 * system.n]).max()
    try:
        for end in periods(stepper, z, states, shooting=True):
            if end.change < 1e-11 or end.period > 60:
                break
        near = np.abs(end.z - z)[: 2 * system.n].max() < 0.05 * size
        if end.change > 1e-9 or not near:
            return None
        steps = int(min(most, max(6, np.ceil(np.log(_GROWTH) / max(abs(np.log(largest)), 1e-9)))))
        return _ratio(stepper, end, size, steps) > 1.0
    except ChatteringError:
        return None


def _ratio(stepper, end, size, steps):
    """Growth of a small disturbance over the second half of some periods."""
    rng, n = np.random.default_rng(0), stepper.model.system.n
    other = end.z.copy()
    other[: 2 * n] += 1e-6 * size * rng.normal(size=2 * n)
    one, two = (end.z, end.states), (other, end.states)
    middle = 1.0
    for k in range(2 * (steps // 2)):
        moved = []
        for z, states in (one, two):
            for _ in stepper.period(z, states):
                pass
            moved.append((stepper.z, stepper.states))
        one, two = moved
        distance = float(np.abs(one[0] - two[0])[: 2 * n].max())
        if distance > 1e-3 * size:
            return np.inf
        if k + 1 == steps // 2:
            middle = distance
    return distance / middle if distance > 1e-13 * size else 0.0
