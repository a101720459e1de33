"""What a page needs of each contact at each point to draw its forces again: coefficients, parameters, states."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.forces import Interval, element_states
from slipstick.report.encoding import fixed, packed
from slipstick.results.branch import PARAMETERS
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray

STATES = ("separation", "stick", "slip+", "slip-")
"""A state is stored as its place here."""
Indices = NDArray[np.intp]


def friction_of(dataset: xarray.Dataset, harmonics: Harmonics, kept: Indices) -> dict[str, Any] | None:
    """Friction contacts among those kept: their force follows exactly from motion, parameters and states.

    States are computed here, all points and contacts in one batch. ``of`` are places in ``kept``.
    """
    needed = ("contact_tangential", "contact_normal", "friction_force", *PARAMETERS.values())
    if not len(kept) or not {*needed, "rubbing_motion", "normal_motion", "rubbing_velocity"} <= set(dataset):
        return None
    own = np.flatnonzero(np.isfinite(dataset["friction_force"].to_numpy()[:, kept, 0]).all(axis=0))
    if not len(own):
        return None
    d = {name: dataset[name].to_numpy()[:, kept[own]] for name in (*needed, "rubbing_motion", "normal_motion")}
    drift = dataset["rubbing_velocity"].to_numpy()[:, kept[own]] / dataset["omega"].to_numpy()[:, None]
    total, normal = d["contact_tangential"] + d["rubbing_motion"], d["contact_normal"] + d["normal_motion"]
    parameters = {key: d[name] for key, name in PARAMETERS.items()}
    flat = {key: value.ravel() for key, value in ({"v": drift} | parameters).items()}
    shape = (-1, harmonics.size)
    intervals = element_states(harmonics, total.reshape(shape), normal.reshape(shape), **flat)
    return {
        "of": own.tolist(),
        "motion": fixed(d["contact_tangential"]),
        "rubbing": packed(d["rubbing_motion"], "f8"),
        "normal": fixed(normal),
        "drift": packed(drift, "f8"),
        **{key: packed(value, "f8") for key, value in parameters.items()},
        "mean": packed(d["friction_force"][:, :, 0], "f8"),
        "states": _states(intervals, drift.shape),
    }


def _states(intervals: list[list[Interval]], shape: tuple[int, ...]) -> dict[str, Any]:
    """Each interval ends where the next begins, round the period: starts and states say all."""
    starts = np.array([start for own in intervals for start, _, _ in own])
    codes = np.array([STATES.index(state) for own in intervals for _, _, state in own])
    counts = np.array([len(own) for own in intervals]).reshape(shape)
    return {"counts": packed(counts, "u2"), "starts": packed(starts, "f8"), "codes": packed(codes, "u1")}


def series_of(dataset: xarray.Dataset, kept: Indices, friction: Indices) -> list[dict[str, Any]]:
    """Contacts of other laws by port: motion and force as the harmonics kept, which is all the results know."""
    others = np.setdiff1d(np.arange(len(kept)), friction)
    return [found for port, force in _ports(dataset) if (found := _port(dataset, kept, others, port, force))]


def _ports(dataset: xarray.Dataset) -> Iterator[tuple[str, str]]:
    """Names of ports and their forces."""
    for name in map(str, dataset.data_vars):
        port = name.removeprefix("contact_")
        force = next((f for f in (f"{port}_force", "friction_force") if f in dataset), None)
        if name.startswith("contact_") and force:
            yield port, force


def _port(dataset: xarray.Dataset, kept: Indices, others: Indices, port: str, force: str) -> dict[str, Any] | None:
    motion, forces = (dataset[name].to_numpy()[:, kept[others]] for name in (f"contact_{port}", force))
    there = np.isfinite(forces).all(axis=(0, 2)) if len(forces) else np.zeros(len(others), dtype=bool)
    if not there.any():
        return None
    arrays: dict[str, Array] = {"motion": motion[:, there], "force": forces[:, there]}
    return {"of": others[there].tolist(), "port": port, **{name: packed(values) for name, values in arrays.items()}}
