"""Random blades and the worst ones."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.events import CaseDone, PointFound
from slipstick.errors import InputError
from slipstick.studies.mistuning import WeibullMaxima, mistuning_study, worst_pattern

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
    assert [(event.done, event.total) for event in told] == [(1, 1), (1, 2), (2, 2)]
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
