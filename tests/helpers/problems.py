"""A problem with three contacts of every kind, and differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import detail
from slipstick.balance.problem import Problem
from slipstick.balance.start import FirstPoint, StrategyTried

Array = np.ndarray


def structure(rng: np.random.Generator, n: int, loss: float = 0.02) -> ss.MatrixStructure:
    root = rng.standard_normal((n, n))
    K = 50.0 * (root @ root.T + n * np.eye(n))
    C = 0.3 * np.eye(n) + 0.002 * K
    C[0, 0] += 0.5  # not diagonal in the modes
    return ss.MatrixStructure(
        M=np.diag(rng.uniform(0.5, 2, n)), C=C, K=K, dofs=[f"d{i}" for i in range(n)], loss_factor=loss
    )


def random_problem(seed: int, *, harmonics: list[int] | None = None, period_ratio: tuple[int, int] = (1, 1)) -> Problem:
    """Three contacts: node to ground with constant load, node to node, node to ground with a normal direction."""
    rng = np.random.default_rng(seed)
    directions: list[tuple[dict[str, float], dict[str, float] | None]] = [
        ({"d0": 1.0}, None),
        ({"d1": 0.8, "d2": 0.6, "d3": -0.8, "d4": -0.6}, {"d1": -0.6, "d2": 0.8, "d3": 0.6, "d4": -0.8}),
        ({"d5": 1.0}, {"d4": 1.0}),
    ]
    pairs = [
        ss.ContactPair(
            name=f"c{i}",
            contact=ss.FrictionContact(
                kt=rng.uniform(50, 200), mu=rng.uniform(0.1, 0.6), kn=rng.uniform(50, 200), gap=gap
            ),
            tangential=t,
            normal=n,
            rubbing=ss.RubbingMotion(velocity=rng.uniform(-4, 4), cos={1: rng.uniform(0, 0.5)}),
        )
        for i, ((t, n), gap) in enumerate(zip(directions, (-0.5, -0.4, 0.1), strict=True))
    ]
    loads = [ss.Load(dof="d0", sin=80.0), ss.Load(dof="d4", cos=60.0), ss.Load(dof="d2", harmonic=0, cos=20.0)]
    kept = ss.Harmonics(harmonics or [0, 1, 2, 3, 5])
    return Problem(structure(rng, 6), contacts=pairs, loads=loads, harmonics=kept, period_ratio=period_ratio)


def difference(f, x: float | Array, step: float) -> Array:  # type: ignore[no-untyped-def]
    """Fourth-order central difference."""
    return (8 * (f(x + step) - f(x - step)) - (f(x + 2 * step) - f(x - 2 * step))) / (12 * step)


def first_point(
    problem: Problem, omega: float, *, report: Callable[[StrategyTried], None] | None = None
) -> Array | None:
    """Unknowns of a solution at one frequency, (n_ports * L,), or None."""
    return FirstPoint(Balance(problem), problem.inputs, omega, report=report).find()


def port_forces(balance: Balance, x: Array, omega: float, problem: Problem) -> Array:
    """Forces at every port (n_ports, L): first the tangential ones, then those of contacts with a normal direction."""
    (response,) = detail(balance, x, omega, problem.inputs).responses
    return np.vstack([response.force[0], response.force[1][1:]])


CASES = [(seed, harmonics, ratio) for seed in range(3) for harmonics, ratio in
         (([0, 1, 2, 3, 5], (1, 1)), ([0, 2, 3, 4, 6], (2, 3)))]  # fmt: skip
