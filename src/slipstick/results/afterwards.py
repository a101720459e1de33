"""What looks wrong in the results of a branch, one sentence each, the same on every road."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from slipstick.results.schema import NEAR_PEAK
from slipstick.results.stability import stability_sentences
from slipstick.results.truncation import truncation_sentence
from slipstick.typing import Array


def result_warnings(
    followed: str,
    values: Mapping[str, Array],
    contacts: Sequence[str],
    unit: str = "rad/s",
    asked: float | None = None,
) -> list[str]:
    """Contacts that never acted, harmonics that are missing, and stability that is in doubt.

    ``followed`` names what ``values["parameter"]``, else ``values["omega"]``, are values of; ``unit`` that of
    frequencies, ``asked`` the accuracy to which harmonics were adapted.
    """
    at = values["parameter" if "parameter" in values else "omega"]
    missing = truncation_sentence(followed, at, values["truncation"], unit, asked)
    doubts = stability_sentences(followed, at, values, unit) if "stable" in values else ()
    return [
        *_open(values, contacts),
        *_near_peaks(followed, at, values, unit),
        *([missing] if missing else []),
        *doubts,
    ]


def _near_peaks(followed: str, at: Array, values: Mapping[str, Array], unit: str) -> Iterator[str]:
    near = np.flatnonzero(np.asarray(values["kind"]) == NEAR_PEAK) if "kind" in values else np.zeros(0, dtype=int)
    if near.size:
        where = ", ".join(f"{at[i]:.6g}" for i in near[:5]) + (" and more" if len(near) > 5 else "")
        of = f" {unit}" if followed == "omega" else f" ({followed})"
        yield (
            f"next to {where}{of} an amplitude is largest, but no solution was found there: points of kind "
            f'"{NEAR_PEAK}" are the nearest; try a smaller max_step'
        )


def _open(values: Mapping[str, Array], contacts: Sequence[str]) -> Iterator[str]:
    share = values.get("separation_fraction")
    if share is None or not len(share):
        return
    for name, own in zip(contacts, np.asarray(share).T, strict=True):
        if np.all(own >= 1.0):
            yield f"contact '{name}': it was open at every point, so it never acted: check its gap and its units"
