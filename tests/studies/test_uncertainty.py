"""Parameters that are not known for sure: distributions, percentiles, Sobol indices, first order against samples."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from helpers.command import slipstick
from helpers.faults import raises_fault
from helpers.study_case import CASE
from scipy import stats

import slipstick as ss
from slipstick.results.percentiles import curve_percentiles, peak_percentiles
from slipstick.studies import sobol
from slipstick.studies.first_order import first_order
from slipstick.studies.plan import _unit_samples, make_plan
from slipstick.studies.sobol import indices, sobol_indices
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore:harmonics:slipstick.SlipstickWarning")
STIFFNESS, FORCE = stats.norm(100.0, 8.0), stats.uniform(80.0, 40.0)
GIVEN = {"damper.kt": STIFFNESS, "load.x.amplitude": FORCE}


def stuck() -> ss.Problem:
    """The oscillator with a contact that always sticks: linear, its stiffness 40 + kt."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    contact = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=1e7)
    damper = ss.ContactPair(name="damper", contact=contact, tangential="x")
    return ss.Problem(structure, contacts=[damper], loads=[ss.Load(dof="x", sin=100.0)], harmonics=range(2))


def peak_without_force(kt: Any) -> Any:
    """Peak amplitude of the stuck oscillator for a unit force: 1 / (c sqrt(k - c^2 / 4))."""
    return 1.0 / (0.4 * np.sqrt(40.0 + kt - 0.04))


def moments() -> tuple[float, float, float, float]:
    """Mean and variance of the peak for a unit force, by quadrature, and of the force."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(20)
    weights = weights / weights.sum()
    values = peak_without_force(100.0 + 8.0 * nodes)
    mean = float(weights @ values)
    return mean, float(weights @ (values - mean) ** 2), float(FORCE.mean()), float(FORCE.var())


@pytest.mark.parametrize("method", ["random", "latin-hypercube", "sobol"])
def test_samples_have_the_distributions_that_were_given(method: str) -> None:
    by_name = {"damper.kt": {"distribution": "norm", "loc": 100.0, "scale": 8.0}, "load.x.amplitude": FORCE}
    plan = make_plan(stuck(), by_name, method=method, samples=512, seed=2)
    assert plan.values.tolist() == make_plan(stuck(), GIVEN, method=method, samples=512, seed=2).values.tolist()
    for column, known in zip(plan.values.T, (STIFFNESS, FORCE), strict=True):
        assert stats.kstest(column, known.cdf).pvalue > 0.01
    assert plan.distributions == ("norm(loc=100, scale=8)", "uniform(80, 40)")
    assert abs(np.corrcoef(plan.values.T)[0, 1]) < 0.1


def test_a_sample_in_the_tail_that_cannot_be_is_a_row_that_says_why() -> None:
    problem = replace(oscillator(velocity=10.0), told=frozenset())
    with pytest.warns(ss.SlipstickWarning, match=r"damper.mu: its distribution reaches -.*, which is not allowed"):
        found = ss.study(
            problem, {"damper.mu": stats.norm(0.02, 0.02)}, omega=(6.0, 6.5), method="sobol", samples=8,
            seed=1, workers=1, options={"first_step": 0.2, "max_step": 0.2},
        )  # fmt: skip
    negative = found["damper.mu"].to_numpy() < 0.0
    assert 0 < negative.sum() < 8
    assert ((found["outcome"] == "FAILED").to_numpy() == negative).all()
    assert all(m.startswith("mu: found -") for m in found["message"].to_numpy()[negative])
    assert int(peak_percentiles(found)["samples"][0]) == 8 - negative.sum()


@pytest.mark.parametrize(
    ("given", "options", "where", "words"),
    [
        (stats.norm(0.3, 0.02), {}, "study, damper.mu", "a distribution is sampled"),
        ({"distribution": "nrom"}, {"method": "random", "samples": 4}, "distribution", "did you mean 'norm'"),
        ({"distribution": "norm", "scal": 1.0}, {"method": "random", "samples": 4}, "scal", "did you mean 'scale'"),
        ({"distribution": "gamma"}, {"method": "random", "samples": 4}, "study, damper.mu", "gamma needs a"),
        ({"distribution": "norm", "scale": -1.0}, {"method": "random", "samples": 4}, "damper.mu", "nan"),
        (stats.cauchy(), {"method": "random", "samples": 4}, "study, damper.mu", "standard deviation"),
        (stats.norm(-9.0, 0.1), {"method": "random", "samples": 4}, "study, damper.mu", "not allowed"),
    ],
)
def test_what_is_no_distribution(given: Any, options: Any, where: str, words: str) -> None:
    with pytest.raises(ss.InputError) as caught:
        make_plan(stuck(), {"damper.mu": given}, **options)
    assert where in str(caught.value)
    assert words in str(caught.value)


def linear_study(values: Any, outcome: Any = "COMPLETED", method: str = "random") -> tuple[xr.Dataset, xr.Dataset]:
    """A study of straight curves, 1 + slope x at x = 0 and 1, and one that turns back to be the largest there."""
    n = len(values)
    study = xr.Dataset(
        {
            "peak_amplitude": (("case", "dof"), 1.0 + np.asarray(values)[:, None], {"units": "mm"}),
            "peak_omega": (("case", "dof"), np.ones((n, 1))),
            "outcome": ("case", np.full(n, outcome)),
        },
        coords={"case": np.arange(n), "dof": ["x"]},
        attrs={"study_distributions": "s: norm(0, 1)", "study_method": method, "study_parameters": "s"},
    )
    ends = np.stack([np.ones(n), 1.0 + np.asarray(values)], axis=1)
    curves = xr.Dataset(
        {
            "case": ("point", np.repeat(np.arange(n), 2)),
            "omega": ("point", np.tile([0.0, 1.0], n)),
            "branch_part": ("point", np.zeros(2 * n)),
            "amplitude": (("point", "dof"), ends.reshape(-1, 1)),
        },
        coords={"dof": ["x"]},
    )
    return study, curves


def test_percentiles_of_straight_curves_are_those_of_their_slopes() -> None:
    slopes = np.random.default_rng(3).normal(size=101)
    study, curves = linear_study(slopes)
    study["outcome"][7] = "FAILED"
    kept = np.delete(slopes, 7)
    band = curve_percentiles(curves, study, (10.0, 50.0, 90.0), points=5)
    exact = 1.0 + np.multiply.outer(np.percentile(kept, [10, 50, 90]), np.linspace(0.0, 1.0, 5))
    exact[:, 0] = 1.0
    np.testing.assert_allclose(
        np.sort(band["amplitude"].to_numpy()[:, :, 0], axis=0), np.sort(exact, axis=0), rtol=1e-13
    )
    assert (band["samples"] == 100).all()
    peaks = peak_percentiles(study, (10.0, 50.0, 90.0))
    np.testing.assert_allclose(peaks["peak_amplitude"][:, 0], 1.0 + np.percentile(kept, [10, 50, 90]), rtol=1e-13)


def test_where_a_curve_turns_back_its_largest_amplitude_counts() -> None:
    study, _ = linear_study([0.0])
    curves = xr.Dataset(
        {
            "case": ("point", [0, 0, 0, 0]),
            "omega": ("point", [0.0, 1.0, 0.5, 2.0]),
            "branch_part": ("point", [0, 0, 0, 0]),
            "amplitude": (("point", "dof"), [[0.0], [1.0], [3.0], [0.0]]),
        },
        coords={"dof": ["x"]},
    )
    band = curve_percentiles(curves, study, (50.0,), points=5)
    np.testing.assert_allclose(band["amplitude"][0, :, 0], [0.0, 3.0, 2.0, 1.0, 0.0], atol=1e-14)


def test_a_grid_has_no_percentiles() -> None:
    study, _ = linear_study([0.0], method="grid")
    del study.attrs["study_distributions"]
    with raises_fault(where=("percentiles",)):
        peak_percentiles(study)


def test_sobol_indices_of_the_ishigami_function() -> None:
    pytest.importorskip("SALib")
    x = -np.pi + 2.0 * np.pi * _unit_samples(3, "saltelli", 8192, 1)
    a, b = 7.0, 0.1
    values = np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])
    found = indices(values[:, None], ["x1", "x2", "x3"], ["y"])
    V1, V2, V13 = 0.5 * (1.0 + b * np.pi**4 / 5.0) ** 2, a**2 / 8.0, b**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    V = V1 + V2 + V13
    np.testing.assert_allclose(found["first"][:2, 0], [V1 / V, V2 / V], rtol=0.02)
    assert abs(float(found["first"][2, 0])) < 0.02
    np.testing.assert_allclose(found["total"][:, 0], [(V1 + V13) / V, V2 / V, V13 / V], rtol=0.02)
    np.testing.assert_allclose(found["variance"], V, rtol=0.02)


def sobol_of_the_stuck_oscillator() -> tuple[Any, Any]:
    """First-order and total indices of the peak, force times a function of the stiffness, in closed form."""
    mean, variance, force_mean, force_variance = moments()
    total = (variance + mean**2) * (force_variance + force_mean**2) - (mean * force_mean) ** 2
    first = np.array([variance * force_mean**2, force_variance * mean**2]) / total
    return first, 1.0 - first[::-1]


def test_sobol_indices_of_the_peak_of_the_stuck_oscillator() -> None:
    pytest.importorskip("SALib")
    kt, force = make_plan(stuck(), GIVEN, method="saltelli", samples=256, seed=3).values.T
    told = indices((force * peak_without_force(kt))[:, None], list(GIVEN), ["x"])
    for name, exact in zip(("first", "total"), sobol_of_the_stuck_oscillator(), strict=True):
        np.testing.assert_allclose(told[name][:, 0], exact, atol=0.02)


@pytest.mark.verify
def test_sobol_indices_of_a_study_of_the_stuck_oscillator() -> None:
    pytest.importorskip("SALib")
    found = ss.study(
        stuck(), GIVEN, omega=(10.0, 13.5), method="saltelli", samples=128, seed=3, workers=1,
        options={"first_step": 1.0, "max_step": 1.0, "output_step": 1.0},
    )  # fmt: skip
    kt, force = (found[name].to_numpy() for name in GIVEN)
    np.testing.assert_allclose(found["peak_amplitude"][:, 0], force * peak_without_force(kt), rtol=1e-9)
    told = sobol_indices(found)
    for name, exact in zip(("first", "total"), sobol_of_the_stuck_oscillator(), strict=True):
        np.testing.assert_allclose(told[name][:, 0], exact, atol=0.02)


def test_groups_with_a_sample_that_failed_are_left_out() -> None:
    pytest.importorskip("SALib")
    u = _unit_samples(2, "saltelli", 64, 1)
    values = (u[:, 0] + 2.0 * u[:, 1])[:, None]
    whole = indices(values[4:], ["a", "b"], ["y"])
    values[2] = np.nan
    with pytest.warns(ss.SlipstickWarning, match="1 of 64 groups of samples are left out of y"):
        found = indices(values, ["a", "b"], ["y"])
    np.testing.assert_array_equal(found["first"], whole["first"])


def test_without_salib_the_way_to_it_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sobol, "has_salib", lambda: False)
    with pytest.raises(ss.InputError, match=r"need SALib.*pip install 'slipstick\[uncertainty\]'"):
        indices(np.zeros((4, 1)), ["a", "b"], ["y"])


def test_first_order_is_that_of_the_closed_form_and_near_to_what_samples_give() -> None:
    branch = ss.forced_response(stuck(), omega=(11.0, 12.5))
    found = first_order(branch, GIVEN)
    slope = -0.5 * 100.0 / (0.4 * (140.0 - 0.04) ** 1.5)
    deviation = np.hypot(8.0 * slope, float(FORCE.std()) * peak_without_force(100.0))
    np.testing.assert_allclose(found["peak_amplitude_deviation"], [deviation], rtol=1e-7)
    np.testing.assert_allclose(found["peak_omega_deviation"], [8.0 * 0.5 / np.sqrt(140.0 - 0.08)], rtol=1e-6)
    mean, variance, force_mean, force_variance = moments()
    exact = np.sqrt((variance + mean**2) * (force_variance + force_mean**2) - (mean * force_mean) ** 2)
    assert deviation == pytest.approx(exact, rel=5e-3)  # what bends is of second order in 8 %
    shifted = first_order(branch, {"damper.kt": stats.norm(110.0, 8.0)})
    step = np.asarray(shifted["peak_amplitude_mean"] - found["peak_amplitude_mean"])
    np.testing.assert_allclose(step, [10.0 * slope], rtol=1e-6)


def test_a_case_file_says_it_and_the_band_is_drawn_and_reported(tmp_path: Path) -> None:
    text = CASE.partition("[study]")[0] + (
        '[study]\nmethod = "latin-hypercube"\nsamples = 4\nseed = 1\n'
        '"damper.velocity" = { distribution = "uniform", loc = 20.0, scale = 20.0 }\n'
    )
    (tmp_path / "case.toml").write_text(text)
    done = slipstick("study", tmp_path / "case.toml", "-o", tmp_path / "out", "--workers", 1)
    assert done.exit_code == 0
    assert "5 % to 95 %" in done.output
    assert (tmp_path / "out" / "band.pdf").exists() or (tmp_path / "out" / "band.png").exists()
    study = ss.study(ss.Case.from_file(tmp_path / "case.toml"), workers=1)
    known = peak_percentiles(study)["peak_amplitude"].to_numpy()[1, 0]
    assert f"median {known:.6g}" in done.output
    assert '"percentiles":[5.0,50.0,95.0]' in (tmp_path / "out" / "report.html").read_text().replace(" ", "")
