"""Random blades and the worst ones."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.events import CaseDone, PointFound
from slipstick.errors import InputError, SlipstickWarning
from slipstick.io.loading import load_dataset
from slipstick.results.amplification import amplification_of
from slipstick.results.percentiles import WeibullMaxima
from slipstick.studies.mistuning import mistuning_study, worst_pattern
from slipstick.studies.plan import make_plan
from slipstick.studies.solving import CaseSolved
from slipstick.studies.study import job_of
from slipstick.studies.table import study_attributes, study_dataset

sys.path.insert(0, str(Path(__file__).parents[2] / "examples" / "bladed_disc"))


def disc(sectors: int = 4, **given: object) -> ss.Problem:
    """Single blades with friction between neighbours, coupled weakly."""
    sector = ss.CyclicStructure(M=[[1.0]], K=([[1.04]], [[-0.02]]), dofs=["tip"], sectors=sectors, loss_factor=4e-3)
    friction = ss.FrictionContact(kt=0.03, mu=0.3, normal_load=2.0)
    shroud = ss.ContactPair(name="shroud", contact=friction, tangential={"tip": 1.0, "tip@next": -1.0})
    wave = ss.Problem(
        sector.travelling_wave(1), contacts=shroud, loads=ss.Load(dof="tip", cos=1.0), harmonics=[0, 1, 3]
    )
    return sector.mistuned(blade=[[1.0]], **given).problem(wave)  # type: ignore[arg-type]


def test_maxima_are_fitted() -> None:
    """Of values with a known distribution, bounded at 2; the error is that of 20 000 of them."""
    exact = WeibullMaxima(shape=0.25, place=1.2, scale=0.2)
    assert exact.upper == pytest.approx(2.0)
    values = [exact.percentile(p) for p in 100.0 * np.random.default_rng(1).uniform(size=20_000)]
    found = WeibullMaxima.fitted(values)
    assert (found.shape, found.place, found.scale) == pytest.approx((0.25, 1.2, 0.2), abs=0.01)
    assert found.percentile(99.0) == pytest.approx(exact.percentile(99.0), rel=3e-3)
    with pytest.raises(InputError, match="at least 8"):
        WeibullMaxima.fitted([1.0, 2.0])


def test_samples_are_the_same_whatever_their_number() -> None:
    """Deviations of a sample, and what comes of them: that of a curve by itself."""
    told: list[CaseDone] = []
    few, more = (
        mistuning_study(disc(), omega=(0.97, 1.12), spread=0.02, samples=n, seed=4, workers=1, listeners=told.append)
        for n in (1, 2)
    )
    assert [(event.done, event.total) for event in told] == [(1, 2), (2, 2), (1, 3), (2, 3), (3, 3)]
    assert told[2].values == dict.fromkeys(("stiffness@0", "stiffness@1", "stiffness@2", "stiffness@3"), 0.0)
    np.testing.assert_array_equal(few.deviation[0], more.deviation[0])
    assert float(few.largest_amplitude[0]) == float(more.largest_amplitude[0])
    assert more.attrs["failed"] == 0
    problem = disc(stiffness=more.deviation[1].values)
    alone = ss.forced_response(problem, omega=(0.97, 1.12), peaks_of="largest")
    assert float(more.largest_amplitude[1]) == pytest.approx(max(a for _, a in alone.peaks()), rel=1e-9)


@pytest.mark.parametrize(("steps", "growth"), [(1, 1.001), pytest.param(6, 1.02, marks=pytest.mark.verify)])
def test_the_worst_pattern_is_worse(steps: int, growth: float) -> None:
    """Within the bounds, larger with each step, and what a curve by itself gives."""
    bound, omega = 0.02, (0.97, 1.12)
    start = np.array([0.3, -0.2, 0.1, -0.4]) * bound
    found = worst_pattern(disc(stiffness=start), omega=omega, bound=bound, steps=steps)
    assert np.abs(found.deviations).max() <= bound * (1.0 + 1e-12)
    assert list(found.amplitudes) == sorted(found.amplitudes)
    assert found.amplitude > growth * found.amplitudes[0]
    again = ss.forced_response(found.problem, omega=omega, peaks_of="largest")
    assert max(a for _, a in again.peaks()) == pytest.approx(found.amplitude, rel=1e-9)


@pytest.mark.verify
def test_24_blades_with_shrouds(tmp_path: Path) -> None:
    """The same on one and two workers bit by bit; amplification between 1 and the bound of Whitehead."""
    import bladed_disc

    given = {"omega": (345.0, 385.0), "spread": 0.01, "samples": 8, "seed": 1}
    one = mistuning_study(bladed_disc.disc(), workers=1, **given)  # type: ignore[arg-type]
    two = mistuning_study(bladed_disc.disc(), workers=2, **given)  # type: ignore[arg-type]
    np.testing.assert_array_equal(one.largest_amplitude, two.largest_amplitude)
    assert one.attrs["failed"] == 0
    assert 1.0 < float(one.amplification.min()) < float(one.amplification.max()) < (1 + np.sqrt(24)) / 2
    assert float(one.fitted_percentile[0]) == pytest.approx(float(one.amplification_percentile[0]), rel=0.03)


@pytest.mark.parametrize("wrong", [3, None])
def test_other_problems(wrong: object) -> None:
    """Refused."""
    with pytest.raises(InputError, match="disc"):
        mistuning_study(wrong, omega=(1.0, 2.0), spread=0.1, samples=1)  # type: ignore[arg-type]


def test_an_interrupt_is_not_taken_for_a_range_without_a_peak() -> None:
    def interrupt(event) -> None:
        if isinstance(event, PointFound):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        worst_pattern(disc(), omega=(0.9, 1.3), bound=0.01, steps=1, listeners=interrupt)


def test_the_study_is_that_of_any_parameters(tmp_path: Path) -> None:
    """Deviations, amplitudes and their ratio against single curves; a study interrupted at its tuned disc goes on."""
    given = {"method": "mistuning", "omega": (0.97, 1.12), "spread": 0.02, "samples": 2, "seed": 4, "workers": 1}

    def stop(event: CaseDone) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ss.study(disc(), folder=tmp_path / "found", listeners=stop, **given)  # type: ignore[arg-type]
    begun = load_dataset(tmp_path / "found" / "study.nc")
    assert begun.attrs["outcome_text"] == "1 of 3 cases are computed, the tuned disc among them"
    found = ss.study(disc(), folder=tmp_path / "found", **given)  # type: ignore[arg-type]
    alone = ss.forced_response(disc(), omega=(0.97, 1.12), peaks_of="largest")
    tuned = max(size for _, size in alone.peaks("largest"))
    assert begun.attrs["tuned_amplitude"] == found.attrs["tuned_amplitude"] == pytest.approx(tuned, rel=1e-9)
    own = [float(found[f"stiffness@{s}"][1]) for s in range(4)]
    one = ss.forced_response(disc(stiffness=own), omega=(0.97, 1.12), peaks_of="largest")
    at = max(range(len(one)), key=lambda i: one.dataset.amplitude[i].max())
    most = one.dataset.amplitude[at]
    assert float(found.amplification[1]) == pytest.approx(float(most.max()) / tuned, rel=1e-9)
    assert str(found.worst[1].item()) == str(most.dof[int(np.argmax(most.values))].item())
    assert found.attrs["warnings"] == ""
    seeds = np.random.SeedSequence(4).spawn(2)
    assert own == np.random.default_rng(seeds[1]).normal(0.0, 0.02, 4).tolist()


def test_a_factor_on_the_deviations_of_the_problem_is_not_used() -> None:
    """Nor are they themselves."""
    given = {"method": "mistuning", "omega": (0.97, 1.12), "spread": 0.02, "samples": 1, "workers": 1}
    other = disc(stiffness=[0.1, 0.0, 0.0, 0.0]).with_parameter("mistuning", 0.3)
    one, two = (ss.study(problem, **given) for problem in (disc(), other))  # type: ignore[arg-type]
    assert float(one.amplification[0]) == pytest.approx(float(two.amplification[0]), rel=1e-9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"spread": None}, "spread is missing"),
        ({"spread": 0.0}, "found 0"),
        ({"samples": None}, "samples is missing"),
        ({"parameters": {"shroud.mu": [0.1]}}, "varies the blades alone"),
        ({"method": "sobol", "parameters": {"shroud.mu": [0.1, 0.2]}}, "spread: it is given"),
        ({"peaks_of": ["tip@0"]}, "peaks_of: "),
    ],
)
def test_faults_of_the_study(given: dict[str, object], said: str) -> None:
    whole = {"method": "mistuning", "omega": (0.97, 1.12), "spread": 0.02, "samples": 1} | given
    with pytest.raises(InputError, match=said):
        ss.study(disc(), **whole)  # type: ignore[arg-type]


def test_a_largest_amplitude_at_an_end_of_the_range_is_told() -> None:
    """Of the tuned disc, and of the others."""
    with pytest.warns(SlipstickWarning, match="at an end of the range"):
        found = ss.study(disc(), method="mistuning", omega=(0.90, 0.95), spread=0.001, samples=1, workers=1)
    first, second, *_ = found.attrs["warnings"].splitlines()
    assert ("of the tuned disc is" in first, "of 1 of 1 discs is" in second) == (True, True)
    assert np.isfinite(found.amplification).all()


def test_without_the_tuned_disc_there_is_no_amplification() -> None:
    """Its failure is told; the largest amplitudes are there all the same, those of failed discs are not."""
    rows = {0: 2.0, 1: 3.0, 2: 1.0}
    job, _ = job_of(disc(), (0.97, 1.12))
    plan = make_plan(job.problem, None, method="mistuning", samples=2, spread=0.1)
    cases = {
        case: CaseSolved(
            row={"case": case, "outcome": "COMPLETED", "peak_amplitude": [size, np.nan, np.nan, np.nan], "points": 1},
            curve=np.zeros((0, 0)), message="",
        )
        for case, size in rows.items()
    }  # fmt: skip
    whole = study_dataset(job, plan, cases, study_attributes(job, plan, cases, {}))
    assert whole.amplification.values.tolist() == [2.0, 3.0]
    cases |= {0: CaseSolved.failed(0, "no"), 2: CaseSolved.failed(2, "singular")}
    failed = study_dataset(job, plan, cases, study_attributes(job, plan, cases, {}))
    assert np.isnan(failed.amplification).all()
    assert failed.largest_amplitude.values[1] == 3.0
    assert "the tuned disc did not complete: singular" in failed.attrs["warnings"]
    assert amplification_of(failed)["discs"] == 0
