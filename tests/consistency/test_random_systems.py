"""Random systems: nearly all are followed over their whole range, and what is stored solves the equations of motion."""

import warnings
from collections import Counter

import numpy as np
import pytest
from helpers.planar_march import TooStiffError
from helpers.results import corrected
from random_systems import independent_residual, random_system

import slipstick as ss

CHUNK = 100
PERMITTED = 1  # incomplete curves in a chunk of the long verification; 5 in all


def followed(seed, *, planar=False, points=5):
    """The branch of a seed, of which some points are held against the equations."""
    system = random_system(seed, planar=planar)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        branch = ss.forced_response(system.problem, omega=system.span)
    if len(branch):
        low, high = sorted(system.span)
        omega = branch.dataset.omega.values
        assert low <= omega.min(), seed
        assert omega.max() <= high, seed
        assert float(corrected(branch.dataset).residual.max()) < 1e-8, seed
        solved = np.flatnonzero(branch.dataset.kind.values != "interpolated")
        for point in solved[np.linspace(0, solved.size - 1, points).astype(int)]:
            assert independent_residual(system, branch, point) < 1e-6, (seed, point)
    return branch


@pytest.mark.parametrize("seed", [0, 1, 3, 4, 5, 6, 7, 8])
def test_a_few_random_systems(seed):
    assert followed(seed).outcome.ok


@pytest.mark.parametrize("seed", [9, 13, 14])
def test_a_few_that_slide_in_the_plane(seed):
    """Friction of the equations is marched in time; one percent more of it is noticed."""
    assert followed(seed, planar=True, points=1).outcome.ok


@pytest.mark.verify(sample=3)
@pytest.mark.parametrize("chunk", range(10))
def test_a_thousand_random_systems(chunk):
    branches = {seed: followed(seed) for seed in range(chunk * CHUNK, (chunk + 1) * CHUNK)}
    ended = Counter(branch.outcome.name for branch in branches.values())
    incomplete = [seed for seed, branch in branches.items() if not branch.outcome.ok]
    assert len(incomplete) <= PERMITTED, (ended, incomplete)


@pytest.mark.verify
def test_a_hundred_that_slide_in_the_plane():
    """Every tenth against the equations too: a march takes seconds, and is too stiff for an explicit method in few."""
    branches, stiff = {}, []
    for seed in range(CHUNK):
        try:
            branches[seed] = followed(seed, planar=True, points=2 if seed % 10 == 4 else 0)
        except TooStiffError:
            stiff.append(seed)
            branches[seed] = followed(seed, planar=True, points=0)
    assert len(stiff) <= 1, stiff
    incomplete = [seed for seed, branch in branches.items() if not branch.outcome.ok]
    assert len(incomplete) <= PERMITTED, incomplete
