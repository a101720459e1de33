"""Friction in two directions beside the elements of pyHarm and tmdsimpy: their own code, on the same inputs, in turn.

    python -m venv /tmp/others && /tmp/others/bin/pip install pyharm-os
    git clone https://github.com/tmd-lab/tmdsimpy /tmp/tmdsimpy
    echo /tmp/tmdsimpy > $(ls -d /tmp/others/lib/python*/site-packages)/tmdsimpy.pth
    PYHARM_PYTHON=/tmp/others/bin/python OMP_NUM_THREADS=1 python benchmarks/planar_against_others.py

What they have: pyHarm's ``Jenkins`` with two directions is the Coulomb circle under a constant normal load, its
``Penalty3D`` the same circle under a load that varies (after the contact opens its friction keeps the limit of the
preload; it is compared where the contact stays closed). tmdsimpy's ``ElasticDryFriction3D`` opens, and has one limit
for each direction by itself: it is compared with two of our elements of one direction, which are that law.

Errors are those of the friction force over mu N, and of its derivatives by motion over kt, beside our elements at
their finest; of motions with slip, the median and what 95 % are below.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from against_pyharm import ABSENT, OSCILLATOR, SOLVERS, Row, Side, curve_row, python, show
from clocks import interleaved, one_thread

import slipstick as ss
from slipstick.contact.forces import element_forces
from slipstick.contact.law import Motion

SIDE = Path(__file__).with_name("planar_others_side.py")
ORDERS, COUNT, ROUNDS = 10, 40, 3
LAW = {"kt": 1.0, "mu": 0.5, "kn": 1.0, "load": 2.0}
LOADS = {"constant": 0.0, "varying": 0.7, "opening": 1.6}
"""Largest motion along the normal over the approach of the preload."""
TOLERANCES, SAMPLES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-8), (64, 128, 256, 1024, 4096, 16384, 32768)
WANTED = (1e-2, 1e-3, 1e-4, 1e-5)
RIVALS = {
    "constant": ("pyHarm Jenkins",),
    "varying": ("pyHarm Penalty3D", "pyHarm Penalty3D, vmap"),
    "opening": ("tmdsimpy ElasticDryFriction3D", "tmdsimpy ElasticDryFriction3D, vmap"),
}
PATIENCE = 0.6
"""Seconds an element, beyond which no more samples are tried."""
TOGETHER = 1024
"""Samples up to which ``jax.vmap`` may pay."""
CURVE = {"p": 100.0, "q": 60.0}
CURVE_STEPS, CURVE_SAMPLES = (0.1, 0.5), (128, 1024)


class Found(NamedTuple):
    """Both friction forces (n, 2, L), their derivatives by three motions (n, 2, 3, L, L), who slips."""

    F: np.ndarray
    J: np.ndarray
    slips: np.ndarray


def states(load: str) -> np.ndarray:
    """Motions (n, 3, L) that nearly all slip: two directions and the approach."""
    rng, m = np.random.default_rng(3), np.concatenate([[1.0], np.repeat(np.arange(1.0, ORDERS + 1), 2)])
    Q = rng.normal(size=(COUNT, 3, m.size)) / m**1.5
    Q[:, :2] *= 10.0 ** rng.uniform(-0.2, 0.7, (COUNT, 1, 1))
    Q[:, 2, 0] = 0.0
    tau = 2.0 * np.pi * np.arange(1024) / 1024
    largest = np.abs(Q[:, 2] @ ss.Harmonics(range(ORDERS + 1)).H_minus(tau).T).max(axis=1)
    Q[:, 2] *= (LOADS[load] * LAW["load"] / LAW["kn"] / largest)[:, None]
    return np.asarray(Q)


def planar(Q: np.ndarray, tolerance: float) -> Found:
    """Our circle, as a batch."""
    values = {name: np.full(len(Q), LAW[name]) for name in ("kt", "mu", "kn")}
    values["gap"] = np.full(len(Q), -LAW["load"] / LAW["kn"])
    law = ss.PlanarFrictionContact(kt=1.0, mu=1.0, normal_load=1.0, tolerance=tolerance)
    motion = Motion(ss.Harmonics(range(ORDERS + 1)), 1.0, tuple(np.moveaxis(Q, 1, 0).copy()), np.zeros((3, len(Q))))
    r = law.respond(motion, values)
    J = np.stack([np.stack([r.by_motion[i, j] for j in range(3)], axis=1) for i in (0, 1)], axis=1)
    return Found(np.stack(r.force[:2], axis=1), J, np.asarray(r.detail.slip_fraction) > 0.0)


def straight(Q: np.ndarray) -> Found:
    """Two of our elements of one direction on the same approach: a square instead of the circle."""
    n, L = len(Q), Q.shape[2]
    X, Y = Q[:, :2].reshape(2 * n, L), np.repeat(Q[:, 2], 2, axis=0)
    numbers = {name: np.full(2 * n, LAW[name]) for name in ("kt", "mu", "kn")}
    gap = np.full(2 * n, -LAW["load"] / LAW["kn"])
    r = element_forces(ss.Harmonics(range(ORDERS + 1)), X, Y, v=np.zeros(2 * n), gap=gap, **numbers)
    J = np.zeros((n, 2, 3, L, L))
    by_motion, by_approach = r.dFx_dX.reshape(n, 2, L, L), r.dFx_dY.reshape(n, 2, L, L)
    for i in (0, 1):
        J[:, i, i], J[:, i, 2] = by_motion[:, i], by_approach[:, i]
    return Found(r.Fx.reshape(n, 2, L), J, (r.slip_fraction.reshape(n, 2) > 0.0).all(axis=1))


def errors(F: np.ndarray, J: np.ndarray, exact: Found) -> dict[str, float]:
    """Median and 95 %; an element without a normal direction is compared without."""
    force = np.abs(F - exact.F).max(axis=(1, 2)) / (LAW["mu"] * LAW["load"])
    tangent = np.abs(J - exact.J[:, :, : J.shape[2]]).max(axis=(1, 2, 3, 4)) / LAW["kt"]
    return {
        f"{name} error, {part}": float(np.quantile(e[exact.slips], q))
        for name, e in (("force", force), ("tangent", tangent))
        for part, q in (("median", 0.5), ("95 %", 0.95))
    }


def elements(side: Side) -> list[Row]:
    """Microseconds and errors of forces and tangents by load, element and number of samples (or tolerance)."""
    rows: list[Row] = []
    for load, rivals in RIVALS.items():
        Q = states(load)
        exact = planar(Q, 1e-12)
        own: dict[tuple[str, str], Callable[[], Found]] = {
            ("slipstick, circle", f"{tolerance:g}"): partial(planar, Q, tolerance) for tolerance in TOLERANCES
        }
        figures = {name: errors(*call()[:2], exact) for name, call in own.items()}
        if load == "opening":
            exact = straight(Q)
            own["slipstick, square", "exact"] = partial(straight, Q)
            figures["slipstick, square", "exact"] = errors(*exact[:2], exact)
        times: dict[tuple[str, str], list[float]] = {name: [] for name in own}
        for again in range(ROUNDS):
            with one_thread():
                taken = interleaved([*own.values()], 5) / len(Q)
            for name, column in zip(own, taken.T, strict=True):
                times[name] += column.tolist()
            for rival in rivals:
                each = 0.0
                for n in SAMPLES:
                    if again and not (0.0 < min(times.get((rival, str(n)), [0.0])) < 0.02):
                        continue  # the long ones once
                    if each * n > PATIENCE or (n > TOGETHER and "vmap" in rival):
                        break
                    task = {**LAW, "element": rival, "harmonics": ORDERS, "samples": n, "X": Q.tolist(), "repeats": 1}
                    answer = side.ask("element", **task)
                    times.setdefault((rival, str(n)), []).extend(answer["seconds"])
                    figures[rival, str(n)] = errors(np.array(answer["F"]), np.array(answer["J"]), exact)
                    each = min(answer["seconds"]) / n
        rows += [_row(load, *name, np.array(seconds), figures[name]) for name, seconds in times.items()]
    return rows


def _row(load: str, name: str, setting: str, t: np.ndarray, found: dict[str, float]) -> Row:
    """Samples, or the tolerance of ours."""
    us = {"us": float(1e6 * t.min()), "us, median": float(1e6 * np.median(t))}
    return {"normal load": load, "element": name, "samples or tolerance": setting, **us, **found}


def equal_accuracy(rows: list[Row]) -> list[Row]:
    """For each accuracy the cheapest setting of each that reaches it, and its time over that of ours for its law."""
    out: list[Row] = []
    keys = [key for key in rows[0] if "error" in key]
    others = [row for row in rows if not row["element"].startswith("slipstick")]
    for load, name in dict.fromkeys((row["normal load"], _alone(row["element"])) for row in others):
        ours = "slipstick, square" if load == "opening" else "slipstick, circle"
        there = [row for row in rows if row["normal load"] == load]
        own = [row for row in there if row["element"] == ours]
        theirs = [row for row in there if _alone(row["element"]) == name]
        most = max(int(row["samples or tolerance"]) for row in theirs)
        for wanted in WANTED:
            line: Row = {"normal load": load, "element": name, "error": wanted}
            for key in keys:
                found, here = _cheapest(theirs, key, wanted), _cheapest(own, key, wanted)
                line[key.replace(" error", "")] = (
                    f"not at {most}"
                    if found is None or here is None
                    else f"{found['samples or tolerance']}: {found['us, median'] / here['us, median']:.2g} x"
                )
            out.append(line)
    return out


def _alone(element: str) -> str:
    """Its name, whether many are taken together or not."""
    return element.removesuffix(", vmap")


def _cheapest(rows: list[Row], key: str, wanted: float) -> Row | None:
    """Of those that reach an error."""
    return min((row for row in rows if row[key] <= wanted), key=lambda row: float(row["us, median"]), default=None)


def _problem() -> ss.Problem:
    o, eye = OSCILLATOR, np.eye(2)
    structure = ss.MatrixStructure(M=o["m"] * eye, C=o["c"] * eye, K=o["k"] * eye, dofs=["x", "y"])
    contact = ss.PlanarFrictionContact(kt=o["kt"], mu=o["mu"], normal_load=o["load"])
    foot = ss.ContactPair(name="foot", contact=contact, tangential=("x", "y"))
    loads = [ss.Load(dof="x", sin=CURVE["p"]), ss.Load(dof="y", cos=CURVE["q"])]
    return ss.Problem(structure, contacts=[foot], loads=loads, harmonics=range(ORDERS + 1))


def curve(side: Side, span: tuple[float, float] = (2.0, 15.0)) -> list[Row]:
    """Seconds, points and the peak of a mass that slides on a plane, pyHarm's with the quicker of two solvers."""
    problem = _problem()
    settings = [(n, step, *solver) for n in CURVE_SAMPLES for step in CURVE_STEPS for solver in SOLVERS]
    found: dict[Any, list[dict[str, Any]]] = {setting: [] for setting in settings}
    own: list[float] = []
    branch = ss.forced_response(problem, omega=span)
    for again in range(2):
        own += interleaved([partial(ss.forced_response, problem, omega=span)], 3)[:, 0].tolist()
        for n, step, solver, corrector in settings:
            if again == 0 or found[n, step, solver, corrector][0]["seconds"] < 20.0:
                task = {"samples": n, "step": step, "solver": solver, "corrector": corrector, **CURVE}
                answer = side.ask("sweep", **task, **{"from": span[0], "to": span[1]})
                found[n, step, solver, corrector].append(answer)
    peak = max(branch.peaks("x"), key=lambda p: p[1])[1]
    middle = float(np.median(own))
    rows = [curve_row("slipstick, peak located", 0, "", np.array(own), len(branch), peak, 0.0, middle)]
    for n in CURVE_SAMPLES:
        for step in CURVE_STEPS:
            whole = {s: a for s in SOLVERS if (a := found[n, step, *s])[-1]["reached"] > span[1] - step}
            if not whole:
                rows.append({"curve by": "pyHarm, stopped early", "samples": n, "largest step": step})
                continue
            quick = min(whole, key=lambda s: min(a["seconds"] for a in whole[s]))
            last, seconds = whole[quick][-1], np.array([a["seconds"] for a in whole[quick]])
            error, name = abs(last["peak"] / peak - 1.0), f"pyHarm, {quick[0]}"
            rows.append(curve_row(name, n, step, seconds, last["points"], last["peak"], error, middle))
    return rows


if __name__ == "__main__":
    chosen = python()
    if chosen is None:
        print(ABSENT)
    else:
        with Side(chosen, SIDE) as others:
            print(others.version)
            measured = elements(others)
            show([*measured, *equal_accuracy(measured), *curve(others)])
