"""Reading of measurements: steady vibration at frequencies and levels, loops of a contact, or backbones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.identification.kinds import Backbone, Loops, Measured, Vibration
from slipstick.balance.parameters import FACTORS
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError
from slipstick.faults import (
    MEASURED,
    Gathering,
    enumerated,
    names,
    no_measured_numbers,
    numbers,
    path,
    shown,
    suggestion,
    whole,
    wrong,
)
from slipstick.quantities import FREQUENCIES
from slipstick.results.measured_columns import Columns, in_units, read_columns, require_quantity, unit_factor
from slipstick.results.measured_receptances import (
    QUANTITIES,
    UNIVERSAL,
    Function,
    checked_quantity,
    columns_fault,
    has_functions,
    read_functions,
    receptances,
)
from slipstick.results.response_functions import single_force
from slipstick.results.table import foreign_dataset, is_dataset
from slipstick.typing import AnyArray, Array

if TYPE_CHECKING:
    import xarray

_EXPECTED = (
    "an xarray.Dataset with omega and displacement(omega, dof, coefficient) or amplitude(omega, dof), displacement "
    "and force over the tau of loops, peak_omega and peak_amplitude, modal_amplitude, omega and modal_damping, "
    "displacement(time, dof) or receptance; or a file (.nc, .csv, .mat, .unv, .uff)"
)


_NUMBERS = (
    "displacement", "amplitude", "force", "normal_displacement", "omega", "peak_omega", "peak_amplitude",
    "modal_amplitude", "modal_damping",
)  # fmt: skip
"""Variables of a dataset that are compared with motions."""


def conditions_at(
    problem: Problem, names: Sequence[str], p: Array, conditions: Mapping[str, Array], point: int
) -> Problem:
    """The problem with parameters ``p`` and the conditions of a point."""
    set_there = {name: values[point] for name, values in conditions.items()}
    return problem.at_parameters({**dict(zip(names, p, strict=True)), **set_there})


def dataset_of(problem: Problem, measured: Any, columns: object = None, quantity: str | None = None) -> xarray.Dataset:
    """A dataset of displacements, given or read from a file; raises InputError for anything else.

    ``quantity`` says what was measured instead: "velocity" or "acceleration".
    """
    checked_quantity(quantity)
    file = path("measured", measured) if isinstance(measured, str | Path) else None
    if file is not None and not file.is_file():
        said = f"{file} is a folder" if file.is_dir() else f"there is no file {file}"
        raise InputError(Fault("measured", said, remedy="give the file of what was measured" if file.is_dir() else ""))
    ending = "" if file is None else file.suffix.lower()
    if columns is not None and ending not in (".csv", ".mat", *UNIVERSAL):
        raise columns_fault()
    if file is not None:
        if ending in (*UNIVERSAL, ".npz"):
            return _of_functions(problem, file, columns, quantity)
        if ending == ".nc":
            measured = foreign_dataset(file)
        else:
            found = read_columns(file, columns)
            if any("/" in name for name in found.values):
                return _of_functions(problem, file, columns, quantity)
            measured = _of_columns(problem, file, found, quantity)
    if not is_dataset(measured):
        raise wrong("measured", measured, _EXPECTED)
    if has_functions(measured):
        return _of_functions(problem, measured, None, quantity)
    return measured if quantity is None else measured.assign_attrs(quantity=quantity)


def read_measured(problem: Problem, measured: Any) -> Measured:
    """A measurement, as users give it, for a problem; raises InputError where it does not fit the problem."""
    measured = dataset_of(problem, measured)
    _require_measured(measured)
    quantity = measured.attrs.get("quantity", "displacement")
    checked_quantity(quantity)
    return _integrated(problem, _of_kind(problem, measured), quantity)


def _require_measured(data: xarray.Dataset) -> None:
    """Raises InputError for infinite numbers and those that no unit makes as large, with the place of the first."""
    faults = []
    for name in _NUMBERS:
        if name not in data.variables or not (places := no_measured_numbers(data[name].values)):
            continue
        array = data[name]
        at = np.unravel_index(places[0], array.shape)
        labels = [
            f"{dim} = {array[dim].values[k]:g}" if array[dim].dtype.kind in "iuf" else f"{dim} = {array[dim].values[k]}"
            for dim, k in zip(array.dims, at, strict=True)
        ]
        found = f"{array.values[at]:g}" + (f" at {', '.join(labels)}" if labels else "")
        if len(places) > 1:
            found += f", and {len(places) - 1} more"
        faults.append(Fault(("measured", name), found=found, expected=MEASURED))
    if faults:
        raise InputError(faults)


def _of_kind(problem: Problem, measured: Any) -> Measured:
    if "time" in measured.dims or "time" in measured.variables:
        from slipstick.analysis.identification.series import periodic_or_decaying

        measured = periodic_or_decaying(problem, measured)
    if "peak_omega" in measured or "peak_amplitude" in measured:
        return _peaks(problem, measured)
    if "modal_amplitude" in measured:
        return _mode(problem, measured)
    if "force" in measured:
        return _loops(problem, measured)
    if "displacement" in measured or "amplitude" in measured:
        return _vibration(problem, measured)
    raise wrong("measured", sorted(map(str, measured.variables)), _EXPECTED)


def _vibration(problem: Problem, data: xarray.Dataset) -> Vibration:
    name = "displacement" if "displacement" in data else "amplitude"
    values = data[name]
    if np.iscomplexobj(values.values):
        if name == "amplitude":
            raise InputError(
                Fault(
                    ("measured", "amplitude"), "complex numbers", expected="the largest |x - mean| of the period",
                    remedy='call complex numbers "displacement"',
                )
            )  # fmt: skip
        values = _by_coefficients(values)
    if "dof" not in values.dims:
        own = str(values["dof"].values) if "dof" in values.coords else (problem.outputs or ("",))[0]
        values = values.expand_dims(dof=[own])
    last = ["dof", "coefficient"] if name == "displacement" else ["dof"]
    if name == "displacement" and "coefficient" not in values.dims:
        raise InputError(
            Fault(
                ("measured", "displacement"), f"dimensions {tuple(map(str, values.dims))}",
                expected='a dimension "coefficient" with labels such as "c1", "s1", or complex numbers',
            )
        )  # fmt: skip
    values = values.transpose(..., *last)
    lead = tuple(values.dims[: -len(last)])
    checks = Gathering()
    omega = checks.take(_frequencies, data, lead, values)
    conditions = checks.take(_conditions, problem, data, lead, values)
    dofs = tuple(str(dof) for dof in values["dof"].values) if "dof" in values.coords else ()
    if not dofs and values.sizes["dof"] == len(problem.outputs or ()):
        dofs = tuple(problem.outputs or ())
    for dof in dofs or ("",):
        if dof not in problem.structure.dofs:
            checks.faults.append(
                Fault(
                    ("measured", "dof"), f"there is no dof {shown(dof)}", remedy=suggestion(dof, problem.structure.dofs)
                )
            )
    places = checks.take(_places, problem, values) if name == "displacement" else None
    checks.end()
    assert omega is not None
    assert conditions is not None
    array = _standing(values.values.astype(float), omega.size, len(last), places, problem.harmonics.size)
    notes = [note for note in (str(data.attrs.get("notes", "")),) if note]
    if name == "displacement":
        array, lone = _whole_pairs(array)
        if lone:
            notes.append(
                f"{lone} measured coefficients are left out: a cosine and a sine are one complex number, and the other "
                "one is nan there"
            )
    noise = None
    if "noise" in data:
        spread = data["noise"].broadcast_like(values).transpose(*values.dims).values.astype(float)
        noise = _standing(spread, omega.size, len(last), places, problem.harmonics.size)
    if not np.any(np.isfinite(array)):
        raise InputError(Fault(("measured", name), "holds no numbers"))
    still = [dof for k, dof in enumerate(dofs) if np.nanmax(np.abs(array[:, k]), initial=-1.0) == 0.0]
    if still:
        notes.append(f"all that was measured at {enumerated(still)} is 0: leave it out if its sensor was not connected")
    return Vibration(
        omega=omega, conditions=conditions, dofs=dofs, values=array, noise=noise, notes=tuple(notes)
    )  # fmt: skip


def _whole_pairs(values: Array) -> tuple[Array, int]:
    """Coefficients (..., dof, L) with nan in both parts of incomplete complex numbers, and the number of these.

    Of a dof and a harmonic of which one part was measured nowhere, the other part stands by itself, unless it is 0
    at all points: it is what ``nan + 0j`` leaves.
    """
    there = np.isfinite(values)
    out = np.where(there, values, np.nan)
    cosine, sine = there[..., 1::2], there[..., 2::2]
    points = tuple(range(values.ndim - 2))
    told = np.any(there & (values != 0.0), axis=points)
    both = np.any(cosine, axis=points) & np.any(sine, axis=points)
    lone = (cosine != sine) & (both | ~(told[..., 1::2] | told[..., 2::2]))
    for part in (out[..., 1::2], out[..., 2::2]):
        part[lone] = np.nan
    return out, int(lone.sum())


def _peaks(problem: Problem, data: xarray.Dataset) -> Backbone:
    import xarray

    given = [name for name in ("peak_omega", "peak_amplitude") if name in data]
    dof = _one_dof(problem, data, given[-1])
    columns = xarray.broadcast(*(_of_dof(data[name], dof) for name in given))
    lead = columns[0].dims
    one = columns[0] if lead else columns[0].expand_dims("point")
    lead = one.dims
    values = np.full((one.size, 2), np.nan)
    for name, column in zip(given, columns, strict=True):
        factor = FREQUENCIES.get(str(data[name].attrs.get("units", "")), 1.0) if name == "peak_omega" else 1.0
        values[:, int(name == "peak_amplitude")] = factor * np.asarray(column.values, dtype=float).reshape(-1)
    _positive(values, ("peak_omega", "peak_amplitude"))
    if not np.isfinite(values[:, 0]).any():
        raise InputError(Fault(("measured", "peak_omega"), "is missing", remedy="give the frequencies of the peaks"))
    omega = np.where(np.isfinite(values[:, 0]), values[:, 0], np.nanmean(values[:, 0]))
    noise = _noise_of(data, ("peak_omega_noise", "peak_amplitude_noise"), one, dof, values)
    return Backbone(
        kind="peak", dof=dof, omega=omega, conditions=_conditions(problem, data, lead, one), values=values,
        noise=noise, amplitude=np.zeros(0),
    )  # fmt: skip


def _mode(problem: Problem, data: xarray.Dataset) -> Backbone:
    import xarray

    given = [name for name in ("omega", "modal_damping") if name in data.variables]
    if not given:
        raise InputError(Fault(("measured", "omega"), "is missing", remedy="give omega, modal_damping, or both"))
    dof = _one_dof(problem, data, "modal_amplitude")
    dof = str(data.attrs.get("mode_of", dof)) if "dof" not in data["modal_amplitude"].coords else dof
    arrays = [data[name].reset_coords(drop=True) for name in ("modal_amplitude", *given)]
    size, *columns = xarray.broadcast(*(array.drop_vars(list(array.coords)) for array in arrays))
    amplitude, values = np.asarray(size.values, dtype=float).reshape(-1), np.full((size.size, 2), np.nan)
    for name, column in zip(given, columns, strict=True):
        factor = FREQUENCIES.get(str(data[name].attrs.get("units", "")), 1.0) if name == "omega" else 1.0
        values[:, int(name == "modal_damping")] = factor * np.asarray(column.values, dtype=float).reshape(-1)
    if not np.all(np.isfinite(amplitude) & (amplitude > 0.0)):
        raise wrong(("measured", "modal_amplitude"), float(np.nanmin(amplitude)), "amplitudes > 0")
    number = data["mode"].values if "mode" in data.variables else data.attrs.get("mode", 1)
    mode = int(whole(("measured", "mode"), int(np.ravel(number)[0]), 1))
    natural = np.asarray(problem.structure.natural_frequencies, dtype=float)
    near = float(natural[mode - 1]) if mode <= natural.size else 1.0
    lead = size.dims
    noise = _noise_of(data, ("omega_noise", "modal_damping_noise"), size, dof, values)
    return Backbone(
        kind="mode", dof=dof, omega=np.where(np.isfinite(values[:, 0]), values[:, 0], near),
        conditions=_conditions(problem, data, lead, size), values=values, noise=noise, mode=mode, amplitude=amplitude,
    )  # fmt: skip


def _positive(values: Array, names: Sequence[str]) -> None:
    for name, column in zip(names, values.T, strict=True):
        if np.any(column <= 0.0):
            raise wrong(("measured", name), float(np.nanmin(column)), "numbers > 0")


def _noise_of(data: xarray.Dataset, names: Sequence[str], one: Any, dof: str, values: Array) -> Array | None:
    """Given standard deviations (n, 2), or None; numbers without one are not fitted."""
    if not any(name in data for name in names):
        return None
    out = np.full(values.shape, np.nan)
    for k, name in enumerate(names):
        if name in data:
            out[:, k] = np.asarray(_of_dof(data[name], dof).broadcast_like(one).values, dtype=float).reshape(-1)
        elif np.isfinite(values[:, k]).any():
            raise InputError(Fault(("measured", name), "is missing", remedy="give the noise of both, or of neither"))
    return out


def _of_dof(variable: xarray.DataArray, dof: str) -> xarray.DataArray:
    return variable.sel(dof=dof) if "dof" in variable.dims else variable


def _one_dof(problem: Problem, data: xarray.Dataset, name: str) -> str:
    """The dof of a backbone."""
    if "dof" in data[name].dims and data.sizes["dof"] > 1:
        raise InputError(
            Fault(("measured", name), f"{data.sizes['dof']} dofs", expected="one", remedy='select it, .sel(dof="x")')
        )
    own = str(np.ravel(data["dof"].values)[0]) if "dof" in data.variables else ""
    dof = own or str(data.attrs.get("dof", "")) or (problem.outputs or ("",))[0]
    if dof not in problem.structure.dofs:
        raise InputError(
            Fault(("measured", "dof"), f"there is no dof {shown(dof)}", remedy=suggestion(dof, problem.structure.dofs))
        )
    return dof


def _standing(values: Array, n: int, last: int, places: list[int] | None, L: int) -> Array:
    flat = values.reshape(n, *values.shape[values.ndim - last :])
    if places is None:
        return flat
    out = np.full((*flat.shape[:2], L), np.nan)
    out[..., places] = flat
    return out


def _by_coefficients(values: xarray.DataArray) -> xarray.DataArray:
    """Complex numbers ``z`` of ``Re(z e^{i m tau})`` as coefficients ``c = Re z``, ``s = -Im z``.

    Without a dimension ``harmonic`` they are of harmonic 1. A number is missing where either of its parts is: an array
    that nan is written into holds ``nan + 0j``.
    """
    import xarray

    if "harmonic" not in values.dims:
        values = values.expand_dims(harmonic=[int(values["harmonic"]) if "harmonic" in values.coords else 1])
    parts = []
    for m in values["harmonic"].values.astype(int):
        z = values.sel(harmonic=m, drop=True)
        there = np.isfinite(z)
        real, imaginary = z.real.where(there), z.imag.where(there)
        parts += [(f"c{m}", real), (f"s{m}", -imaginary)] if m else [("0", real)]
    labels = [label for label, _ in parts]
    return xarray.concat([part for _, part in parts], dim="coefficient").assign_coords(coefficient=labels)


def _frequencies(data: xarray.Dataset, lead: Sequence[Any], values: xarray.DataArray) -> Array:
    if "omega" not in data.variables:
        raise InputError(Fault(("measured", "omega"), "is missing", remedy="give the frequencies, rad/s"))
    omega = data["omega"]
    factor = FREQUENCIES.get(str(omega.attrs.get("units", "")), 1.0)
    found = factor * numbers(("measured", "omega"), _over(omega, lead, values), "frequencies > 0")
    if np.any(found <= 0.0):
        raise wrong(("measured", "omega"), float(found.min()), "frequencies > 0")
    return found


def _over(variable: xarray.DataArray, lead: Sequence[Any], values: xarray.DataArray) -> Array:
    """A variable at every point, (n,)."""
    if not set(variable.dims) <= set(lead):
        raise InputError(
            Fault(
                ("measured", str(variable.name)), f"dimensions {tuple(map(str, variable.dims))}",
                expected=f"some of {tuple(map(str, lead))}, those of what was measured",
            )
        )  # fmt: skip
    one = values.isel({dim: 0 for dim in values.dims if dim not in lead}, drop=True)
    return np.asarray(variable.broadcast_like(one).transpose(*lead).values).reshape(-1)


def _conditions(
    problem: Problem, data: xarray.Dataset, lead: Sequence[Any], values: xarray.DataArray
) -> dict[str, Array]:
    """Variables named as a parameter of the problem; of a branch over a parameter, with that name."""
    found, checks = {}, Gathering()
    followed = str(data.attrs.get("parameter", ""))
    for key in data.variables:
        name = followed if key == "parameter" and followed else str(key)
        if name not in FACTORS and "." not in name:
            continue
        if checks.take(problem.parameter_target, name) is not None:
            found[name] = numbers(("measured", name), _over(data[key], lead, values))
    checks.end("measured")
    return found


def _places(problem: Problem, values: xarray.DataArray) -> list[int]:
    """Indices of the coefficients among those of the problem."""
    known = _labels(problem)
    labels = [str(label) for label in values["coefficient"].values]
    for label in labels:
        if label not in known:
            raise InputError(
                Fault(
                    ("measured", "coefficient"), f"there is no {shown(label)} among the problem's harmonics",
                    remedy=suggestion(label, known),
                )
            )  # fmt: skip
    return [known.index(label) for label in labels]


def _labels(problem: Problem) -> list[str]:
    orders = problem.harmonics.orders[1:]
    return ["0", *(f"{part}{m}" for m in orders for part in "cs")]


def _loops(problem: Problem, data: xarray.Dataset) -> Loops:
    if problem.contact_states:
        raise InputError(
            Fault(
                ("measured", "force"), "loops of contacts whose parameters follow a state, such as temperature",
                expected="a problem without", remedy="fit a problem with constant parameters to the loops",
            )
        )  # fmt: skip
    pair = _contact(problem, data)
    first, across = pair.contact.ports[0], pair.contact.surface_ports.get("normal")
    force, motion = data["force"], {first: data.get("displacement")}
    if across is not None and "normal_displacement" in data:
        motion[across] = data["normal_displacement"]
    if motion[first] is None:
        raise InputError(Fault(("measured", "displacement"), "is missing", remedy="give the motion beside the force"))
    if across is not None and across in pair.given and pair.given[across] != (None,) and across not in motion:
        raise InputError(
            Fault(
                ("measured", "normal_displacement"), "is missing",
                remedy=f"contact '{pair.name}' has a normal direction: give the approach beside the sliding",
            )
        )  # fmt: skip
    over = "tau" if "tau" in force.dims else "time" if "time" in force.dims else str(force.dims[-1])
    lead = tuple(dim for dim in force.dims if dim != over)
    tau, slides = _tau(data, over, force.sizes[over]), bool(np.any(pair.rubbing.speed(1.0) != 0.0))
    one = force.transpose(*lead, over)
    omega = _frequencies(data, lead, one) if "omega" in data.variables else None
    if omega is None:
        if slides:
            raise InputError(
                Fault(
                    ("measured", "omega"), "is missing",
                    remedy="the opposing surface moves: give the frequency of each loop",
                )
            )  # fmt: skip
        omega = np.ones(int(np.prod([force.sizes[dim] for dim in lead], dtype=int)))
    H = _series(problem, tau)

    def coefficients(variable: Any) -> Array:
        samples = variable.broadcast_like(one).transpose(*lead, over).values.astype(float).reshape(omega.size, -1)
        return np.array([_fitted_series(H, row, str(variable.name)) for row in samples])

    values = coefficients(force)
    if not slides:
        values[:, 0] = np.nan  # depends on the zero of the force sensor, and friction at rest has no unique mean
    noise = None
    if "noise" in data:
        samples = data["noise"].broadcast_like(one).transpose(*lead, over).values.astype(float)
        mean = np.sqrt(np.mean(samples.reshape(omega.size, -1) ** 2, axis=1, keepdims=True))
        noise = np.broadcast_to(mean * np.sqrt(2.0 / tau.size), values.shape)
    return Loops(
        contact=pair.name, omega=omega, conditions=_conditions(problem, data, lead, one),
        motion={port: coefficients(v) for port, v in motion.items()}, values=values, noise=noise,
    )  # fmt: skip


def _contact(problem: Problem, data: xarray.Dataset) -> Any:
    known = [pair.name for pair in problem.contacts]
    name = str(data["contact"].values) if "contact" in data.variables else str(data.attrs.get("contact", ""))
    if not name and len(known) == 1:
        name = known[0]
    for pair in problem.contacts:
        if pair.name == name and len(pair) == 1:
            return pair
    if name in known:
        raise InputError(Fault(("measured", "contact"), f"'{name}' is many contacts", expected="a single one"))
    said = f"there is no contact {shown(name)}" if name else "is missing"
    raise InputError(Fault(("measured", "contact"), said, remedy=suggestion(name, known)))


def _tau(data: xarray.Dataset, over: str, count: int) -> Array:
    """Times of the samples, rad; equally spaced over one period by default."""
    if "tau" in data.variables:
        return numbers(("measured", "tau"), data["tau"].values)
    if over in data.coords:
        time = numbers(("measured", over), data[over].values)
        step = np.diff(time)
        if time.size > 1 and np.all(np.abs(step - step.mean()) <= 1e-6 * abs(step.mean())):
            return _equal(count)
        raise InputError(
            Fault(
                ("measured", over), "times that are not equally spaced",
                remedy='give "tau", the angle in the period, rad',
            )
        )  # fmt: skip
    return _equal(count)


def _equal(count: int) -> Array:
    return np.asarray(np.arange(count) * (2.0 * np.pi / count), dtype=float)


def _fitted_series(H: Array, samples: Array, name: str) -> Array:
    """Coefficients (L,) of samples (n,) by least squares; those that are nan are left out.

    Raises
    ------
    InputError
        Where too few are left to tell them.
    """
    there = np.isfinite(samples)
    if there.all():
        return np.asarray(np.linalg.lstsq(H, samples, rcond=None)[0])
    if np.linalg.matrix_rank(H[there]) < H.shape[1]:
        raise InputError(
            Fault(
                ("measured", name), f"{int(there.sum())} samples that are not nan",
                expected=f"at least {H.shape[1]} different ones over the period, for the harmonics of the problem",
            )
        )  # fmt: skip
    return np.asarray(np.linalg.lstsq(H[there], samples[there], rcond=None)[0])


def _series(problem: Problem, tau: Array) -> Array:
    """Matrix (n_samples, L) from coefficients to samples."""
    H = np.asarray(problem.harmonics.H_minus(tau))
    if tau.size < H.shape[1] or np.linalg.matrix_rank(H) < H.shape[1]:
        raise InputError(
            Fault(
                ("measured", "tau"), f"{tau.size} samples",
                expected=f"at least {H.shape[1]} different ones over the period, for the harmonics of the problem",
            )
        )  # fmt: skip
    return H


def _of_functions(problem: Problem, measured: Any, columns: object, quantity: str | None) -> xarray.Dataset:
    """Frequency response functions as the motion by the force of the problem, complex, in its units."""
    import xarray

    dof, order, force = single_force(problem)
    functions, where = read_functions(measured, quantity, columns, dof)
    if not functions:
        raise InputError(Fault(where, "holds no frequency response functions"))
    known, checks = problem.structure.dofs, Gathering()
    for name in dict.fromkeys(name for function in functions for name in (function.output, function.point)):
        if name not in known:
            found = f"there is no dof {shown(name)}; the functions are {_pairs(functions)}"
            remedy = f'say which are which: columns = {{ "{known[0]}" = "{functions[0].output}/{functions[0].point}" }}'
            checks.faults.append(Fault((where,), found, remedy=remedy))
            break
    checks.end()
    kept = [function for function in functions if function.point == dof]
    if not kept:
        expected = f"functions by a force on {dof}, where the load is"
        raise InputError(Fault(where, found=_pairs(functions), expected=expected))
    factors = [
        checks.inside((where,), unit_factor, f"{one.output}/{one.point}", one.unit, problem.units) if one.unit else 1.0
        for one in kept
    ]
    checks.end()
    in_units_of = [one._replace(values=one.values * (f or 1.0), unit="") for one, f in zip(kept, factors, strict=True)]
    table = receptances(in_units_of, where)
    notes = []
    if len(kept) < len(functions):
        others = enumerated(sorted({function.point for function in functions} - {dof}))
        notes = [f"response functions by forces on {others} are left out: the load is on {dof}"]
    z = force * table.values
    return xarray.Dataset(
        {"displacement": (("point", "dof", "harmonic"), z[..., None]), "omega": ("point", table.omega / order)},
        coords={"dof": [table.dofs[k] for k in table.rows], "harmonic": [order]}, attrs={"notes": "; ".join(notes)},
    )  # fmt: skip


def _pairs(functions: Sequence[Function]) -> str:
    return enumerated([f"{function.output}/{function.point}" for function in functions])


def _integrated(problem: Problem, measured: Measured, quantity: str) -> Measured:
    """Displacements, if velocities or accelerations of a steady vibration were measured."""
    order = QUANTITIES[quantity]
    if not order:
        return measured
    orders = np.array(problem.harmonics.orders[1:], dtype=float)
    found = measured.integrated(orders, order) if isinstance(measured, Vibration) else None
    if found is None:
        expected = "displacements, unless it is a vibration at given frequencies"
        raise InputError(Fault("quantity", found=f'"{quantity}"', expected=expected))
    assert isinstance(measured, Vibration)
    notes = measured.notes
    if measured.of_amplitude:
        words = "velocities over omega" if order == 1 else "accelerations over omega^2"
        notes = (*notes, f"amplitudes are those of {words}: that is right for harmonic 1 alone; give coefficients if "
                         "there are others")  # fmt: skip
    noise = measured.noise
    if noise is not None:
        of_harmonic = np.array([np.inf, *np.repeat(orders, 2)]) if not measured.of_amplitude else np.ones(1)
        omega = measured.omega.reshape(-1, *(1,) * (noise.ndim - 1))
        noise = noise / (of_harmonic * omega) ** order
        noise = np.where(noise > 0.0, noise, np.nan)
    return replace(found, noise=noise, notes=notes)


def _of_columns(problem: Problem, file: Path, found: Columns, quantity: str | None = None) -> xarray.Dataset:
    """Dataset from the columns described in ``identify``."""
    import xarray

    require_quantity(file, found, quantity)
    column, head = in_units(file, found, problem.units), found.names
    if "frequency" in column:
        column["omega"] = 2.0 * np.pi * column.pop("frequency")
    if "peak_frequency" in column:
        column["peak_omega"] = 2.0 * np.pi * column.pop("peak_frequency")
    if "force" in column and "time" not in column:
        return _loops_of(column)
    if "time" in column or "peak_omega" in column or "modal_amplitude" in column:
        return _along(column, problem)
    for name, values in column.items():
        if np.iscomplexobj(values) and name not in problem.structure.dofs:
            raise _columns_fault(problem, file, head, "has complex numbers and is no dof, no response function", name)
    point: dict[str, Any] = {}
    amplitudes, coefficients = {}, dict[tuple[str, str], Array]()
    known = _labels(problem)
    for name, values in column.items():
        dof, _, label = name.rpartition(".")
        if name in problem.structure.dofs and np.iscomplexobj(values):
            coefficients |= {(name, "c1"): values.real, (name, "s1"): -values.imag}
        elif name in problem.structure.dofs:
            amplitudes[name] = values
        elif dof in problem.structure.dofs and label in known:
            coefficients[dof, label] = values
        elif name == "omega" or name in FACTORS or "." in name:
            point[name] = ("point", values)
        else:
            raise _columns_fault(problem, file, head, "is no dof, no parameter and no frequency", name)
    if coefficients:
        dofs = list(dict.fromkeys(dof for dof, _ in coefficients))
        labels = [label for label in known if any(label == other for _, other in coefficients)]
        missing = np.full(len(next(iter(column.values()))), np.nan)
        cube = np.array([[coefficients.get((d, label), missing) for label in labels] for d in dofs]).transpose(2, 0, 1)
        variable = {"displacement": (("point", "dof", "coefficient"), cube)}
        return xarray.Dataset({**variable, **point}, coords={"dof": dofs, "coefficient": labels})
    if not amplitudes:
        raise _columns_fault(problem, file, head, "has no column of a dof")
    table = np.array([*amplitudes.values()]).T
    return xarray.Dataset({"amplitude": (("point", "dof"), table), **point}, coords={"dof": list(amplitudes)})


def _columns_fault(problem: Problem, file: Path, head: Sequence[str], statement: str, name: str = "") -> InputError:
    """A fault of the columns of a CSV file, with those it has and those that steady vibration has."""
    dofs = problem.structure.dofs
    x = dofs[0]
    hint = suggestion(name, ["omega", "frequency", *dofs]) if name else ""
    return InputError(
        Fault(
            (str(file), name) if name else str(file), f"{statement}; the columns are {enumerated(head)}",
            expected=f"omega (rad/s) or frequency (Hz), and dofs such as {x}, or {x}.c1 and {x}.s1",
            remedy=hint if hint.startswith("did you") else
            f'say which are which: columns = {{ frequency = "f", "{x}" = "Disp" }}; dofs are {enumerated(dofs)}',
        )
    )  # fmt: skip


def _along(column: Mapping[str, AnyArray], problem: Problem) -> xarray.Dataset:
    """Dataset of a time series, or of the points of a backbone, in rows."""
    import xarray

    if "time" not in column:
        return xarray.Dataset({name: ("point", values) for name, values in column.items()})
    data: dict[str, Any] = {}
    dofs = [name for name in column if name in problem.structure.dofs]
    for name, values in column.items():
        if name in ("force", "displacement", "normal_displacement"):
            data[name] = ("time", values)
        elif name not in ("time", *dofs):
            if np.ptp(values):
                raise InputError(Fault(name, "changes during the series", expected="the same in every line"))
            data[name] = float(values[0])
    if dofs:
        data["displacement"] = (("time", "dof"), np.column_stack([column[name] for name in dofs]))
        return xarray.Dataset(data, coords={"time": column["time"], "dof": dofs})
    return xarray.Dataset(data, coords={"time": column["time"]})


def _loops_of(column: Mapping[str, AnyArray]) -> xarray.Dataset:
    """Dataset of loops with equal numbers of samples, in rows."""
    import xarray

    loop = column.get("loop", np.zeros(len(column["force"])))
    numbers_of = list(dict.fromkeys(loop.tolist()))
    counts = {int(np.sum(loop == k)) for k in numbers_of}
    if len(counts) > 1:
        raise InputError(Fault("loop", f"{sorted(counts)} samples", expected="as many in each loop"))
    over = {name: np.array([v[loop == k] for k in numbers_of]) for name, v in column.items() if name != "loop"}
    sampled = ("force", "displacement", "normal_displacement")
    data: dict[str, Any] = {name: (("loop", "sample"), over[name]) for name in sampled if name in over}
    if "tau" in over:
        data["tau"] = ("sample", over["tau"][0])
    data |= {name: ("loop", v[:, 0]) for name, v in over.items() if name not in (*sampled, "tau")}
    return xarray.Dataset(data)


def parameter_starts(problem: Problem, start: Any) -> dict[str, float]:
    """Start values by name of parameter; those of the problem for names without a value."""
    if isinstance(start, Mapping):
        given = {str(name): value for name, value in start.items()}
    else:
        chosen = names("parameters", start, 'start values by name such as {"damper.mu": 0.3}')
        given = {name: problem.parameter(name) for name in dict.fromkeys(chosen)}
    if not given:
        raise wrong("parameters", start, 'start values by name such as {"damper.mu": 0.3}')
    checks, values = Gathering(), {}
    for name, value in given.items():
        moved = checks.take(problem.at_parameter, name, value)
        if moved is not None:
            values[name] = moved.parameter(name)
    checks.end("parameters")
    return values
