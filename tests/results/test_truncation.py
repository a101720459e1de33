"""The estimate of what the harmonics left out would add, against what they add when they are kept."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.io.loading import load
from slipstick.results.branch import Branch
from slipstick.results.truncation import truncation_sentence, with_further
from slipstick.verify.oscillator_checks import oscillator

Array = np.ndarray
RANGE = (2.0, 15.0)
PLACES = [2.5, 3.0, 3.7, 4.2, 5.0, 6.0, 8.0, 10.0]


def branch(velocity: float, orders: list[int]) -> Branch:
    return ss.forced_response(oscillator(velocity=velocity, harmonics=orders), omega=RANGE, requested=PLACES)


def missing(found: Branch, full: Branch) -> tuple[Array, Array]:
    """Estimate, and largest change of the motion about its mean over the amplitude, at the places."""
    tau, estimate, true = np.linspace(0.0, 2.0 * np.pi, 361), [], []
    for place in PLACES:
        i, j = found.at(place), full.at(place)
        x = [b.harmonics.H_minus(tau) @ b.dataset["displacement"].to_numpy()[k, 0] for b, k in ((found, i), (full, j))]
        mean = [float(b.dataset["mean"][k, 0]) for b, k in ((found, i), (full, j))]
        true.append(np.abs((x[0] - mean[0]) - (x[1] - mean[1])).max() / float(full.dataset["amplitude"][j, 0]))
        estimate.append(float(found.dataset["truncation"][i]))
    return np.array(estimate), np.array(true)


@pytest.mark.parametrize(
    ("velocity", "orders"),
    [(10.0, [0, 1, 2, 3]), (10.0, list(range(6))), (10.0, list(range(11))), (10.0, [0, 1, 3, 5]), (50.0, [0, 1, 2, 3]),
     (0.0, [0, 1, 2, 3]), (0.0, [0, 1, 3, 5])],
)  # fmt: skip
def test_estimate_is_near_what_more_harmonics_change(velocity: float, orders: list[int]) -> None:
    found, full = branch(velocity, orders), branch(velocity, list(range(25)))
    estimate, true = missing(found, full)
    # what the kept harmonics answer is not in it: without rubbing, near resonance, it is low
    factor = 3.0 if velocity else 8.0
    assert true.max() / factor < estimate.max() < 3.0 * true.max()
    acts = true > 1e-2 * true.max()
    assert np.all(estimate[acts] > true[acts] / (2.0 * factor))
    assert np.all(estimate[acts] < 3.0 * true[acts])


def test_odd_harmonics_under_rubbing_are_warned_of() -> None:
    with pytest.warns(ss.SlipstickWarning, match=r"harmonics left out would add about \d+ % .* at omega = .* rad/s"):
        found = branch(10.0, [0, 1, 3, 5])
    assert float(found.dataset["truncation"].max()) > 0.3
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        branch(10.0, list(range(11)))
        branch(0.0, [0, 1, 3, 5])  # without rubbing they are all there are


def test_permanent_slip_leaves_nothing_out() -> None:
    assert float(branch(260.0, [0, 1]).dataset["truncation"].max()) < 1e-14


def test_orders_looked_at() -> None:
    assert with_further(ss.Harmonics([0])).orders == (0, 1, 2)
    assert with_further(ss.Harmonics([0, 1, 3])).orders == tuple(range(6))
    assert with_further(ss.Harmonics(range(11))).orders == tuple(range(16))


def test_parameter_and_stored_results(tmp_path: Path) -> None:
    """The warning names the parameter; what is stored is what was computed."""
    with pytest.warns(ss.SlipstickWarning, match=r"at damper\.velocity = 1"):
        found = ss.parameter_response(
            oscillator(velocity=10.0, harmonics=[0, 1, 3]), "damper.velocity", (10.0, 30.0), omega=3.7
        )
    found.save(tmp_path / "r.nc")
    np.testing.assert_array_equal(load(tmp_path / "r.nc").dataset["truncation"], found.dataset["truncation"])
    attributes = found.dataset["truncation"].attrs
    assert attributes["units"] == "1"
    assert "harmonics left out" in attributes["long_name"]


def test_sentence() -> None:
    values = np.array([1.0, 2.0, 3.0])
    assert truncation_sentence("omega", values, np.array([1e-3, 1e-2, 0.0])) is None
    assert truncation_sentence("omega", np.empty(0), np.empty(0)) is None
    said = truncation_sentence("damper.mu", values, np.array([0.05, 0.2, np.nan]))
    assert said is not None
    assert "about 20 % of the amplitude at damper.mu = 2 (and more than 1 % at 2 of 3 points)" in said
