"""From measured time series to compared numbers: coefficients of steady vibration, or the backbone of a free decay.

A steady vibration is periodic: its last whole periods give the coefficients of the problem's harmonics by least
squares.
A free decay is cut into windows of a few periods. In each the motion is a vibration whose frequency and rate of decay
are one number, ``e^{-d t} (c cos w t + s sin w t)`` with harmonics 2 and 3 and a mean (least squares over ``w`` and
``d``): the amplitude, frequency and damping ratio ``d / w`` of a slowly varying free vibration (M. Feldman, Hilbert
Transform Applications in Mechanical Vibration, 2011, chapter 5, takes them from the analytic signal).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError
from slipstick.faults import numbers
from slipstick.quantities import FREQUENCIES
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray

_PERIODS = 5
"""Number of last periods from which a steady vibration is taken."""
_WINDOW = 3
"""Periods of a window of a decay."""
_LEAST_RATIO = 0.5
"""Ratio of amplitudes after and before a window, below which a decay is too fast and no longer followed."""
_UNSTEADY = 0.02
"""Relative change of the coefficients between the two halves of these periods, above which a note says so."""
_LEAST = 8
"""Least number of samples in a period."""
_SMALLEST = 0.01
"""Amplitude over the largest one, down to which a decay is followed."""
_ORDERS = (1, 2, 3)


def periodic_or_decaying(problem: Problem, data: xarray.Dataset) -> xarray.Dataset:
    """Dataset of coefficients, of a loop or of a backbone, from a series over ``time``.

    Raises
    ------
    InputError
        For series that are too short, or not equally ordered in time.

    What a user is to be told, as of a vibration that is not steady yet, is the attribute "notes".
    """
    if "time" not in data.variables:
        raise InputError(Fault(("measured", "time"), "has no values", remedy="give the times of the samples, s"))
    time = numbers(("measured", "time"), data["time"].values)
    if time.ndim != 1 or time.size < 2 * _LEAST or np.any(np.diff(time) <= 0.0):
        raise InputError(
            Fault(("measured", "time"), f"{time.size} samples", expected=f"{2 * _LEAST} or more, ascending")
        )
    if "displacement" not in data or "time" not in data["displacement"].dims:
        raise InputError(Fault(("measured", "displacement"), "is missing", remedy="give displacement(time, dof)"))
    if "omega" not in data.variables:
        return _decay(problem, data, time)
    return _steady(problem, data, time)


def _steady(problem: Problem, data: xarray.Dataset, time: Array) -> xarray.Dataset:
    """Coefficients (run, dof, coefficient) of the last periods; a loop keeps its samples."""
    import xarray

    factor = FREQUENCIES.get(str(data["omega"].attrs.get("units", "")), 1.0)
    omega = factor * np.ravel(numbers(("measured", "omega"), data["omega"].values, "frequencies > 0"))
    if np.any(omega <= 0.0):
        raise InputError(Fault(("measured", "omega"), f"{omega.min():g}", expected="frequencies > 0"))
    lead = [dim for dim in data["displacement"].dims if dim not in ("time", "dof")]
    if omega.size > 1 and (len(lead) != 1 or data["omega"].dims != tuple(lead)):
        expected = f"one along {lead[0]}" if lead else "one for a single series"
        raise InputError(Fault(("measured", "omega"), f"{omega.size} frequencies", expected=expected))
    if "force" in data:
        if omega.size > 1:
            raise InputError(Fault(("measured", "omega"), "several", expected="one for loops over time"))
        last = _last(time, float(omega[0]))
        kept = data.isel(time=last).drop_vars("time").rename_dims(time="sample")
        return kept.assign(tau=("sample", omega[0] * time[last]))
    x = data["displacement"]
    if "dof" not in x.dims:
        x = x.expand_dims(dof=[str(x["dof"].values) if "dof" in x.coords else (problem.outputs or ("",))[0]])
    runs = x.transpose(*lead, "dof", "time")
    samples = np.asarray(runs.values, dtype=float).reshape(-1, *runs.shape[-2:])
    each = np.broadcast_to(omega, (len(samples),))
    out, worst = np.empty((*samples.shape[:2], problem.harmonics.size)), (0.0, 0.0)
    for k, (w, motion) in enumerate(zip(each, samples, strict=True)):
        last = _last(time, float(w))
        middle = last[last.size // 2]
        out[k] = _coefficients(problem, w * time[last], motion[:, last])
        first, second = (
            _coefficients(problem, w * time[half], motion[:, half], few=True)
            for half in (last[last < middle], last[last >= middle])
        )
        changes = np.nan_to_num((second - first)[:, 1:])
        change = float(np.linalg.norm(changes) / (np.linalg.norm(np.nan_to_num(out[k][:, 1:])) or 1.0))
        worst = max(worst, (change, float(w)))
    notes = {}
    if worst[0] > _UNSTEADY:
        notes["notes"] = (
            f"the vibration measured at {worst[1]:.6g} rad/s is not steady: its coefficients change by "
            f"{100 * worst[0]:.2g} % within the last {_PERIODS} periods"
        )
    labels = ["0", *(f"{part}{m}" for m in problem.harmonics.orders[1:] for part in "cs")]
    others = {
        str(name): variable for name, variable in data.data_vars.items()
        if name not in ("displacement", "omega") and set(variable.dims) <= set(lead)
    }  # fmt: skip
    shape = (*(data.sizes[dim] for dim in lead), *out.shape[1:])
    dims = (*lead, "dof", "coefficient") if lead else ("point", "dof", "coefficient")
    coords: dict[str, Any] = {"dof": runs["dof"].values, "coefficient": labels}
    coords |= {str(dim): data[dim] for dim in lead if dim in data.coords}
    variables = {
        "displacement": (dims, out.reshape(shape if lead else (1, *out.shape[1:]))),
        "omega": (dims[:1], each if lead else each[:1]), **others,
    }  # fmt: skip
    return xarray.Dataset(variables, coords=coords, attrs={**data.attrs, **notes})


def _last(time: Array, omega: float) -> Any:
    """Indices of the samples in the last whole periods."""
    period = 2.0 * np.pi / omega
    count = min(_PERIODS, int((time[-1] - time[0]) / period * (1.0 + 1e-9)))
    if count < 2:
        raise InputError(
            Fault(("measured", "time"), "less than two periods", expected="two or more, the last ones steady")
        )
    last = np.flatnonzero(time > time[-1] - count * period * (1.0 - 1e-9))
    if last.size < _LEAST * count:
        raise InputError(
            Fault(("measured", "time"), f"{last.size / count:.1f} samples a period", expected=f"{_LEAST} or more")
        )
    return last


def _coefficients(problem: Problem, tau: Array, motion: Array, *, few: bool = False) -> Array:
    """Of motions (n_dofs, n_samples), (n_dofs, L); nan of a dof that was not measured.

    Samples that are nan are left out. Where too few are left it is an error, or with ``few`` nan.
    """
    H = np.asarray(problem.harmonics.H_minus(tau))
    out = np.full((len(motion), H.shape[1]), np.nan)
    for k, row in enumerate(motion):
        there = np.isfinite(row)
        enough = there.sum() >= H.shape[1]
        if enough:
            out[k] = np.linalg.lstsq(H[there], row[there], rcond=None)[0]
        elif there.any() and not few:
            left = f"{int(there.sum())} samples"
            raise InputError(Fault(("measured", "time"), left, expected=f"{H.shape[1]} or more"))
    return out


def _decay(problem: Problem, data: xarray.Dataset, time: Array) -> xarray.Dataset:
    """Amplitude, frequency and damping ratio in each window of a free decay."""
    import xarray

    x = data["displacement"]
    if "dof" in x.dims and x.sizes["dof"] > 1:
        raise InputError(Fault(("measured", "displacement"), "a free decay of several dofs", expected="one",
                               remedy='select it, .sel(dof="x")'))  # fmt: skip
    over = [dim for dim in x.dims if dim not in ("time", "dof")]
    if over:
        raise InputError(Fault(("measured", "displacement"), f"also over {over[0]}", expected="one decay at a time"))
    dof = str(np.ravel(x["dof"].values)[0]) if "dof" in x.coords else ""
    samples = np.asarray(x.values, dtype=float).reshape(-1)
    there = np.isfinite(samples)
    rows = np.array(list(windows(time[there], samples[there])))
    if len(rows) < 2:
        raise InputError(
            Fault(
                ("measured", "time"),
                "too short or too fast a decay",
                expected=f"{2 * _WINDOW} periods or more in which it is slow",
            )
        )
    kept = {name: variable for name, variable in data.data_vars.items() if not variable.dims}
    names = ("modal_amplitude", "omega", "modal_damping")
    found = {name: ("point", column) for name, column in zip(names, rows.T, strict=True)}
    return xarray.Dataset({**found, **kept}, attrs={**data.attrs, **({"dof": dof} if dof else {})})


def windows(time: Array, x: Array) -> Iterator[tuple[float, float, float]]:
    """Amplitude of harmonic 1, frequency and damping ratio in the middle of each window, from large to small motion."""
    from scipy.optimize import least_squares

    omega = _first_frequency(time, x)
    start, largest, decay = float(time[0]), 0.0, 0.01
    while start + _WINDOW * 2.0 * np.pi / omega <= time[-1]:
        width = _WINDOW * 2.0 * np.pi / omega
        inside = (time >= start) & (time <= start + width)
        if np.sum(inside) < _LEAST * _WINDOW:
            raise InputError(Fault(("measured", "time"), "too few samples", expected=f"{_LEAST} a period or more"))
        t, motion = time[inside] - start - width / 2.0, x[inside]
        size = float(np.linalg.norm(motion)) or 1.0

        def left(z: Array, t: Array = t, motion: Array = motion, size: float = size) -> Array:
            return np.asarray((_decaying(t, z[0], z[1]) @ _fitted(t, z, motion) - motion) / size)

        found = least_squares(left, [omega, decay * omega], x_scale=[omega, 0.01 * omega], xtol=1e-12, ftol=1e-14).x
        part = _fitted(t, found, motion)
        amplitude = float(np.hypot(part[1], part[2]))
        largest = max(largest, amplitude)
        if amplitude < _SMALLEST * largest or np.exp(-found[1] * width) < _LEAST_RATIO:
            return
        omega, decay = float(found[0]), float(found[1] / found[0])
        yield amplitude, omega, decay
        start += width


def _decaying(t: Array, omega: float, rate: float) -> Array:
    """Mean and harmonics, the first decaying at a rate, the others as its powers (n_samples, 7)."""
    columns = [np.ones_like(t)]
    for m in _ORDERS:
        envelope = np.exp(-m * rate * t)
        columns += [envelope * np.cos(m * omega * t), envelope * np.sin(m * omega * t)]
    return np.column_stack(columns)


def _fitted(t: Array, z: Array, motion: Array) -> Array:
    return np.asarray(np.linalg.lstsq(_decaying(t, z[0], z[1]), motion, rcond=None)[0])


def _first_frequency(time: Array, x: Array) -> float:
    """Frequency from crossings of the mean in the first part of the decay, with a least size between them."""
    centred = x - x.mean()
    up = np.flatnonzero((centred[:-1] < 0.0) & (centred[1:] >= 0.0))
    if up.size < 3:
        raise InputError(Fault(("measured", "time"), "shows no vibration", expected="a decay of several periods"))
    at = time[up] - centred[up] * (time[up + 1] - time[up]) / (centred[up + 1] - centred[up])
    return float(2.0 * np.pi / np.median(np.diff(at[: max(3, min(at.size, 2 * _PERIODS))])))
