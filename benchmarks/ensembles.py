"""Processor time of the cases of a study of oscillators, in lockstep and alone.

    OMP_NUM_THREADS=1 python benchmarks/ensembles.py [CASES]

The oscillator with a friction contact of random stiffness, friction coefficient and normal load, harmonics 0..10, 2 to
15 rad/s, with and without rubbing. Peaks of the first cases are set against those of ``ss.forced_response``.
"""

from __future__ import annotations

import sys
import time
import warnings
from typing import Any

from clocks import one_thread

import slipstick as ss
from slipstick.verify.cases import oscillator

Row = dict[str, Any]

RANGES = {"damper.kt": [60.0, 140.0], "damper.mu": [0.2, 0.4], "damper.normal_load": [500.0, 1100.0]}
SPAN = (2.0, 15.0)
COMPARED = 24


def study(velocity: float, cases: int) -> Any:
    """The cases, one process."""
    problem = oscillator(velocity=velocity)
    return ss.study(problem, RANGES, omega=SPAN, method="latin-hypercube", samples=cases, workers=1)


def measure(cases: int = 256) -> list[Row]:
    """Milliseconds of processor time a curve, with everything that a study does; difference of peaks."""
    with one_thread(), warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)
        return [_row(velocity, cases) for velocity in (0.0, 10.0, 100.0)]


def _row(velocity: float, cases: int) -> Row:
    study(velocity, 2)
    begin = time.process_time()
    found = study(velocity, cases)
    seconds = time.process_time() - begin
    alone, differences = 0.0, []
    for case in range(COMPARED):
        problem = oscillator(velocity=velocity)
        for name in RANGES:
            problem = problem.with_parameter(name, float(found[name][case]))
        begin = time.process_time()
        branch = ss.forced_response(problem, omega=SPAN)
        alone += time.process_time() - begin
        peak = max(size for _, size in branch.peaks("x"))
        differences.append(abs(float(found["peak_amplitude"][case, 0]) / peak - 1.0))
    each = 1e3 * alone / COMPARED
    return {
        "case": f"oscillator, v = {velocity:g}", "cases": cases, "in lockstep": int(found["lockstep"].sum()),
        "ms a curve": 1e3 * seconds / cases, "ms alone": each, "alone over": each * cases / (1e3 * seconds),
        "difference of peaks": max(differences),
    }  # fmt: skip


if __name__ == "__main__":
    for row in measure(*map(int, sys.argv[1:2])):
        print(row)
