"""Derivatives that a fit needs, exact against central differences: one measured curve of the oscillator, one core.

    OMP_NUM_THREADS=1 python benchmarks/identification.py

Differences solve every point anew twice a parameter, from the motion before, as cheaply as a fit could.
"""

from __future__ import annotations

import time

import numpy as np

import slipstick as ss
from slipstick.analysis.identification.measured import read_measured
from slipstick.analysis.identification.predicted import predictor_of

POINTS = 36


def oscillator() -> ss.Problem:
    """With a normal load that varies over the period."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    contact = ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, normal_load=300.0)
    rubbing = ss.RubbingMotion(normal_cos={2: 100.0}, normal_sin={1: 60.0})
    pair = ss.ContactPair(name="damper", contact=contact, tangential="x", rubbing=rubbing)
    return ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=100.0), harmonics=range(11))


def measure(names: tuple[str, ...]) -> tuple[float, float]:
    """Seconds of the exact derivatives and of central differences, the best of five."""
    problem = oscillator()
    data = ss.steady_response(problem, omega=np.linspace(5.0, 12.0, POINTS)).dataset[["displacement", "omega"]]
    predictor = predictor_of(problem, names, read_measured(problem, data))
    p = np.array([problem.parameter(name) for name in names]) * 1.02
    predictor.begin(p)
    exact, differences = [], []
    for _ in range(5):
        predictor.values(p)
        began = time.perf_counter()
        predictor.slopes(p)
        exact.append(time.perf_counter() - began)
        began = time.perf_counter()
        for i, h in enumerate(1e-5 * p):
            for way in (1, -1):
                predictor.values(p + way * h * np.eye(p.size)[i])
        differences.append(time.perf_counter() - began)
    return min(exact), min(differences)


if __name__ == "__main__":
    every = ("damper.kt", "damper.mu", "damper.normal_load", "damping", "load.x.amplitude", "load.x.phase")
    for count in (1, 3, 6):
        exact, differences = measure(every[:count])
        print(
            f"{POINTS} points, {count} parameters: exact {1e3 * exact:.1f} ms, central differences "
            f"{1e3 * differences:.1f} ms, {differences / exact:.1f} times"
        )
