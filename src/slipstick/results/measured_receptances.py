"""Measured frequency response functions: universal files, tables, arrays and datasets, read as receptances."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from slipstick.errors import Fault, InputError, first_line
from slipstick.faults import (
    MEASURED,
    enumerated,
    no_measured_numbers,
    numbers,
    path,
    shown,
    suggestion,
    table,
    text,
    wrong,
)
from slipstick.results.measured_columns import in_units, length_and_force, of_gravity, quantity_fault, read_columns
from slipstick.results.response_functions import DIRECTIONS, FRF, NAMED
from slipstick.results.table import foreign_dataset, is_dataset
from slipstick.structure.measured import Receptances
from slipstick.typing import Array, ComplexArray
from slipstick.units import is_rotation

QUANTITIES = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""Measured quantities, by the number of time derivatives of the displacement."""
_NAMES = {"receptance": "displacement", "mobility": "velocity", "accelerance": "acceleration"}
"""Names of the functions in arrays and datasets."""
_ORDINATES = {8: "displacement", 11: "velocity", 12: "acceleration"}
_EXPECTED = (
    "an xarray.Dataset with omega and complex receptance(omega, output, input), or the path of a universal file "
    "(.unv, .uff), a .csv, .mat, .npz or .nc file"
)
UNIVERSAL = (".unv", ".uff", ".bunv")
_TABLES = (".csv", ".mat")
_OWN_NAMES = re.compile(rf"{NAMED}(.+)/(.+)")


class Function(NamedTuple):
    """A frequency response function: the motion of a dof by a force on another one.

    Attributes
    ----------
    output, point
        Dof that moves, dof that is forced.
    omega, values
        Frequencies (n,), rad/s, and complex values (n,) of the time dependence ``exp(+i w t)``.
    what
        What moves: "displacement", "velocity" or "acceleration".
    unit
        Such as "m/N"; empty where it is not known.
    """

    output: str
    point: str
    omega: Array
    values: ComplexArray
    what: str
    unit: str = ""


def read_receptances(measured: Any, quantity: str | None = None, columns: object = None) -> Receptances:
    """Displacement over force, however it was measured, at frequencies that increase."""
    functions, where = read_functions(measured, quantity, columns)
    table = receptances(functions, where)
    if np.any(np.diff(table.omega) <= 0.0):
        raise InputError(Fault((where, "omega"), "frequencies that do not increase"))
    return table


def read_functions(
    measured: Any, quantity: str | None = None, columns: object = None, force: str = ""
) -> tuple[list[Function], str]:
    """Functions of a file or dataset, and where they are from; ``force`` is the dof of those that name none.

    Raises
    ------
    InputError
        For what cannot be read, and functions in the unit of another quantity than is said.
    """
    found, where = _found(measured, quantity, columns, force)
    for function in found:
        if fault := quantity_fault(f"{function.output}/{function.point}", function.unit, function.what):
            raise InputError(fault.inside(where))
    return found, where


def _found(measured: Any, quantity: str | None, columns: object, force: str) -> tuple[list[Function], str]:
    checked_quantity(quantity)
    is_path = isinstance(measured, str | Path)
    if columns is not None and not (is_path and Path(measured).suffix.lower() in (*_TABLES, *UNIVERSAL)):
        raise columns_fault()
    if is_path:
        file = path("measured", measured)
        if not file.is_file():
            raise InputError(Fault("measured", f"there is no file {file}"))
        ending = file.suffix.lower()
        if ending in UNIVERSAL:
            return list(_called(_universal(file, quantity), file, columns, force)), str(file)
        if ending in _TABLES:
            return list(_in_columns(file, quantity, columns, force)), str(file)
        measured = _arrays(file)
    if not is_dataset(measured):
        raise wrong("measured", measured, _EXPECTED)
    return list(_of_dataset(measured, quantity)), "measured"


def checked_quantity(quantity: object) -> None:
    """Raises InputError for what is no quantity."""
    if quantity is not None and not (isinstance(quantity, str) and quantity in QUANTITIES):
        raise wrong("quantity", quantity, ", ".join(map(repr, QUANTITIES)))


def columns_fault() -> InputError:
    """The exception for ``columns`` beside what has no columns."""
    return InputError(Fault("columns", "are those of a .csv, .mat, .unv or .uff file", remedy="leave them out"))


def has_functions(data: Any) -> bool:
    """Whether a dataset holds frequency response functions."""
    return any(name in data for name in _NAMES)


def _of_dataset(data: Any, quantity: str | None) -> Iterator[Function]:
    name = next((name for name in _NAMES if name in data), None)
    if name is None or "omega" not in data.variables:
        raise wrong("measured", sorted(map(str, data.variables)), _EXPECTED)
    table = data[name]
    for dim in ("output", "input"):
        if dim not in table.dims:
            table = table.expand_dims({dim: [str(table[dim].values)]} if dim in table.coords else dim)
        if dim not in table.coords:
            raise InputError(Fault(("measured", dim), "has no names", expected="the dofs along it"))
    over = [dim for dim in table.dims if dim not in ("output", "input")]
    if len(over) != 1:
        raise InputError(
            Fault(("measured", name), f"dimensions {tuple(map(str, table.dims))}", expected="one of frequency")
        )
    values = np.asarray(table.transpose(over[0], "output", "input").values, dtype=complex)
    omega = np.asarray(data["omega"].values, dtype=float)
    if str(data["omega"].attrs.get("units", "")) == "Hz":
        omega = 2.0 * np.pi * omega
    outputs, inputs = ([str(x) for x in table[dim].values] for dim in ("output", "input"))

    unit = str(table.attrs.get("units", ""))
    for o, output in enumerate(outputs):
        for i, point in enumerate(inputs):
            if np.isfinite(values[:, o, i]).any():
                yield Function(output, point, omega, values[:, o, i], quantity or _NAMES[name], unit)


def receptances(found: Sequence[Function], where: str) -> Receptances:
    """All functions at the same frequencies, as displacement over force; lines with a nan in any are left out."""
    if not found:
        raise InputError(Fault(where, "holds no frequency response functions"))
    straight = [one.unit for one in found if one.unit and not (is_rotation(one.output) or is_rotation(one.point))]
    if any(map(of_gravity, straight)):
        remedy = "export them in lengths, such as m/s^2"
        raise InputError(Fault(where, "accelerations in g, which is no unit of a structure", remedy=remedy))
    if len({length_and_force(unit) for unit in straight}) > 1:
        units = enumerated(sorted(set(straight)))
        raise InputError(Fault(where, f"functions in several units, {units}", remedy="export them in one"))
    omega, dofs = found[0].omega, dict[str, int]()
    for function in found:
        dofs.setdefault(function.point, len(dofs))
    rows, columns, values = [], [], []
    for function in found:
        at, output, point = function.omega, function.output, function.point
        if at.shape != omega.shape or np.any(np.abs(at - omega) > 1e-6 * np.abs(omega).max()):
            raise InputError(Fault((where, f"{output}/{point}"), "has other frequencies than the first function"))
        if places := no_measured_numbers(function.values):
            found_there = f"{function.values[places[0]]:g} at omega = {at[places[0]]:.6g}"
            raise InputError(Fault((where, f"{output}/{point}"), found=found_there, expected=MEASURED))
        rows.append(dofs.setdefault(output, len(dofs)))
        columns.append(dofs[point])
        values.append(function.values / (1j * np.where(omega > 0.0, omega, 1.0)) ** QUANTITIES[function.what])
    if len(set(zip(rows, columns, strict=True))) < len(rows):
        raise InputError(Fault(where, "holds a function twice", remedy="keep one of each pair of points"))
    used = (omega > 0.0) & np.all(np.isfinite(values), axis=0)
    return Receptances(
        dofs=tuple(dofs), omega=omega[used], values=np.array(values).T[used], rows=np.array(rows),
        columns=np.array(columns),
    )  # fmt: skip


def _arrays(file: Path) -> Any:
    """The dataset of an .npz or .nc file."""
    import xarray

    if file.suffix.lower() == ".nc":
        return foreign_dataset(file)
    if file.suffix.lower() != ".npz":
        raise wrong("measured", str(file), _EXPECTED)
    try:
        with np.load(file, allow_pickle=False) as held:
            arrays: Mapping[str, Any] = dict(held)
    except (OSError, ValueError) as error:
        raise InputError(Fault(str(file), "cannot be read", remedy=first_line(error))) from None
    name = next((name for name in _NAMES if name in arrays), None)
    over = "omega" if "omega" in arrays else "frequency"
    missing = [n for n, there in (("receptance", name), (over, over in arrays)) if not there]
    missing += [n for n in ("outputs", "inputs") if n not in arrays]
    if missing:
        raise InputError(Fault(str(file), f"{missing[0]!r} is missing", remedy=f"it holds {sorted(arrays)}"))
    assert name is not None
    size = arrays[over].size, arrays["outputs"].size, arrays["inputs"].size
    if arrays[name].shape != size:
        raise InputError(Fault((str(file), name), f"shape {arrays[name].shape}", expected=str(size)))
    omega = arrays[over] * (1.0 if over == "omega" else 2.0 * np.pi)
    return xarray.Dataset(
        {name: (("omega", "output", "input"), arrays[name])},
        coords={"omega": omega, "output": arrays["outputs"].astype(str), "input": arrays["inputs"].astype(str)},
    )


def _in_columns(file: Path, quantity: str | None, columns: object, force: str) -> Iterator[Function]:
    found = read_columns(file, columns)
    column, head = in_units(file, found, None), found.names
    for name, values in column.items():
        if not np.isfinite(values).all():
            remedy = "leave these lines out"
            raise InputError(Fault((str(file), name), "has cells that are no finite numbers", remedy=remedy))
    if "frequency" in column:
        column["omega"] = 2.0 * np.pi * column.pop("frequency")
    if "omega" not in column:
        said, expected = f"has the columns {enumerated(head)}", "omega (rad/s) or frequency (Hz) among them"
        raise InputError(Fault(str(file), said, expected=expected, remedy=_choose(columns)))
    omega = numbers((str(file), "omega"), column.pop("omega"))
    for name, values in column.items():
        pair, _, part = name.rpartition(".")
        both = np.iscomplexobj(values)
        if part == "im" and f"{pair}.re" in column and not both:
            continue
        pair = name if both else pair
        output, _, point = pair.partition("/")
        point = point or force
        if not (point and (both or (part == "re" and f"{pair}.im" in column))):
            said = f"is not understood; the columns are {enumerated(head)}"
            expected = "two columns a function such as tip/root.re and tip/root.im"
            expected += ", or one of complex numbers, tip/root" if file.suffix.lower() == ".mat" else ""
            raise InputError(Fault((str(file), name), said, expected=expected, remedy=_choose(columns)))
        complete = values if both else values + 1j * column[f"{pair}.im"]
        units = {found.units[part] for part in ([name] if both else [f"{pair}.re", f"{pair}.im"])} - {""}
        if len(units) > 1:
            said = f"functions in several units, {enumerated(sorted(units))}"
            raise InputError(Fault(str(file), said, remedy="export them in one"))
        yield Function(output, point, omega, complete, quantity or "displacement", "".join(units))


def _choose(columns: object) -> str:
    example = 'columns = { frequency = "f", "tip/root.re" = "Re H21", ... }'
    return f"say which are which: {example}" if columns is None else ""


def _called(found: Iterator[Function], file: Path, columns: object, force: str) -> Iterator[Function]:
    """Functions by what they are, ``{"tip/root": "n12x/n1x"}``; without ``columns`` all, as the file calls them."""
    if columns is None:
        yield from found
        return
    expected = 'names of functions by what they are, such as {"tip/root": "n12x/n1x"}'
    known, faults = {f"{function.output}/{function.point}": function for function in found}, []
    for key, given in table("columns", columns, expected).items():
        name = text(("columns", key), given, expected)
        output, _, point = key.partition("/")
        if name not in known:
            hint = suggestion(name, known)
            remedy = hint if hint.startswith("did you") else ""
            said = f"there is no function {name!r} in {file.name}; the functions are {enumerated(list(known))}"
            faults.append(Fault(("columns", key), said, remedy=remedy))
        elif not (point or force):
            faults.append(Fault(("columns", key), "does not name the force", expected="two dofs such as tip/root"))
        else:
            yield known[name]._replace(output=output, point=point or force)
    if faults:
        raise InputError(faults)


def _universal(file: Path, quantity: str | None) -> Iterator[Function]:
    """Data sets 58 of a universal file."""
    try:
        import pyuff
    except ImportError:
        raise InputError(
            Fault(str(file), "is a universal file, which pyuff reads", remedy="pip install 'slipstick[test-rig]'")
        ) from None
    try:
        universal = pyuff.UFF(str(file))
        sets = [universal.read_sets(int(k)) for k in np.flatnonzero(np.asarray(universal.get_set_types()) == 58)]
    except Exception as error:  # whatever a file that is none leads to
        raise InputError(Fault(str(file), "cannot be read as a universal file", remedy=first_line(error))) from None
    for k, held in enumerate(sets, 1):
        if int(held.get("func_type", 0)) != FRF:
            continue
        sign, names = 1.0, []
        for node, direction in (("rsp_node", "rsp_dir"), ("ref_node", "ref_dir")):
            code = int(held[direction])
            sign *= -1.0 if code < 0 else 1.0
            names.append(f"n{int(held[node])}{DIRECTIONS.get(abs(code), '')}")
        if own := _OWN_NAMES.fullmatch(str(held.get("id2", "")).strip()):
            names = [own[1], own[2]]
        what = quantity or _ORDINATES.get(int(held.get("ordinate_spec_data_type", 0)))
        if what is None:
            said = shown(held.get("ordinate_spec_data_type"))
            remedy = 'say quantity="acceleration" or what else was measured'
            raise InputError(
                Fault((str(file), f"function {k}"), f"does not say what moves (type {said})", remedy=remedy)
            )
        values: ComplexArray = np.asarray(sign * np.asarray(held["data"]), dtype=complex)
        omega = 2.0 * np.pi * np.asarray(held["x"], dtype=float)
        yield Function(names[0], names[1], omega, values, what, _unit(held))


def _unit(held: Mapping[str, Any]) -> str:
    """The unit of a data set 58, where it names both parts."""
    labels = [str(held.get(f"{part}_axis_units_lab", "")).strip() for part in ("ordinate", "orddenom")]
    over, under = ("" if label.upper() in ("NONE", "") else label for label in labels)
    return over if "/" in over and under and over.endswith(f"/{under}") else f"{over}/{under}" if over and under else ""
