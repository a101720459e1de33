"""Processor time of the cases of a study of oscillators, in lockstep and alone.

    OMP_NUM_THREADS=1 python benchmarks/ensembles.py [CASES]
    OMP_NUM_THREADS=1 python benchmarks/ensembles.py sizes [CASES]
    OMP_NUM_THREADS=1 python benchmarks/ensembles.py truncation [CASES]

The oscillator with a friction contact of random stiffness, friction coefficient and normal load, harmonics 0..10, 2 to
15 rad/s, with and without rubbing. Peaks of the first cases are set against those of ``ss.forced_response``. ``sizes``:
chains of such oscillators, followed in lockstep, each alone, and as a study chooses; it says up to how many unknowns
lockstep pays, which ``slipstick.analysis.curve.lockstep.MOST_UNKNOWNS`` holds. ``truncation``:
the share of a study that the estimate of the harmonics left out takes, with contacts 1 to 100 times as stiff.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
from clocks import interleaved, one_thread

import slipstick as ss
from slipstick.analysis.curve import lockstep
from slipstick.results import record
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


CHAINS = ((1, 11), (2, 11), (7, 4), (5, 6), (3, 11), (4, 11), (5, 11), (8, 11))
"""Contacts and harmonics, with the mean."""


def chain(contacts: int, harmonics: int) -> ss.Problem:
    """Oscillators side by side with a spring between neighbours, each with its contact."""
    n, dofs = contacts, [f"x{i}" for i in range(contacts)]
    K = 80.0 * np.eye(n) - 20.0 * (np.eye(n, k=1) + np.eye(n, k=-1))
    structure = ss.MatrixStructure(M=np.eye(n), C=0.4 * np.eye(n), K=K, dofs=dofs)
    pairs = [
        ss.ContactPair(name=f"c{i}", tangential=dof, contact=ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0))
        for i, dof in enumerate(dofs)
    ]
    loads = [ss.Load(dof=dof, sin=100.0) for dof in dofs]
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(harmonics))


def by_size(cases: int = 16) -> Iterator[Row]:
    """Milliseconds of processor time a case by the number of unknowns: in lockstep, each alone, as a study chooses, and
    of the curves themselves."""
    with one_thread(), warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)
        yield from (_of_size(*size, cases) for size in CHAINS)


def _of_size(contacts: int, harmonics: int, cases: int) -> Row:
    problem, chosen = chain(contacts, harmonics), lockstep.MOST_UNKNOWNS
    values = np.linspace(500.0, 1100.0, cases)

    def solved(most: int) -> None:
        lockstep.MOST_UNKNOWNS = most
        try:
            ss.study(problem, {"c0.normal_load": values.tolist()}, omega=SPAN, workers=1)
        finally:
            lockstep.MOST_UNKNOWNS = chosen

    def curves() -> None:
        for value in values.tolist():
            ss.forced_response(problem.with_parameter("c0.normal_load", value), omega=SPAN)

    ways = [lambda: solved(10**6), lambda: solved(0), lambda: solved(chosen), curves]
    together, alone, study_, one_by_one = 1e3 / cases * interleaved(ways, 1).min(axis=0)
    return {
        "contacts": contacts, "unknowns": contacts * (2 * harmonics - 1), "ms in lockstep": together, "ms alone": alone,
        "lockstep over alone": together / alone, "ms of the study": study_, "ms of its curves": one_by_one,
        "study over curves": study_ / one_by_one,
    }  # fmt: skip


def truncation_share(cases: int = 64) -> Iterator[Row]:
    """Share of the processor time of lockstep studies, and of the points whose estimate is above 0.001."""
    known = record.truncation
    for harmonics in (11, 6):
        seconds, estimates = [0.0], list[Any]()

        def timed(*given: Any, seconds: list[float] = seconds, estimates: list[Any] = estimates) -> Any:
            begin = time.process_time()
            estimates.append(known(*given))
            seconds[0] += time.process_time() - begin
            return estimates[-1]

        problem = oscillator(velocity=10.0, harmonics=range(harmonics))
        values = {"damper.kt": np.geomspace(100.0, 1e4, cases).tolist()}
        record.truncation = timed
        try:
            with one_thread(), warnings.catch_warnings():
                warnings.simplefilter("ignore", ss.SlipstickWarning)
                ss.study(problem, {"damper.kt": [100.0, 200.0]}, omega=SPAN, workers=1)
                seconds[0], begin = 0.0, time.process_time()
                estimates.clear()
                ss.study(problem, values, omega=SPAN, workers=1)
                whole = time.process_time() - begin
        finally:
            record.truncation = known
        share = np.mean(np.concatenate(estimates) > 1e-3)
        yield {
            "harmonics": harmonics - 1, "share of the time": seconds[0] / whole, "points above 0.001": share,
            "ms a case": 1e3 * whole / cases,
        }  # fmt: skip


WAYS = {"sizes": by_size, "truncation": truncation_share}

if __name__ == "__main__":
    if sys.argv[1:2] and sys.argv[1] in WAYS:
        for row in WAYS[sys.argv[1]](*map(int, sys.argv[2:3])):
            print({name: round(float(value), 2) for name, value in row.items()}, flush=True)
    else:
        for row in measure(*map(int, sys.argv[1:2])):
            print(row)
