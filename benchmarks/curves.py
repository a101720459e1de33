"""Seconds and work of response curves after warm-up: oscillator (150 points) and reduced blade (200 points).

And what is asked of a curve besides, over the curve itself: derivatives by all parameters, stability, its peak tracked.

OMP_NUM_THREADS=1 python benchmarks/curves.py
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from clocks import interleaved, one_thread

import slipstick as ss
from slipstick.verify.cases import oscillator

Row = dict[str, Any]

BLADE = Path(__file__).parents[1] / "examples" / "blade_reduced" / "blade_reduced.npz"
STIFFNESS, LOAD = 27450.33, 3.96918


def blade(*, level=1.0, velocity=0.0, harmonics=range(6), mu=0.3, viscous=False):
    """The reduced blade with 8 rubbing contacts on its shroud; ``level`` is the normal load over its reference."""
    damping = {"damping_ratio": 0.0005} if viscous else {"loss_factor": 0.001}
    structure = ss.ModalStructure.load(BLADE, **damping)
    contact = ss.FrictionContact(kt=STIFFNESS, mu=mu, kn=STIFFNESS, gap=-level * LOAD / STIFFNESS)
    rubbing = ss.RubbingMotion(velocity=velocity)
    pairs = [
        ss.ContactPair(name=f"c{k}", contact=contact, tangential=f"n{k}y", normal=f"n{k}z", rubbing=rubbing)
        for k in range(1, 9)
    ]
    load = ss.Load(shape=structure.load_shapes[0], sin=2.0)
    return ss.Problem(structure, contacts=pairs, loads=[load], harmonics=harmonics, outputs=["n1y"])


CURVES = {
    "oscillator, v = 0": (lambda: oscillator(velocity=0.0), (2.0, 15.0)),
    "oscillator, v = 10": (lambda: oscillator(velocity=10.0), (2.0, 15.0)),
    "oscillator, v = 100": (lambda: oscillator(velocity=100.0), (2.0, 15.0)),
    "blade 100 %, v = 0": (lambda: blade(), (2 * np.pi * 295, 2 * np.pi * 320)),
    "blade 100 %, v = 1": (lambda: blade(velocity=1.0), (2 * np.pi * 195, 2 * np.pi * 230)),
    "blade 100 %, v = 5": (lambda: blade(velocity=5.0), (2 * np.pi * 195, 2 * np.pi * 230)),
    "blade 400 %, v = 0": (lambda: blade(level=4.0), (2 * np.pi * 295, 2 * np.pi * 320)),
}


def measure(repeats: int = 5) -> list[Row]:
    """Seconds of processor time, work, peak and outcome of each curve."""
    problems = [(build(), span) for build, span in CURVES.values()]
    calls = [partial(ss.forced_response, problem, omega=span) for problem, span in problems]
    with one_thread():
        times = interleaved(calls, repeats)
        branches = [call() for call in calls]
    return [_row(*found) for found in zip(CURVES, times.T, branches, strict=True)]


def besides(repeats: int = 5) -> list[Row]:
    """Seconds of what is asked of a curve besides, and how many curves they are."""
    rows: list[Row] = []
    for name, parameter in (("oscillator, v = 10", "damper.mu"), ("blade 100 %, v = 1", "*.mu")):
        build, span = CURVES[name]
        problem = build()
        follow = partial(ss.forced_response, problem, omega=span)
        branch = follow()
        dof = problem.outputs[0]
        peaks = partial(ss.track_peak, problem, parameter, (0.2, 0.4), dof=dof, omega=span)
        calls = {
            f"derivatives by {branch.sensitivity(dof=dof, points=0).sizes['parameter']} parameters": partial(
                branch.sensitivity, dof=dof
            ),
            "the curve with stability": partial(ss.forced_response, problem, omega=span, stability=True),
            f"the peak at {len(peaks())} points": peaks,
        }
        with one_thread():
            times = interleaved([follow, *calls.values()], repeats)
        rows += [
            {
                "curve": name,
                "besides": what,
                "s": float(t.min()),
                "s, median": float(np.median(t)),
                "curves": float(np.median(t / times[:, 0])),
            }
            for what, t in zip(calls, times.T[1:], strict=True)
        ]
    return rows


def _row(name: str, t: np.ndarray, branch: ss.Branch) -> Row:
    peak = max(branch.peaks(), key=lambda p: p[1], default=(float("nan"), float("nan")))
    points, counters = len(branch), branch.dataset.attrs
    return {
        "curve": name, "s": float(t.min()), "s, median": float(np.median(t)), "points": points,
        "ms a point": float(1e3 * t.min() / points), "evaluations": int(counters["evaluations"]),
        "peak": float(peak[1]), "at, rad/s": float(peak[0]), "outcome": branch.outcome.name,
    }  # fmt: skip


if __name__ == "__main__":
    for row in [*measure(), *besides()]:
        print("  ".join(f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()))
