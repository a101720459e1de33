"""Blades that differ at random, and the worst that differ within bounds: how much larger the largest of them moves."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.curve.response import forced_response
from slipstick.analysis.sensitivity.sensitivity import sensitivity_of
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError, Outcome
from slipstick.faults import number, shown, whole
from slipstick.results.percentiles import FEWEST, WeibullMaxima
from slipstick.results.schema import LARGEST
from slipstick.results.view import names_of
from slipstick.structure.disc import MISTUNING, Disc
from slipstick.studies.study import study
from slipstick.typing import Array, FrequencyRange
from slipstick.units import compared

if TYPE_CHECKING:
    import xarray
    from distributed import Client

    from slipstick.analysis.road.events import CaseDone, EventFunction
    from slipstick.results.solutions import Solutions

PERCENTILES = (50.0, 95.0, 99.0)
_SAME = 1e-9


def mistuning_study(
    problem: Problem,
    *,
    omega: FrequencyRange,
    spread: float,
    samples: int,
    seed: int = 0,
    options: Mapping[str, Any] | None = None,
    workers: int | None = None,
    client: Client | None = None,
    folder: str | Path | None = None,
    listeners: Iterable[Callable[[CaseDone], None]] | Callable[[CaseDone], None] = (),
) -> xarray.Dataset:
    """Monte Carlo over blades whose stiffness differs at random.

    Parameters
    ----------
    problem
        Of a disc made by ``CyclicStructure.mistuned`` with ``blade``; its own deviations are not used. Its outputs are
        the dofs of which the largest amplitude is sought.
    omega
        First and last frequency.
    spread, samples, seed
        Standard deviation of the normal deviations, how many discs, and the seed: sample i is the same whatever the
        number of samples and of workers.
    options, workers, client, folder, listeners
        As of ``ss.study``: ``listeners=ss.Progress()`` shows how many samples are done.

    Returns
    -------
    xarray.Dataset
        ``largest_amplitude``, ``amplification`` (over that of the tuned disc in the range), ``worst`` (the output) and
        ``omega`` over ``sample``, ``deviation`` (sample, sector); ``amplification_percentile`` over ``percentile`` and,
        from 8 samples on, ``fitted_percentile`` of the Weibull distribution of maxima in the attributes. A sample whose
        curve failed is nan.

    Raises
    ------
    InputError
        For another structure, and as ``ss.study``.
    """
    import xarray

    disc = _disc(problem)
    spread, samples = number("spread", spread, "a number > 0", above=1e-300), whole("samples", samples, 1)
    seeds = np.random.SeedSequence(whole("seed", seed)).spawn(samples)
    deviations = np.array([np.random.default_rng(own).normal(0.0, spread, disc.sectors) for own in seeds])
    plain = problem.with_parameter(MISTUNING, 1.0)
    found = study(
        plain, {f"stiffness@{s}": deviations[:, s].tolist() for s in range(disc.sectors)}, method="list", omega=omega,
        peaks_of=LARGEST, options=options, workers=workers, client=client, folder=folder,
        listeners=listeners,
    )  # fmt: skip
    among = compared(names_of(found, "dof"))
    sizes = found["peak_amplitude"].to_numpy()[:, among]
    known = np.isfinite(sizes).any(axis=1)
    at = np.where(known, np.nanargmax(np.where(np.isfinite(sizes), sizes, -1.0), axis=1), 0)
    row = np.arange(samples)
    largest = np.where(known, sizes[row, at], np.nan)
    tuned = _highest(forced_response(problem.with_parameter(MISTUNING, 0.0), omega=omega, peaks_of=LARGEST))
    amplification = largest / tuned
    sound = amplification[np.isfinite(amplification)]
    out = xarray.Dataset(
        {
            "largest_amplitude": ("sample", largest, dict(found["peak_amplitude"].attrs)),
            "amplification": ("sample", amplification, {"units": "1", "long_name": "largest over tuned amplitude"}),
            "worst": ("sample", np.array([str(found["dof"].to_numpy()[among][i]) for i in at])),
            "omega": ("sample", np.where(known, found["peak_omega"].to_numpy()[:, among][row, at], np.nan)),
            "deviation": (("sample", "sector"), deviations),
        },
        coords={"sample": row, "sector": np.arange(disc.sectors), "percentile": list(PERCENTILES)},
        attrs={"tuned_amplitude": tuned, "spread": spread, "seed": seed, "failed": int(samples - sound.size)},
    )
    if sound.size:
        out["amplification_percentile"] = "percentile", np.percentile(sound, PERCENTILES)
    if sound.size >= FEWEST:
        fit = WeibullMaxima.fitted(sound)
        out["fitted_percentile"] = "percentile", [fit.percentile(p) for p in PERCENTILES]
        out.attrs |= {"weibull_shape": fit.shape, "weibull_place": fit.place, "weibull_scale": fit.scale}
    return out


@dataclass(frozen=True, kw_only=True)
class WorstPattern:
    """Deviations within bounds that make the largest amplitude as large as was found.

    Attributes
    ----------
    deviations
        (N,).
    dof, omega, amplitude
        Which moves most, where, and how much.
    amplitudes
        Largest amplitude after each step, the first of the pattern to begin with.
    problem
        With these deviations.
    """

    deviations: Array
    dof: str
    omega: float
    amplitude: float
    amplitudes: tuple[float, ...]
    problem: Problem


def worst_pattern(
    problem: Problem, *, omega: FrequencyRange, bound: float, steps: int = 10, options: Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
) -> WorstPattern:  # fmt: skip
    """The pattern of deviations within ``-bound`` to ``bound`` by which the largest peak grows most, by its gradient.

    Each step puts every blade on the bound to which the exact derivative of the highest peak points, or half way there
    where that was too far; it ends where the peak grows no more. This is a local maximum: other patterns to begin with,
    the deviations of ``problem``, may lead to others. ``listeners`` are told of each curve, as of ``forced_response``.

    Raises
    ------
    InputError
        For a structure without deviations, and where no curve has a peak in the range.
    """
    disc, bound = _disc(problem), number("bound", bound, "a number > 0", above=1e-300)
    names = [f"stiffness@{s}" for s in range(disc.sectors)]
    found = problem.with_parameter(MISTUNING, 1.0)
    current = np.clip(disc.deviations, -bound, bound)
    branch, history = _curve(found, current, omega, options, listeners), list[float]()
    history.append(_highest(branch))
    for _ in range(whole("steps", steps, 1)):
        _, dof = _top(branch)
        own = _peaks_of(branch, dof)
        best = max(range(len(own)), key=lambda i: own[i][1])
        gradient = sensitivity_of(branch, names, dof)["peak_amplitude"].to_numpy()[:, best]
        if not np.all(np.isfinite(gradient)):
            break
        target, share = bound * np.sign(gradient), 1.0
        while share > 0.1:
            trial = current + share * (target - current)
            other = _curve(found, trial, omega, options, listeners)
            if _highest(other) > history[-1] * (1.0 + _SAME):
                break
            share *= 0.5
        else:
            break
        current, branch = trial, other
        history.append(_highest(branch))
    at, dof = _top(branch)
    assert branch.problem is not None
    return WorstPattern(
        deviations=current, dof=dof, omega=at, amplitude=history[-1], amplitudes=tuple(history), problem=branch.problem
    )


def _disc(problem: Any) -> Disc:
    structure = getattr(problem, "structure", None)
    if not isinstance(structure, Disc) or structure.blade is None:
        expected = "the problem of a disc, sector.mistuned(blade=...).problem(...)"
        raise InputError(Fault("problem", found=shown(structure), expected=expected))
    return structure


def _curve(
    problem: Problem, deviations: Array, omega: FrequencyRange, options: Mapping[str, Any] | None, listeners: Any
) -> Solutions:
    for s, value in enumerate(deviations.tolist()):
        problem = problem.with_parameter(f"stiffness@{s}", value)
    branch = forced_response(problem, omega=omega, peaks_of=LARGEST, options=options, listeners=listeners)
    if branch.outcome is Outcome.INTERRUPTED:  # its peaks are not those of the range
        raise KeyboardInterrupt
    return branch


def _peaks_of(branch: Solutions, dof: str) -> list[tuple[float, float]]:
    """Located peaks that belong to a dof, in their order along the branch."""
    d = branch.dof_index(dof)
    at = np.flatnonzero(branch.table["peak_dof"].to_numpy() == d)
    followed, size = branch.table["omega"].to_numpy(), branch.table["amplitude"].to_numpy()
    return [(float(followed[i]), float(size[i, d])) for i in at]


def _highest(branch: Solutions) -> float:
    peaks = branch.peaks(LARGEST)
    if not peaks:
        raise InputError(Fault("omega", "no peak of the largest amplitude is in the range", remedy="widen it"))
    return max(amplitude for _, amplitude in peaks)


def _top(branch: Solutions) -> tuple[float, str]:
    """Where the highest peak is, and of which dof."""
    size, of = branch.table["amplitude"].to_numpy(), branch.table["peak_dof"].to_numpy()
    at = max(np.flatnonzero(of >= 0).tolist(), key=lambda i: size[i, of[i]])
    return float(branch.table["omega"].to_numpy()[at]), str(branch.table["dof"].to_numpy()[of[at]])
