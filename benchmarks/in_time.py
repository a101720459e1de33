"""Time integration of the reduced blade: points checked in time, and periods integrated one after another.

OMP_NUM_THREADS=1 python benchmarks/in_time.py [SRC ...]

Each SRC is a folder with another version of the package: it is measured in turn with this one, in processes of its own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import curves
import numpy as np
from clocks import interleaved, one_thread

import slipstick as ss
from slipstick.analysis.time_domain import check as checks
from slipstick.analysis.time_domain.event_integrator import Stepper
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.errors import SlipstickWarning

Row = dict[str, Any]

POINTS = ("blade 100 %, v = 0", "blade 100 %, v = 1")
MARCHED = 4


def measure(repeats: int = 3) -> list[Row]:
    """Seconds of processor time of a check at the peak, and of a period from rest on, beside the curve's."""
    with one_thread():
        return [_row(name, repeats) for name in POINTS]


def _row(name: str, repeats: int) -> Row:
    build, span = curves.CURVES[name]
    problem = build()
    curve = partial(ss.forced_response, problem, omega=span)
    branch = curve()
    k = int(np.argmax(branch.dataset.amplitude.values[:, 0]))
    omega = float(branch.dataset.omega[k])
    march = partial(ss.transient, problem, omega, method="march", tolerance=0.0)
    check, short, long = (
        partial(branch.check_in_time, k), partial(march, periods=1), partial(march, periods=1 + MARCHED)
    )  # fmt: skip
    seconds = np.median(interleaved([curve, check, short, long], repeats), axis=0)
    told, kept = check(), []
    transient = checks.transient
    checks.transient = lambda *a, **o: kept.append(transient(*a, **o)) or kept[-1]
    try:
        check()
    finally:
        checks.transient = transient
    a_period = (seconds[3] - seconds[2]) / MARCHED
    return {
        "point": name, "curve, s": float(seconds[0]), "check, s": float(seconds[1]),
        "check, curves": float(seconds[1] / seconds[0]), "a period from rest, s": float(a_period),
        "a period, curves": float(a_period / seconds[0]), "periods of all modes": kept[0].periods,
        "steps a period": Stepper(PiecewiseLinear(friction_system(problem, omega))).steps,
        "changes of state": len(kept[0].changes), "change over the last": float(kept[0].change),
        "difference from the balance": float(told.relative_difference),
        "amplitude in time": float(told.amplitude_in_time[0]),
    }  # fmt: skip


def _alternately(sources: list[str], rounds: int = 2) -> None:
    here = str(Path(__file__).parents[1] / "src")
    for _ in range(rounds):
        for source in [*sources, here]:
            command = [sys.executable, "-W", "ignore", __file__]
            done = subprocess.run(
                command, check=True, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": source}
            )
            print(source, f"{time.strftime('%H:%M:%S')}", done.stdout, sep="\n")


if __name__ == "__main__":
    warnings.simplefilter("ignore", SlipstickWarning)
    if sys.argv[1:]:
        _alternately(sys.argv[1:])
    else:
        for row in measure():
            print(json.dumps(row))
