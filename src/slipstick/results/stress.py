"""Stress and strain at places of a body along a branch, from its modes and the forces on its dofs; for fatigue."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import MOST_ITEMS, one_or_listed, point_numbers, shown, whole
from slipstick.results.deflection import force_fields, parts_of, recovered_motion
from slipstick.structure.strains import COMPONENTS, ELEMENTS, MOST_NUMBER, StrainPlaces, Strains
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, IntArray, Points

if TYPE_CHECKING:
    import xarray

    from slipstick.balance.problem import Problem
    from slipstick.results.solutions import Solutions

PLACE = "place"
STRESS, STRAIN = "stress", "strain"
STRESS_UNITS = "force/length^2"

_MOST = 50_000_000
"""Coefficients that one call may make: 400 MB."""

_TOGETHER = 2_000_000
"""Of the points computed together."""

_VON_MISES = np.zeros((6, 6))
"""Von Mises stress is the length of ``_VON_MISES @ stress``."""
_VON_MISES[:3, :3] = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [-1.0, 0.0, 1.0]]) / np.sqrt(2.0)
_VON_MISES[3:, 3:] = np.sqrt(3.0) * np.eye(3)

_TENSOR = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
"""Places of the components in the tensor."""

_MEASURES = {
    "von_mises_static": "von Mises stress of the static part (harmonic 0)",
    "von_mises_amplitude": "largest von Mises stress over the period of the vibration about the static part",
    "von_mises_largest": "largest von Mises stress over the period",
    "principal_largest": "largest principal stress over the period",
    "principal_smallest": "smallest principal stress over the period",
    "stress_mean": "von Mises stress midway between the two times furthest apart, negative in compression",
    "stress_alternating": "half the von Mises stress of the difference between the two times furthest apart",
}


def von_mises(stress: Array) -> Array:
    """Of stresses (..., 6, k): (..., k)."""
    return np.asarray(np.linalg.norm(_VON_MISES @ stress, axis=-2))


def principals(stress: Array) -> Array:
    """Of stresses (..., 6, k): (..., k, 3), the largest first."""
    tensors = np.moveaxis(stress, -2, -1)[..., _TENSOR]
    return np.asarray(np.linalg.eigvalsh(tensors)[..., ::-1])


def strains_of(branch: Solutions) -> Strains:
    """Those of its structure; InputError that says why there are none."""
    if branch.problem is None:
        raise InputError(f"stress: the problem of this branch is not known: {branch.without}")
    structure = branch.problem.structure
    strains = structure.strains
    if strains is None:
        raise InputError(
            Fault(
                "stress",
                f"this {type(structure).__name__} has no geometry and material of elements",
                remedy='ask for them where a model with a mesh is reduced: ss.reduced_body(model, ..., stress="all")',
            )
        )
    return strains


def stress_of(branch: Solutions, points: Points = None, at: Any = None) -> xarray.Dataset:
    """See ``Branch.stress``."""
    strains = strains_of(branch)
    numbers = point_numbers("points", points, len(branch))
    chosen = chosen_places(strains.places, at)
    L = branch.table.sizes["coefficient"]
    if len(numbers) * len(chosen) * 6 * L > _MOST:
        found = f"{len(numbers)} points and {len(chosen)} places"
        remedy = f"give fewer: {_MOST // (6 * L)} points times places at most"
        raise InputError(Fault("stress", found=found, remedy=remedy))
    strain, free = _strain(branch, strains, numbers, chosen)
    stress = strains.places.stress(strain - free, chosen)
    measured = [_measured(branch.harmonics, one) for one in stress]
    return _dataset(branch, strains.places, chosen, numbers, strain, stress, measured)


def stress_history(branch: Solutions, point: int, at: Any = None, samples: int = 64) -> xarray.Dataset:
    """See ``Branch.stress_history``."""
    import xarray

    samples = whole("samples", samples, 1, MOST_ITEMS)
    found = stress_of(branch, [whole("point", point, -len(branch), len(branch) - 1)], at).isel(point=0)
    if found.sizes[PLACE] * 6 * samples > _MOST:
        raise InputError(Fault("samples", found=f"{samples} at {found.sizes[PLACE]} places", remedy="give fewer"))
    tau = np.arange(samples) * (2.0 * np.pi / samples)
    H = branch.harmonics.H_minus(tau).T
    stress, strain = (found[name].to_numpy() @ H for name in (STRESS, STRAIN))
    of_place, meaning = (PLACE, "component", "time"), {"units": found[STRESS].attrs["units"]}
    omega = float(found["omega"])
    return xarray.Dataset(
        {
            STRESS: (of_place, stress, meaning | {"long_name": "stress"}),
            STRAIN: (of_place, strain, {"units": "1", "long_name": "strain"}),
            "von_mises": ((PLACE, "time"), von_mises(stress), meaning | {"long_name": "von Mises stress"}),
            "principal": ((PLACE, "time", "rank"), principals(stress), meaning | {"long_name": "principal stresses"}),
        },
        coords={
            **{name: value for name, value in found.coords.items() if value.dims in ((PLACE,), (PLACE, "axis"))},
            "component": list(COMPONENTS),
            "time": ("time", tau / omega, {"long_name": "time"}),
        },
        attrs=dict(found.attrs),
    )


def chosen_places(places: StrainPlaces, at: Any) -> IntArray:
    """Indices of places by number of element or node; all without."""
    if at is None:
        return np.arange(len(places.labels))
    expected = f"numbers of {places.at}"
    items = one_or_listed("at", at, expected)
    numbers = np.array([whole("at", item, 0, MOST_NUMBER) for item in items], dtype=np.int64)
    missing = numbers[~np.isin(numbers, places.labels)]
    if missing.size or not numbers.size:
        ends = f"from {places.labels.min()} to {places.labels.max()}"
        known = shown(places.labels) if len(places.labels) < 10 else f"{len(places.labels)} {ends}"
        what = f"the strain is not kept at number {missing[0]}" if missing.size else "no number is given"
        raise InputError(Fault("at", what, remedy=f"it is at these {places.at}: {known}"))
    order = np.argsort(places.labels, kind="stable")
    first, last = (np.searchsorted(places.labels[order], numbers, side) for side in ("left", "right"))
    return np.concatenate([order[a:b] for a, b in zip(first, last, strict=True)])


def _strain(branch: Solutions, strains: Strains, numbers: list[int], chosen: IntArray) -> tuple[Array, Array]:
    """Coefficients (n_points, n_places, 6, L) of the strain, and of what of it is free of stress."""
    rows = (6 * chosen[:, None] + np.arange(6)).ravel()
    L = branch.table.sizes["coefficient"]
    step, parts, free = max(1, _TOGETHER // (len(rows) * L)), [], []
    for first in range(0, len(numbers), step):
        points = numbers[first : first + step]
        forces = force_fields(branch, points, 0.0) if strains.static is None else None
        for balance, at in parts_of(branch, points):
            structure: Any = balance.problem.structure
            recovered = structure.strains.of(structure, rows, forces)
            parts.append(recovered_motion(balance, recovered, branch.table, at))
            free.append(np.broadcast_to(_free(balance.problem, structure.strains, rows), parts[-1].shape))
    none = np.empty((0, len(rows), L))
    strain, without = (np.concatenate(each or [none]).reshape(-1, len(chosen), 6, L) for each in (parts, free))
    return strain, without


def _free(problem: Problem, strains: Strains, rows: IntArray) -> Array:
    """Strain without stress at some rows (n, L), as that of temperature."""
    P, columns = problem.load_coefficients(), problem.load_columns
    found = np.zeros((len(rows), P.shape[1]))
    for name, row in zip(columns.shapes, P[columns.vectors.shape[1] :], strict=True):
        if name in strains.free:
            found += np.outer(strains.free[name][rows], row)
    return found


def _dataset(
    branch: Solutions,
    places: StrainPlaces,
    chosen: IntArray,
    numbers: list[int],
    strain: Array,
    stress: Array,
    measured: list[dict[str, Array]],
) -> xarray.Dataset:
    import xarray

    assert branch.problem is not None
    table, units = branch.table, branch.problem.units
    unit, number = units.label(STRESS_UNITS), "element" if places.at == ELEMENTS else "node"
    dims = ("point", PLACE, "component", "coefficient")
    of_points = {
        name: ("point", table[name].to_numpy()[numbers], dict(table[name].attrs))
        for name in dict.fromkeys(("omega", branch.followed))
    }
    return xarray.Dataset(
        {
            **of_points,
            STRESS: (dims, stress, {"units": unit, "long_name": "stress coefficients"}),
            STRAIN: (dims, strain, {"units": "1", "long_name": "strain coefficients, shear as angles"}),
            **{
                name: (
                    ("point", PLACE),
                    np.array([one[name] for one in measured]).reshape(len(numbers), len(chosen)),
                    {"units": unit, "long_name": text},
                )
                for name, text in _MEASURES.items()
            },
        },
        coords={
            "point": ("point", np.array(numbers, dtype=np.int64), {"long_name": "number along the branch"}),
            number: (PLACE, places.labels[chosen], {"long_name": f"number of the {number}"}),
            "position": ((PLACE, "axis"), places.positions[chosen], {"units": units.label("length")}),
            "component": list(COMPONENTS),
            "coefficient": list(branch.harmonics.labels),
        },
        attrs={"title": str(table.attrs.get("title", "")), **units.attributes},
    )


def _measured(harmonics: Harmonics, stress: Array) -> dict[str, Array]:
    """What fatigue asks of stress coefficients (n_places, 6, L) of one point, each (n_places,)."""
    lengths = _VON_MISES @ stress
    moving = lengths.copy()
    moving[..., 0] = 0.0
    count = max(64, 8 * harmonics.highest)
    norm = lambda values: np.linalg.norm(values, axis=-2)  # noqa: E731
    largest, _ = _peak(harmonics, stress, lambda s: principals(s)[..., 0], count)
    smallest, _ = _peak(harmonics, stress, lambda s: -principals(s)[..., 2], count)
    half, first, second = _furthest(harmonics, moving, count)
    middle = 0.5 * (_at(harmonics, stress, first[:, None]) + _at(harmonics, stress, second[:, None]))
    mean, trace = von_mises(middle)[:, 0], middle[:, :3, 0].sum(axis=1)
    return {
        "von_mises_static": np.asarray(norm(lengths[..., :1])[:, 0]),
        "von_mises_amplitude": _peak(harmonics, moving, norm, count)[0],
        "von_mises_largest": _peak(harmonics, lengths, norm, count)[0],
        "principal_largest": largest,
        "principal_smallest": -smallest,
        "stress_mean": np.where(trace < -_ROUNDING * mean, -mean, mean),
        "stress_alternating": half,
    }


_ROUNDING = 1e-6
"""A trace below this share of the von Mises stress is that of shear."""

_ZOOMS = 8
"""Each takes a quarter of the distance between times about the best one: the last is 1/65536 of the first."""


def _at(harmonics: Harmonics, X: Array, tau: Array) -> Array:
    """Values (n, 6, k) of coefficients (n, 6, L) at times (n, k)."""
    return np.asarray(X @ harmonics.H_minus(tau).swapaxes(-1, -2))


def _peak(harmonics: Harmonics, X: Array, value: Callable[[Array], Array], count: int) -> tuple[Array, Array]:
    """Largest over the period of what ``value`` makes (n, k) of (n, 6, k), and when, rad: both (n,)."""
    tau = np.arange(count) * (2.0 * np.pi / count)
    found = value(X @ harmonics.H_minus(tau).T)
    best, time = found.max(axis=1, initial=-np.inf), tau[found.argmax(axis=1)] if len(X) else np.empty(0)
    apart = tau[1] if count > 1 else np.pi
    for _ in range(_ZOOMS):
        times = time[:, None] + apart * np.linspace(-1.0, 1.0, 9)
        found = value(_at(harmonics, X, times))
        k = found.argmax(axis=1)
        best, time = found[np.arange(len(X)), k], times[np.arange(len(X)), k]
        apart *= 0.25
    return best, time


def _furthest(harmonics: Harmonics, X: Array, count: int) -> tuple[Array, Array, Array]:
    """Half the largest distance between two times of a path (n, 6, L), and these times, rad: all (n,)."""
    tau = np.arange(count) * (2.0 * np.pi / count)
    best, first, second = np.empty(len(X)), np.empty(len(X)), np.empty(len(X))
    step = max(1, _TOGETHER // count**2)
    for start in range(0, len(X), step):
        part = slice(start, start + step)
        path = X[part] @ harmonics.H_minus(tau).T
        square = np.einsum("nck,nck->nk", path, path)
        distances = square[:, :, None] + square[:, None, :] - 2.0 * path.swapaxes(1, 2) @ path
        pair = distances.reshape(len(path), -1).argmax(axis=1)
        best[part], first[part], second[part] = _zoomed(
            harmonics, X[part], tau[pair // count], tau[pair % count], tau[1]
        )
    return best, first, second


def _zoomed(harmonics: Harmonics, X: Array, first: Array, second: Array, step: float) -> tuple[Array, Array, Array]:
    """Largest distance on the path and its two times, refined from a pair on a grid of spacing ``step``."""
    n, near = np.arange(len(X)), np.linspace(-1.0, 1.0, 5)
    best = np.zeros(len(X))
    for _ in range(2 * _ZOOMS):
        times = [at[:, None] + step * near for at in (first, second)]
        one, other = (_at(harmonics, X, t) for t in times)
        distance = np.linalg.norm(one[..., :, None] - other[..., None, :], axis=1).reshape(len(X), -1)
        k = distance.argmax(axis=1)
        best, first, second = 0.5 * distance[n, k], times[0][n, k // 5], times[1][n, k % 5]
        step *= 0.5
    return best, first, second
