"""One batch of mixed elements, ours and the sampled rivals': microseconds an element on one core, and errors.

    OMP_NUM_THREADS=1 python benchmarks/element.py [5 10 20 40]

The sampled evaluations are compiled and written as well as we could: ``aft_rival.py`` in two versions, ``aft_runs.py``
in the best form we know. All three give the same numbers, so that their errors are the same.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, NamedTuple

import aft_rival
import aft_runs
import numpy as np
from clocks import interleaved, one_thread

import slipstick as ss
from slipstick.contact.forces import ContactForces, element_forces
from slipstick.trig.harmonics import Harmonics

COUNT = 500
HARMONICS = (5, 10, 20, 40)
SAMPLES = tuple(128 << k for k in range(10))
CARRIED = (128, 512, 1024)
"""Samples at which the versions that carry derivatives along are measured."""
WANTED = (1e-4, 1e-6, 1e-8)
Row = dict[str, Any]


def batch(orders: range = range(11), count: int = COUNT, seed: int = 0) -> dict[str, np.ndarray]:
    """Elements that stick all period, slip and stick, slip all period, open and close; one in three without rubbing."""
    rng = np.random.default_rng(seed)
    L = 2 * len(orders) - 1
    m = np.concatenate([[1.0], np.repeat(np.arange(1.0, len(orders)), 2)])
    X, Y = rng.normal(size=(count, L)) / m**1.5, 0.5 * rng.normal(size=(count, L)) / m**1.5
    swing = np.abs(Y[:, 1:]).sum(axis=1)
    gap = Y[:, 0] - swing * rng.uniform(0.2, 2.0, count)
    v = rng.normal(size=count) * rng.choice([0.0, 1.0, 6.0], count)
    kt = rng.uniform(0.2, 3.0, count)
    kt[rng.random(count) < 0.2] *= 0.05
    return {
        "X": X, "Y": Y, "v": v, "kt": kt, "gap": gap,
        "mu": rng.uniform(0.1, 0.6, count), "kn": rng.uniform(0.5, 2, count),
    }  # fmt: skip


def regime(states: list[Any]) -> str:
    """What an element does."""
    names = {name for _, _, name in states}
    if len(states) > 1:
        return "opens and closes" if "separation" in names else "sticks and slips"
    return {"stick": "stuck all period", "separation": "separated all period"}.get(*names, "full slip")


class Errors(NamedTuple):
    """Largest error of each element over its largest entry: of the friction or the normal force, whichever is worse;
    of the tangents of the friction force by motion."""

    force: np.ndarray
    tangent: np.ndarray


def errors(found: tuple[np.ndarray, ...], f: ContactForces, counted: np.ndarray) -> Errors:
    """Of a sampled evaluation against the exact one."""
    Fx, Fy, dFx, _ = found
    exact = np.concatenate([f.dFx_dX, f.dFx_dY], axis=2)
    force = np.maximum(_relative(Fx, f.Fx), _relative(Fy, f.Fy))
    return Errors(force[counted], _relative(dFx[:, :, : exact.shape[2]], exact)[counted])


def _relative(found: np.ndarray, exact: np.ndarray) -> np.ndarray:
    axes = tuple(range(1, exact.ndim))
    size = np.abs(exact).max(axis=axes)
    return np.abs(found - exact).max(axis=axes) / np.where(size > 0.0, size, 1.0)


def sampled(orders: range, state: dict[str, np.ndarray]) -> Iterator[tuple[str, int, Callable[[], Any]]]:
    """Name, samples and call of every rival."""
    for n in CARRIED:
        table = aft_rival.tables(orders, n)
        for version, name in (("propagate", "derivatives carried along"), ("tuned", "derivatives by BLAS")):
            yield name, n, partial(aft_rival.evaluate, orders, **state, table=table, version=version)
    for n in SAMPLES:
        yield "prefix sums", n, partial(aft_runs.evaluate, aft_runs.Tables(orders, n), **state)


def measure(n: int, repeats: int = 7) -> list[Row]:
    """Rows for harmonics 0 .. n."""
    orders = range(n + 1)
    state, h = batch(orders), Harmonics(orders)
    ours = partial(element_forces, h, **state)
    with one_thread():
        rivals = list(sampled(orders, state))
        quick = [r for r in rivals if r[1] <= 4096]
        times = interleaved([ours, *(call for _, _, call in quick)], repeats)
        slow = [r for r in rivals if r[1] > 4096]
        long_times = interleaved([ours, *(call for _, _, call in slow)], 3)
        f = ours()
        # stuck all period without rubbing the mean force is not unique: the sampled one keeps what it started from
        counted = (f.stick_fraction < 1 - 1e-9) | (state["v"] != 0)
        own = np.concatenate([times[:, 0], long_times[:, 0]])
        rows = [_row(n, "exact", 0, own, float(np.median(own)), Errors(np.zeros(1), np.zeros(1)))]
        for (name, samples, call), t in zip([*quick, *slow], [*times.T[1:], *long_times.T[1:]], strict=True):
            rows.append(_row(n, name, samples, t, float(np.median(own)), errors(call(), f, counted)))
    return rows


def _row(n: int, name: str, samples: int, t: np.ndarray, ours: float, e: Errors) -> Row:
    return {
        "harmonics": n, "evaluation": name, "samples": samples,
        "us": float(1e6 * t.min() / COUNT), "us, median": 1e6 * float(np.median(t)) / COUNT,
        "over exact": float(np.median(t) / ours),
        "force error, median": float(np.median(e.force)), "force, worst": float(e.force.max()),
        "tangent error, median": float(np.median(e.tangent)), "tangent, worst": float(e.tangent.max()),
    }  # fmt: skip


def equal_accuracy(rows: list[Row]) -> list[Row]:
    """Samples the best sampled form needs for an error, and what it costs there against the exact element."""
    out = []
    keys = {
        "force, median": "force error, median", "force, worst": "force, worst",
        "tangent, median": "tangent error, median", "tangent, worst": "tangent, worst",
    }  # fmt: skip
    for n in dict.fromkeys(row["harmonics"] for row in rows):
        own = [row for row in rows if row["harmonics"] == n and row["evaluation"] == "prefix sums"]
        for wanted in WANTED:
            line: Row = {"harmonics": n, "error": wanted}
            for name, key in keys.items():
                first = next((row for row in own if row[key] <= wanted), None)
                line[name] = (
                    f"not at {SAMPLES[-1]}" if first is None else f"{first['samples']}: {first['over exact']:.2g} x"
                )
            out.append(line)
    return out


def by_regime(n: int = 10, repeats: int = 15) -> list[Row]:
    """Microseconds of the exact element by what it does."""
    orders = range(n + 1)
    state, h = batch(orders, 4 * COUNT), Harmonics(orders)
    apart = {key: value[:COUNT].copy() for key, value in state.items()}
    apart["gap"] = apart["Y"][:, 0] + np.abs(apart["Y"][:, 1:]).sum(axis=1) + 1.0
    states = element_forces(h, **state).states
    kinds = [regime(s) for s in states]
    parts = {kind: np.array([k == kind for k in kinds]) for kind in Counter(kinds)}
    groups = {kind: {key: value[part][:COUNT] for key, value in state.items()} for kind, part in parts.items()}
    groups["separated all period"] = apart
    with one_thread():
        times = interleaved([partial(element_forces, h, **group) for group in groups.values()], repeats)
    return [
        {
            "the element": kind, "harmonics": n, "elements": len(group["v"]),
            "intervals": float(np.mean([len(s) for s, k in zip(states, kinds, strict=True) if k == kind] or [1])),
            "us": float(1e6 * t.min() / len(group["v"])), "us, median": 1e6 * float(np.median(t)) / len(group["v"]),
        }
        for (kind, group), t in zip(groups.items(), times.T, strict=True)
    ]  # fmt: skip


def one_by_one(n: int = 10, repeats: int = 15) -> list[Row]:
    """Microseconds of one element: by the public call, which checks what it is given, and by what it stands on."""
    h, rng = Harmonics(range(n + 1)), np.random.default_rng(0)
    contact, rubbing = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0), ss.RubbingMotion(velocity=10.0)
    X, Y = rng.normal(size=(2, h.size))
    of_batch = {name: np.array([value]) for name, value in contact.values.items()}

    def public() -> None:
        for _ in range(COUNT):
            ss.contact_forces(contact, h, X, Y, omega=4.25, rubbing=rubbing)

    def inside() -> None:
        for _ in range(COUNT):
            element_forces(h, X[None], Y[None], v=np.array([10.0 / 4.25]), **of_batch)

    with one_thread():
        times = interleaved([public, inside], repeats)
    return [
        {
            "call": name,
            "harmonics": n,
            "us": float(1e6 * t.min() / COUNT),
            "us, median": 1e6 * float(np.median(t)) / COUNT,
        }
        for name, t in zip(("ss.contact_forces", "element_forces"), times.T, strict=True)
    ]


if __name__ == "__main__":
    for number in map(int, sys.argv[1:] or HARMONICS):
        found = measure(number)
        for line in [*found, *equal_accuracy(found)]:
            print("  ".join(f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}" for k, v in line.items()))
    for line in [*by_regime(), *one_by_one()]:
        print(line)
