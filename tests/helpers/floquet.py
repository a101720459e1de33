"""Floquet multipliers by exact integration in time: no harmonics, no contact element."""

import numpy as np

from slipstick.analysis.time_domain.event_integrator import Stepper
from slipstick.analysis.time_domain.initial_state import HarmonicStart, start_from_motion
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear, State
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.analysis.time_domain.shooting import one_period, periods


def exact_multipliers(problem, omega, X, Y, *, held=None, most=60, tolerance=1e-11):
    """Of the periodic motion that shooting finds from the contacts' motion (n, L); None where it finds none.

    With them the change of the start over a period that is left, and contacts stuck all period.
    """
    system = friction_system(problem, omega, held)
    stepper = Stepper(PiecewiseLinear(system))
    start = HarmonicStart(harmonics=problem.harmonics, tangential=X, normal=Y)
    z, states = start_from_motion(stepper, start)
    for end in periods(stepper, z, states, shooting=True):
        if end.change < tolerance:
            break
        if end.period > most:
            return None
    changed = set()
    for item in stepper.period(end.z, end.states):
        if hasattr(item, "before"):
            changed.add(item.contact)
    Phi = one_period(stepper, end.z, end.states, True)
    stuck = [j for j, s in enumerate(end.states) if s is State.STICK and j in changed]
    keep = [*range(2 * system.n), *(2 * system.n + j for j in stuck)]
    found = np.linalg.eigvals(Phi[np.ix_(keep, keep)]).astype(complex)
    motion = np.array([stepper.model(end.states).motion @ end.z])
    return found[np.argsort(-np.abs(found))], motion, end.z


def distance(found, wanted, least=1e-3):
    """Largest distance of wanted multipliers above ``least`` to those found, each of which is taken once."""
    left, worst = list(found), 0.0
    for m in sorted(wanted, key=lambda m: -abs(m)):
        if abs(m) > least:
            near = min(range(len(left)), key=lambda i: abs(left[i] - m))
            worst = max(worst, abs(left.pop(near) - m))
    return worst
