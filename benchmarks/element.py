"""One batch of mixed elements: microseconds an element, ours and the sampled rival's, on one core in the same run."""

import time
from collections import Counter
from functools import partial

import aft_rival
import numba
import numpy as np
from threadpoolctl import threadpool_limits

from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics

ORDERS = tuple(range(11))
COUNT = 1000


def batch(count=COUNT, seed=0):
    """Elements that stick all period, slip and stick, slip for good, open and close; one in three without rubbing."""
    rng = np.random.default_rng(seed)
    L = 2 * len(ORDERS) - 1
    m = np.concatenate([[1.0], np.repeat(np.arange(1.0, len(ORDERS)), 2)])
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


def regimes(f):
    """How many elements of each regime are in the batch."""
    kinds = Counter()
    for states in f.states:
        names = {name for _, _, name in states}
        if "separation" in names:
            kinds["opening and closing"] += 1
        elif len(states) == 1:
            kinds["stuck all period" if names == {"stick"} else "permanent slip"] += 1
        else:
            kinds["stick and slip"] += 1
    return dict(kinds)


def interleaved(functions, repeats):
    """Times (repeats, n) of functions called in turn, s: what else the machine does meets all of them alike."""
    times = np.empty((repeats, len(functions)))
    for row in times:
        for k, function in enumerate(functions):
            start = time.perf_counter()
            function()
            row[k] = time.perf_counter() - start
    return times


def measure(repeats=15):
    """Both on one core: numba and BLAS are held to one thread."""
    threads, numba.config.NUMBA_NUM_THREADS = numba.config.NUMBA_NUM_THREADS, 1
    try:
        with threadpool_limits(1):
            return _measure(repeats)
    finally:
        numba.config.NUMBA_NUM_THREADS = threads


def _measure(repeats):
    state, h = batch(), Harmonics(ORDERS)
    table = aft_rival.tables(ORDERS)

    def rival(version):
        return aft_rival.evaluate(ORDERS, **state, table=table, version=version)

    versions = ("propagate", "tuned")
    calls = [partial(element_forces, h, **state), *(partial(rival, version) for version in versions)]
    f, *rivals = (call() for call in calls)
    times = interleaved(calls, repeats)
    out = {"elements": COUNT, "coefficients": h.size, "regimes": regimes(f)}
    for name, time_of in zip(("ours", *versions), times.T, strict=True):
        out[f"{name}_us"] = 1e6 * time_of.min() / COUNT
        out[f"{name}_us_median"] = 1e6 * float(np.median(time_of)) / COUNT
    # stuck all period without rubbing the rival takes the limit it started from, not the middle: not an error
    same = (f.stick_fraction < 1 - 1e-9) | (state["v"] != 0)
    exact = np.concatenate([f.dFx_dX, f.dFx_dY], axis=2)
    for k, (version, (Fx, _, dFx, _)) in enumerate(zip(versions, rivals, strict=True), start=1):
        error = np.abs(dFx[:, :, : 2 * h.size] - exact).max(axis=(1, 2)) / np.abs(exact).max(axis=(1, 2))
        out |= {
            f"{version}_ratio": float(times[:, k].min() / times[:, 0].min()),
            f"{version}_ratio_median": float(np.median(times[:, k] / times[:, 0])),
            f"{version}_force_error": float((np.abs(Fx - f.Fx).max(axis=1) / np.abs(f.Fx).max(axis=1))[same].max()),
            f"{version}_tangent_error_median": float(np.median(error[same])),
        }
    return out


if __name__ == "__main__":
    for key, value in measure().items():
        print(f"{key:28s} {value if isinstance(value, (int, dict)) else f'{value:.4g}'}")
