"""Limit cycles of random systems under several contacts, also subcritical ones: integration in time stays on them."""

import numpy as np
import pytest

import slipstick as ss

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

_FAST = (2, 4, 25, 34, 37)
"""Systems with folds, Neimark-Sacker points, an end in steady sliding, one to three contacts."""


def random_system(seed):
    """Contacts that slide at various speeds in both directions on a structure with all directions coupled."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 4))
    n = 2 * count
    A = rng.standard_normal((n, n))
    K = 20.0 * (A @ A.T) / n + 60.0 * np.eye(n)
    C = rng.uniform(0.02, 0.1) * np.sqrt(60.0) * np.eye(n)
    structure = ss.MatrixStructure(M=np.eye(n), C=C, K=K, dofs=[f"q{i}" for i in range(n)])
    pairs = [
        ss.ContactPair(
            name=f"c{i}", tangential=f"q{2 * i}", normal=f"q{2 * i + 1}",
            contact=ss.FrictionContact(
                kt=rng.uniform(50, 300), mu=0.1, kn=rng.uniform(30, 200), gap=-rng.uniform(0.1, 1)
            ),
            rubbing=ss.RubbingMotion(velocity=rng.choice([-1, 1]) * rng.uniform(0.2, 2)),
        )
        for i in range(count)
    ]  # fmt: skip
    return ss.Problem(structure, contacts=pairs, harmonics=range(8))


@pytest.mark.parametrize(
    "seed", [pytest.param(s, marks=[] if s in _FAST else [pytest.mark.verify(sample=20)]) for s in range(60)]
)
def test_stable_cycles_are_kept_in_time(seed):
    branch = ss.limit_cycles(random_system(seed), "*.mu", (0.05, 2.0))
    data = branch.dataset
    assert branch.outcome.ok
    assert data.residual.values.max() < 1e-9
    kept = np.flatnonzero((data.branch_part.values == 1) & (data.stable.values == 1))[3:]
    assert kept.size or seed not in _FAST
    for point in kept[len(kept) // 2 :][:1].tolist():
        check = branch.check_in_time(point)
        assert check.converged
        assert check.relative_difference < 3.0 * float(data.truncation[point])
