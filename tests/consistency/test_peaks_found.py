"""No peak is missed that a run ten times finer shows with a prominence above a thousandth of its height."""

import warnings

import numpy as np
import pytest
from helpers.results import corrected
from random_systems import random_system

import slipstick as ss
from slipstick.analysis.arguments import common_arguments

PROMINENT = 1e-3
STEPPED_OVER = {(104, "d8")}
"""A peak between two turning points 2e-4 of the range apart, at a corner of the branch: no step enters there."""
FINE = {"max_step": 1 / 1200, "first_step": 1 / 1200, "output_step": 1.0, "max_points": 40_000}
"""Ten times finer than the points of a curve are apart."""


def shown(branch, name):
    """Places and heights of prominent local maxima of a dof's amplitude, in each part of the branch."""
    from scipy.signal import find_peaks

    d, found = corrected(branch.dataset), []
    for part in np.unique(d.branch_part.values):
        own = d.isel(point=np.flatnonzero(d.branch_part.values == part))
        size = own.amplitude.sel(dof=name).values
        at, about = find_peaks(size, prominence=0.0)
        kept = at[about["prominences"] > PROMINENT * size[at]]
        found += list(zip(own.omega.values[kept], size[kept], strict=True))
    return found


def missed(seed, most_contacts=4):
    """Peaks of a random system that its curve lacks; None where there is no curve."""
    system = random_system(seed)
    if len(system.problem.elements) > most_contacts:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        branch = ss.forced_response(system.problem, omega=system.span)
        fine = ss.forced_response(system.problem, omega=system.span, options=FINE)
    if not (branch.outcome.ok and fine.outcome.ok):
        return None
    width = abs(system.span[1] - system.span[0])
    lacking = []
    for name in common_arguments(system.problem, ())["peaks_of"]:
        found = np.array([*branch.peaks(name), (np.inf, np.inf)])
        for omega, size in shown(fine, name):
            apart = np.abs(found[:, 0] - omega) / width + np.abs(found[:, 1] / size - 1.0)
            if not np.min(apart) < 5e-3:
                lacking.append((seed, name, omega, size))
    return lacking


def test_a_small_peak_that_only_a_finer_run_showed():
    """Prominence 1.6e-3: between points 1/120 of the range apart the slope is negative at both ends."""
    system = random_system(17)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = np.array(ss.forced_response(system.problem, omega=system.span, peaks_of="d0").peaks("d0"))
    assert found[:, 0] == pytest.approx([1.27776034, 0.97579051, 0.98028742, 0.87406244], rel=1e-7)
    assert found[2, 1] == pytest.approx(2.2475779583, rel=1e-9)


@pytest.mark.parametrize(
    "seed, name, omega, size",
    [(34, "d2", 12.19906295, 0.0987322721), (76, "d2", 1.859161116, 1.120066181), (114, "d6", 3.137786557, 3.20861684)],
)
def test_small_peaks_between_points_where_the_branch_has_a_kink(seed, name, omega, size):
    """The cubics between such points are not near the branch, and the slope is of one sign at both."""
    system = random_system(seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = ss.forced_response(system.problem, omega=system.span, peaks_of=name).peaks(name)
    assert min(abs(at / omega - 1.0) + abs(high / size - 1.0) for at, high in found) < 1e-8


@pytest.mark.verify
@pytest.mark.parametrize("chunk", range(8))
def test_small_peaks_of_a_hundred_systems(chunk):
    found = [missed(seed) for seed in range(15 * chunk, 15 * (chunk + 1))]
    followed = [each for each in found if each is not None]
    assert len(followed) >= 6
    assert {(seed, name) for each in followed for seed, name, *_ in each} <= STEPPED_OVER
