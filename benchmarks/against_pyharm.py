"""Against pyHarm (``pyharm-os``): one friction element and one curve, both sides in turn on the same inputs.

    python -m venv /tmp/pyharm && /tmp/pyharm/bin/pip install pyharm-os
    PYHARM_PYTHON=/tmp/pyharm/bin/python OMP_NUM_THREADS=1 python benchmarks/against_pyharm.py

pyHarm brings its own versions of numpy and numba, so it runs in its own environment; the comparison is left out where
there is none.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from clocks import interleaved, one_thread

import slipstick as ss
from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics

SIDE = Path(__file__).with_name("pyharm_side.py")
OSCILLATOR = {"m": 1.0, "c": 0.4, "k": 40.0, "p": 100.0, "kt": 100.0, "mu": 0.3, "load": 800.0, "harmonics": 10}
RANGE = (2.0, 15.0)
SOLVERS = (("NewtonRaphson", "arc_length"), ("scipyroot", "pseudo_arc_length"))
STEPS, CURVE_SAMPLES, ELEMENT_SAMPLES = (0.1, 0.5, 1.0), (128, 256, 1024), (128, 256, 1024, 4096)
ABSENT = "left out: PYHARM_PYTHON names no Python that has pyharm-os"
Row = dict[str, Any]


class Side:
    """pyHarm in its own process: a task a line, an answer a line."""

    def __init__(self, python: str, script: Path = SIDE) -> None:
        self._script = script
        self._folder = tempfile.TemporaryDirectory()  # pyHarm leaves files where it is run
        self._process = subprocess.Popen(
            [python, str(script)], cwd=self._folder.name, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.version = self._answer()["version"]

    def __enter__(self) -> Side:
        return self

    def __exit__(self, *_: object) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait()
        self._folder.cleanup()

    def ask(self, what: str, **task: Any) -> dict[str, Any]:
        assert self._process.stdin is not None
        print(json.dumps({"what": what, **OSCILLATOR, **task}), file=self._process.stdin, flush=True)
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the other side ended; run {self._script} with its Python to see why")
        return dict(json.loads(line))


def python() -> str | None:
    """The Python that has pyHarm, or None."""
    named = os.environ.get("PYHARM_PYTHON")
    if not named:
        return None
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([named, "-c", "import pyHarm"], cwd=folder, capture_output=True, check=False)
    return named if done.returncode == 0 else None


def states(count: int = 100) -> np.ndarray:
    """Motions (count, L) that stick and slip under a constant load."""
    n = int(OSCILLATOR["harmonics"])
    m = np.concatenate([[1.0], np.repeat(np.arange(1.0, n + 1), 2)])
    return np.asarray(8.0 * np.random.default_rng(1).normal(size=(count, m.size)) / m**1.5)


def element(side: Side, rounds: int = 3) -> list[Row]:
    """Microseconds and errors of force and tangent by motion: one element after the other, and ours as a batch."""
    X, h = states(), Harmonics(range(int(OSCILLATOR["harmonics"]) + 1))
    kt, mu, load = (OSCILLATOR[key] for key in ("kt", "mu", "load"))
    contact = ss.FrictionContact(kt=kt, mu=mu, kn=1.0, gap=-load)
    ones, Y = np.ones(len(X)), np.zeros_like(X)
    batch = partial(element_forces, h, X, Y, v=0 * ones, kt=kt * ones, mu=mu * ones, kn=ones, gap=-load * ones)

    def singly() -> None:
        for x, y in zip(X, Y, strict=True):
            ss.contact_forces(contact, h, x, y, omega=1.0)

    exact = batch()
    counted = exact.stick_fraction < 1 - 1e-9
    own: list[np.ndarray] = []
    answers: dict[int, list[dict[str, Any]]] = {n: [] for n in ELEMENT_SAMPLES}
    for _ in range(rounds):
        with one_thread():
            own.append(interleaved([batch, singly], 5) / len(X))
        for n, found in answers.items():
            found.append(side.ask("element", samples=n, X=X.tolist(), repeats=3))
    times = np.concatenate(own)
    rows = [_row("slipstick, a batch", 0, times[:, 0], np.median(times[:, 0]), 0.0, 0.0, 0.0, 0.0)]
    rows.append(_row("slipstick, one call each", 0, times[:, 1], np.median(times[:, 0]), 0.0, 0.0, 0.0, 0.0))
    for n, found in answers.items():
        seconds = np.concatenate([a["seconds"] for a in found])
        force = _errors(np.array(found[0]["F"]), exact.Fx)[counted]
        tangent = _errors(np.array(found[0]["J"]), exact.dFx_dX)[counted]
        rows.append(
            _row(f"pyHarm {side.version}", n, seconds, np.median(times[:, 0]),
                 np.median(force), force.max(), np.median(tangent), tangent.max())
        )  # fmt: skip
    return rows


def _errors(found: np.ndarray, exact: np.ndarray) -> np.ndarray:
    axes = tuple(range(1, exact.ndim))
    return np.asarray(np.abs(found - exact).max(axis=axes) / np.abs(exact).max(axis=axes))


def _row(name: str, samples: int, t: np.ndarray, ours: float, f: float, F: float, j: float, J: float) -> Row:
    return {
        "evaluation": name, "samples": samples, "us": float(1e6 * t.min()), "us, median": float(1e6 * np.median(t)),
        "over our batch": float(np.median(t) / ours), "force error, median": float(f), "force, worst": float(F),
        "tangent error, median": float(j), "tangent, worst": float(J),
    }  # fmt: skip


def _problem() -> ss.Problem:
    o = OSCILLATOR
    structure = ss.MatrixStructure(M=[[o["m"]]], C=[[o["c"]]], K=[[o["k"]]], dofs=["x"])
    contact = ss.FrictionContact(kt=o["kt"], mu=o["mu"], normal_load=o["load"])
    damper = ss.ContactPair(name="damper", contact=contact, tangential="x")
    loads = [ss.Load(dof="x", harmonic=1, sin=o["p"])]
    return ss.Problem(structure, contacts=[damper], loads=loads, harmonics=range(int(o["harmonics"]) + 1))


def curve(side: Side, rounds: int = 3) -> list[Row]:
    """Seconds, points and the peak of the oscillator's curve; pyHarm at several numbers of samples and steps, each with
    the quicker of two pairs of solver and corrector."""
    problem = _problem()
    settings = [(n, step, *solver) for n in CURVE_SAMPLES for step in STEPS for solver in SOLVERS]
    own: list[float] = []
    found: dict[Any, list[dict[str, Any]]] = {setting: [] for setting in settings}
    branch = ss.forced_response(problem, omega=RANGE)
    for _ in range(rounds):
        own += interleaved([partial(ss.forced_response, problem, omega=RANGE)], 2)[:, 0].tolist()
        for n, step, solver, corrector in settings:
            task = {"samples": n, "step": step, "solver": solver, "corrector": corrector}
            found[n, step, solver, corrector].append(side.ask("sweep", **task, **{"from": RANGE[0], "to": RANGE[1]}))
    peak = max(branch.peaks("x"), key=lambda p: p[1])
    rows = [
        curve_row("slipstick, peak located", 0, "", np.array(own), len(branch), peak[1], 0.0, float(np.median(own)))
    ]
    for n in CURVE_SAMPLES:
        for step in STEPS:
            both = {s: np.array([a["seconds"] for a in found[n, step, *s]]) for s in SOLVERS}
            quick = min(SOLVERS, key=lambda s: both[s].min())
            last = found[n, step, *quick][-1]
            error = abs(last["peak"] / peak[1] - 1.0)
            name = f"pyHarm {side.version}, {quick[0]}"
            rows.append(
                curve_row(name, n, step, both[quick], last["points"], last["peak"], error, float(np.median(own)))
            )
    return rows


def curve_row(name: str, n: int, step: Any, t: np.ndarray, points: int, peak: float, error: float, own: float) -> Row:
    """``error`` of the peak; ``own``: our seconds."""
    return {
        "curve by": name, "samples": n, "largest step": step, "s": float(t.min()), "s, median": float(np.median(t)),
        "over ours": float(np.median(t) / own), "points": points, "ms a point": float(1e3 * t.min() / points),
        "peak": float(peak), "peak error": float(error),
    }  # fmt: skip


def show(rows: list[Row]) -> None:
    """A line each."""
    for line in rows:
        print("  ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in line.items()))


if __name__ == "__main__":
    chosen = python()
    if chosen is None:
        print(ABSENT)
    else:
        with Side(chosen) as other:
            show([*element(other), *curve(other)])
