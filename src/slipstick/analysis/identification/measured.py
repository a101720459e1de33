"""What was measured, as arrays: steady vibration at some frequencies and levels, or hysteresis loops of a contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.parameters import FACTORS
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, names, numbers, path, shown, suggestion, wrong
from slipstick.results.foreign import foreign_dataset
from slipstick.typing import Array, IntArray

if TYPE_CHECKING:
    import xarray

FREQUENCY_UNITS = {"Hz": 2.0 * np.pi, "rpm": 2.0 * np.pi / 60.0}
"""Units of a measured frequency other than rad/s."""

_EXPECTED = (
    "an xarray.Dataset with omega and displacement(omega, dof, coefficient) or amplitude(omega, dof), or with "
    "displacement and force over the tau of loops, or the path of a .nc or .csv file with these"
)


@dataclass(frozen=True, kw_only=True)
class Vibration:
    """Steady vibration at n points."""

    omega: Array
    """Fundamental frequencies (n,), rad/s."""
    conditions: Mapping[str, Array]
    """Named parameters that were set at each point, (n,) each."""
    dofs: tuple[str, ...]
    values: Array
    """Coefficients (n, n_dofs, L), or amplitudes (n, n_dofs); nan where nothing was measured."""
    noise: Array | None
    """Standard deviations, of the shape of ``values``."""

    @property
    def of_amplitude(self) -> bool:
        """Whether amplitudes alone were measured."""
        return self.values.ndim == 2

    @property
    def groups(self) -> list[IntArray]:
        """Numbers of the points at which the same conditions were set."""
        rows = np.array([*self.conditions.values()]).T.reshape(self.omega.size, -1)
        which = np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
        return [np.flatnonzero(which == g) for g in range(int(which.max()) + 1)]


@dataclass(frozen=True, kw_only=True)
class Loops:
    """Hysteresis loops of one contact: n of them."""

    contact: str
    omega: Array
    """Fundamental frequencies (n,), rad/s."""
    conditions: Mapping[str, Array]
    motion: Mapping[str, Array]
    """Coefficients of the relative motion (n, L) by port."""
    values: Array
    """Coefficients (n, L) of the force along the first port; nan of a mean that nothing is to be made of."""
    noise: Array | None


Measured = Vibration | Loops


def read_measured(problem: Problem, measured: Any) -> Measured:
    """Measurements of a problem as a user gives them; InputError says what does not fit it."""
    if isinstance(measured, str | Path):
        measured = read_file(problem, path("measured", measured))
    if not hasattr(measured, "data_vars"):
        raise wrong("measured", measured, _EXPECTED)
    if "force" in measured:
        return _loops(problem, measured)
    if "displacement" in measured or "amplitude" in measured:
        return _vibration(problem, measured)
    raise wrong("measured", sorted(map(str, measured.variables)), _EXPECTED)


def _vibration(problem: Problem, data: xarray.Dataset) -> Vibration:
    name = "displacement" if "displacement" in data else "amplitude"
    values = data[name]
    if np.iscomplexobj(values.values):
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
    noise = None
    if "noise" in data:
        spread = data["noise"].broadcast_like(values).transpose(*values.dims).values.astype(float)
        noise = _standing(spread, omega.size, len(last), places, problem.harmonics.size)
    if not np.any(np.isfinite(array)):
        raise InputError(Fault(("measured", name), "holds no numbers"))
    return Vibration(omega=omega, conditions=conditions, dofs=dofs, values=array, noise=noise)


def _standing(values: Array, n: int, last: int, places: list[int] | None, L: int) -> Array:
    flat = values.reshape(n, *values.shape[values.ndim - last :])
    if places is None:
        return flat
    out = np.full((*flat.shape[:2], L), np.nan)
    out[..., places] = flat
    return out


def _by_coefficients(values: xarray.DataArray) -> xarray.DataArray:
    """Complex numbers ``z`` of ``Re(z e^{i m tau})`` as coefficients ``c = Re z``, ``s = -Im z``.

    Without a dimension ``harmonic`` they are of harmonic 1.
    """
    import xarray

    if "harmonic" not in values.dims:
        values = values.expand_dims(harmonic=[int(values["harmonic"]) if "harmonic" in values.coords else 1])
    parts = []
    for m in values["harmonic"].values.astype(int):
        z = values.sel(harmonic=m, drop=True)
        parts += [(f"c{m}", z.real), (f"s{m}", -z.imag)] if m else [("0", z.real)]
    labels = [label for label, _ in parts]
    return xarray.concat([part for _, part in parts], dim="coefficient").assign_coords(coefficient=labels)


def _frequencies(data: xarray.Dataset, lead: Sequence[Any], values: xarray.DataArray) -> Array:
    if "omega" not in data.variables:
        raise InputError(Fault(("measured", "omega"), "is missing", remedy="give the frequencies, rad/s"))
    omega = data["omega"]
    factor = FREQUENCY_UNITS.get(str(omega.attrs.get("units", "")), 1.0)
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
    """Variables that are called as a parameter of the problem; those of a branch over a parameter with its name."""
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
    """Where coefficients stand among those of the problem."""
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
        checked = numbers(("measured", str(variable.name)), samples)
        return np.asarray(np.linalg.lstsq(H, checked.T, rcond=None)[0].T)

    values = coefficients(force)
    if not slides:
        values[:, 0] = np.nan  # of a force sensor's zero, and of friction at rest, which has no one mean
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
    """Times of the samples, rad; equally spaced over one period where nothing is said."""
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


def _series(problem: Problem, tau: Array) -> Array:
    """What makes samples of coefficients, (n_samples, L)."""
    H = np.asarray(problem.harmonics.H_minus(tau))
    if tau.size < H.shape[1] or np.linalg.matrix_rank(H) < H.shape[1]:
        raise InputError(
            Fault(
                ("measured", "tau"), f"{tau.size} samples",
                expected=f"at least {H.shape[1]} different ones over the period, for the harmonics of the problem",
            )
        )  # fmt: skip
    return H


def read_file(problem: Problem, file: Path) -> xarray.Dataset:
    """A netCDF file as it is; a CSV file with the columns that are said in ``identify``."""
    if not file.is_file():
        raise InputError(Fault("measured", f"there is no file {file}"))
    if file.suffix == ".nc":
        return foreign_dataset(file)
    return _from_csv(problem, file)


def _from_csv(problem: Problem, file: Path) -> xarray.Dataset:
    import xarray

    try:
        lines = [line for line in file.read_text(encoding="utf-8-sig").splitlines() if line.strip() and line[0] != "#"]
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(Fault(str(file), "cannot be read as text", remedy=str(error))) from None
    split = ";" if lines and ";" in lines[0] else ","
    head = [word.strip().strip('"') for word in lines[0].split(split)] if lines else []
    rows = []
    for number, line in enumerate(lines[1:], 2):
        cells = line.split(split)
        try:
            rows.append([float(cell) if cell.strip() else np.nan for cell in cells])
        except ValueError as error:
            raise InputError(Fault((str(file), f"line {number}"), str(error), expected="numbers")) from None
        if len(cells) != len(head):
            raise InputError(Fault((str(file), f"line {number}"), f"{len(cells)} cells", expected=str(len(head))))
    if not rows:
        raise InputError(Fault(str(file), "holds no rows of numbers", expected="a line of names, then numbers"))
    column = dict(zip(head, np.array(rows).T, strict=True))
    if "frequency" in column:
        column["omega"] = 2.0 * np.pi * column.pop("frequency")
    if "force" in column:
        return _loops_of(column)
    point: dict[str, Any] = {}
    amplitudes, coefficients = {}, {}
    known = _labels(problem)
    for name, values in column.items():
        dof, _, label = name.rpartition(".")
        if name in problem.structure.dofs:
            amplitudes[name] = values
        elif dof in problem.structure.dofs and label in known:
            coefficients[dof, label] = values
        elif name == "omega" or name in FACTORS or "." in name:
            point[name] = ("point", values)
        else:
            raise InputError(
                Fault((str(file), name), "is no dof and no parameter", remedy=suggestion(name, problem.structure.dofs))
            )
    if coefficients:
        dofs = list(dict.fromkeys(dof for dof, _ in coefficients))
        labels = [label for label in known if any(label == other for _, other in coefficients)]
        missing = np.full(len(rows), np.nan)
        cube = np.array([[coefficients.get((d, label), missing) for label in labels] for d in dofs]).transpose(2, 0, 1)
        variable = {"displacement": (("point", "dof", "coefficient"), cube)}
        return xarray.Dataset({**variable, **point}, coords={"dof": dofs, "coefficient": labels})
    if not amplitudes:
        raise InputError(Fault(str(file), "has no column of a dof", remedy=suggestion("", problem.structure.dofs)))
    table = np.array([*amplitudes.values()]).T
    return xarray.Dataset({"amplitude": (("point", "dof"), table), **point}, coords={"dof": list(amplitudes)})


def _loops_of(column: Mapping[str, Array]) -> xarray.Dataset:
    """Loops one below the other, of as many samples each."""
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
    """Values to begin at by the names of the parameters; of names alone those of the problem."""
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
