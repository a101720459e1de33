"""Warnings about the results of a branch: one sentence each, the same in Python, files, pages and the terminal."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from slipstick.faults import few_alike
from slipstick.results.schema import NEAR_FOLD, NEAR_PEAK
from slipstick.results.stability import stability_sentences
from slipstick.results.truncation import truncation_sentence
from slipstick.typing import Array

_LARGEST_MEAN = 1e9
"""Mean motion over the vibration of the contacts, above which there is a warning: of 16 digits fewer than 7 are left to
the vibration, and peaks between solutions are located with no fewer."""


def result_warnings(
    followed: str,
    values: Mapping[str, Array],
    contacts: Sequence[str],
    unit: str = "rad/s",
    asked: float | None = None,
    requested: Sequence[float] = (),
    loaded: Collection[str] = (),
) -> list[str]:
    """Contacts that never acted, points that are missing or misplaced, vibrations lost beside a far larger mean,
    missing harmonics, and uncertain stability.

    ``followed`` is "omega", or the name of the quantity in ``values["parameter"]``, else in ``values["omega"]``;
    ``unit`` that of frequencies, ``asked`` the accuracy to which harmonics were adapted, ``requested`` the values at
    which points are requested. Of contacts that are ``loaded`` before, the load steps tell what is open.
    """
    at = values["parameter" if "parameter" in values and followed != "omega" else "omega"]
    missing = truncation_sentence(followed, at, values["truncation"], unit, asked)
    doubts = stability_sentences(followed, at, values, unit) if "stable" in values else ()
    return [
        *few_alike(_open(values, contacts, loaded)),
        *_near(followed, at, values, unit),
        *_passed_over(followed, at, values, unit, requested),
        *_hidden(followed, at, values, unit),
        *([missing] if missing else []),
        *doubts,
    ]


def _near(followed: str, at: Array, values: Mapping[str, Array], unit: str) -> Iterator[str]:
    kinds = np.asarray(values.get("kind", ()))
    for kind, what in ((NEAR_PEAK, "an amplitude is largest"), (NEAR_FOLD, "the branch turns back")):
        if np.any(kinds == kind):
            yield (
                f"next to {_listed(at[kinds == kind].tolist(), followed, unit)} {what}, but no solution was found "
                f'there: points of kind "{kind}" are the nearest; try a smaller max_step'
            )


def _passed_over(
    followed: str, at: Array, values: Mapping[str, Array], unit: str, requested: Sequence[float]
) -> Iterator[str]:
    """Requested values that the branch passes without a point."""
    if not requested or "kind" not in values:
        return
    solved = np.asarray(values["kind"]) != "interpolated"
    parts = np.asarray(values["branch_part"])[solved] if "branch_part" in values else np.ones(np.count_nonzero(solved))
    missed = [
        value
        for value in sorted(set(requested))
        if any(
            part == next_part and (before - value) * (after - value) < 0.0
            for (before, part), (after, next_part) in pairwise(zip(at[solved].tolist(), parts, strict=True))
        )
    ]
    if missed:
        yield (
            f"a point was requested at {_listed(missed, followed, unit)}, but no solution was found on the "
            "branch there: try a smaller max_step"
        )


def _hidden(followed: str, at: Array, values: Mapping[str, Array], unit: str) -> Iterator[str]:
    """Points whose vibration at the contacts is lost in the rounding of a far larger mean."""
    motions = [np.abs(motion) for name, motion in values.items() if name.startswith("contact_") and motion.ndim == 3]
    if not motions or not motions[0].size:
        return
    means, vibrations = (
        np.max([motion[:, :, part].max(axis=(1, 2), initial=0.0) for motion in motions], axis=0)
        for part in (slice(1), slice(1, None))
    )
    # a motion at rest has no vibration to be lost
    ratios = np.divide(means, vibrations, out=np.zeros_like(means), where=vibrations > 0.0)
    if np.any(ratios > _LARGEST_MEAN):
        worst, count = int(np.nanargmax(ratios)), int(np.sum(ratios > _LARGEST_MEAN))
        yield (
            f"the mean motion at the contacts is {ratios[worst]:.1g} times the vibration at "
            f"{_listed([float(at[worst])], followed, unit)} (and more than {_LARGEST_MEAN:.0e} times at {count} of "
            f"{ratios.size} points): beside it a computer's 16 digits do not resolve the vibration, so amplitudes and "
            "peaks there may be wrong; check static loads, friction coefficients, normal loads and their units"
        )


def _listed(values: Sequence[float], followed: str, unit: str) -> str:
    where = ", ".join(f"{value:.6g}" for value in values[:5]) + (" and more" if len(values) > 5 else "")
    return where + (f" {unit}" if followed == "omega" else f" ({followed})")


def _open(values: Mapping[str, Array], contacts: Sequence[str], loaded: Collection[str]) -> Iterator[str]:
    share = values.get("separation_fraction")
    if share is None or not len(share):
        return
    for name, shares in zip(contacts, np.asarray(share).T, strict=True):
        if np.all(shares >= 1.0) and name not in loaded:
            yield f"contact '{name}': it was open at every point, so it never acted: check its gap and its units"
