"""Friction in two directions beside the exact element of one: time of an element, of a curve, of a check in time.

OMP_NUM_THREADS=1 python benchmarks/planar.py
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial

import numpy as np
from clocks import interleaved, one_thread

import slipstick as ss
from slipstick.contact.forces import element_forces
from slipstick.contact.law import Motion

COUNT, REPEATS, TOLERANCES = 300, 15, (1e-6, 1e-8, 1e-10)


def states(orders: int, seed: int = 0) -> tuple[np.ndarray, dict[str, np.ndarray], np.ndarray]:
    """Motion (3, n, L), parameters, drift (3, n): some with a constant load, some open, half rubbing."""
    rng, L = np.random.default_rng(seed), 2 * orders + 1
    Q = rng.normal(size=(3, COUNT, L)) / np.repeat([1, *range(1, orders + 1)], [1] + [2] * orders) ** 1.5
    Q[:2] *= 10.0 ** rng.uniform(-0.3, 0.7, (COUNT, 1))
    Q[2, ::3], Q[2, 1::3] = 0.2 * Q[2, ::3], 0.0
    drift = np.zeros((3, COUNT))
    drift[:2, ::2] = 0.3 * rng.normal(size=(2, COUNT // 2))
    parameters = {"kt": 3.0, "mu": 0.4, "kn": 2.0, "gap": -1.5}
    return Q, {name: np.full(COUNT, value) for name, value in parameters.items()}, drift


def main() -> None:
    """A table: microseconds an element, and the ratio to the element of one direction along the same motion."""
    for orders in (3, 10):
        Q, values, drift = states(orders)
        harmonics = ss.Harmonics(range(orders + 1))
        motion = Motion(harmonics, 1.0, tuple(Q), drift)
        calls = {"one direction": partial(element_forces, harmonics, Q[0], Q[2], v=drift[0], **values)}
        for tolerance in TOLERANCES:
            law = ss.PlanarFrictionContact(kt=1.0, mu=1.0, normal_load=1.0, tolerance=tolerance)
            calls[f"two directions, {tolerance:g}"] = partial(law.respond, motion, values)
        with one_thread():
            taken = np.median(interleaved([*calls.values()], REPEATS), axis=0)
        for name, seconds in zip(calls, taken, strict=True):
            print(f"{orders:3d} harmonics  {name:22s} {seconds / COUNT * 1e6:8.1f} us {seconds / taken[0]:7.1f}")
    along_a_curve()


def processor_time(call: Callable[[], object]) -> float:
    """Seconds, of the best of three after a first one."""
    call()
    taken = []
    for _ in range(3):
        start = time.process_time()
        call()
        taken.append(time.process_time() - start)
    return min(taken)


def along_a_curve() -> None:
    """The foot of ``examples/two_dofs/sliding_in_the_plane.toml``: its curve, with stability too, a check in time."""
    numbers, structure = {"kt": 100.0, "mu": 0.3, "normal_load": 400.0}, {"M": np.eye(2), "C": 0.4 * np.eye(2)}
    one, plane = (
        ss.Problem(
            ss.MatrixStructure(**structure, K=40.0 * np.eye(2), dofs=["x", "y"]), harmonics=range(8),
            loads=[ss.Load(dof="x", sin=100.0), ss.Load(dof="y", cos=60.0)],
            contacts=ss.ContactPair(
                name="foot", contact=law(**numbers), tangential=tangential, rubbing=ss.RubbingMotion(velocity=velocity)
            ),
        )
        for law, tangential, velocity in (
            (ss.FrictionContact, "x", 3.0), (ss.PlanarFrictionContact, ("x", "y"), (3.0, 0.0)),
        )
    )  # fmt: skip
    for name, problem in (("one direction", one), ("two directions", plane)):
        curve, stable = (
            processor_time(partial(ss.forced_response, problem, omega=(6.0, 14.0), stability=stability))
            for stability in (False, True)
        )
        branch = ss.steady_response(problem, omega=8.3)
        check = processor_time(partial(branch.check_in_time, 0))
        print(f"{name:14s}  curve {curve:5.2f} s, with stability {stable:5.2f} s; a check in time {check:5.2f} s")


if __name__ == "__main__":
    main()
