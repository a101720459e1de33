"""First points of random grids at a resonance, with contacts that slip, lift off and rub: damped Newton alone fails on
most of them, the ladder of strategies does not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.balance.start import FirstPoint, StrategyTried

SIDE = 4


def plate(rng: np.random.Generator) -> np.ndarray:
    """Stiffness of a square of masses with springs of different stiffness between neighbours."""
    K = np.zeros((SIDE**2, SIDE**2))
    for i in range(SIDE):
        for j in range(SIDE):
            for a, b in ((i, j + 1), (i + 1, j)):
                if a < SIDE and b < SIDE:
                    pair = np.ix_([i * SIDE + j, a * SIDE + b], [i * SIDE + j, a * SIDE + b])
                    K[pair] += rng.uniform(20.0, 60.0) * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return K + np.diag(rng.uniform(2.0, 8.0, SIDE**2))


def grid(seed: int) -> tuple[ss.Problem, float]:
    """Sixteen contacts with both ports, some open at rest, and a frequency where some are stuck in resonance."""
    rng, n = np.random.default_rng(seed), SIDE**2
    coupling = np.diag(rng.uniform(-3.0, 3.0, n))
    K = np.block([[plate(rng), coupling], [coupling, plate(rng)]])
    M = np.diag(rng.uniform(0.7, 1.4, 2 * n))
    names = [f"{axis}{i}" for axis in "tn" for i in range(n)]
    structure = ss.MatrixStructure(M=M, C=0.001 * K + 0.005 * M, K=K, dofs=names)
    kt, kn, mu = rng.uniform(20.0, 150.0, n), rng.uniform(20.0, 150.0, n), rng.uniform(0.2, 0.6, n)
    gap, velocity = rng.uniform(-0.3, 0.1, n), rng.choice([0.0, 0.2, -0.5], n)
    pairs = [
        ss.ContactPair(
            name=f"c{i}", contact=ss.FrictionContact(kt=kt[i], mu=mu[i], kn=kn[i], gap=gap[i]), tangential=f"t{i}",
            normal=f"n{i}", rubbing=ss.RubbingMotion(velocity=velocity[i]),
        )
        for i in range(n)
    ]  # fmt: skip
    loaded = rng.choice(names, 3, replace=False)
    loads = [ss.Load(dof=str(name), sin=rng.uniform(1.0, 6.0), cos=rng.uniform(-3.0, 3.0)) for name in loaded]
    stuck = K + rng.uniform(0.2, 0.8) * np.diag(np.concatenate([kt, kn]))
    omega = np.sqrt(eigh(stuck, M, eigvals_only=True))[rng.integers(3)]
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(6)), float(omega)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("seeds", [range(2), pytest.param(range(2, 24), marks=pytest.mark.verify)], ids=["few", "many"])
def test_every_grid_has_a_first_point(seeds: range) -> None:
    simple = 0
    for seed in seeds:
        problem, omega = grid(seed)
        balance, tried = Balance(problem), list[StrategyTried]()
        x = FirstPoint(balance, problem.inputs, omega, report=tried.append).find()
        assert x is not None, (seed, [(event.name, event.reason) for event in tried])
        residual = FrequencySystem(balance, problem.inputs).evaluate(x, omega).residual
        assert np.linalg.norm(residual) < 1e-7 * np.linalg.norm(x)
        simple += len(tried) == 1
    assert simple < len(seeds)  # else they are too easy to say anything
