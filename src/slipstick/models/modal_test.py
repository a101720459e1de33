"""Measured frequency response functions, of universal files, tables and arrays: as they are, or the modes that fit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, enumerated, frequency, number, numbers, one, path, shown, warn, whole, wrong
from slipstick.results.measured_columns import in_units, read_columns
from slipstick.results.table import foreign_dataset, is_dataset
from slipstick.structure.measured import Receptances, checked, reciprocal
from slipstick.structure.modal_fit import TIME_LIMIT, ModalFit, fit_modes
from slipstick.structure.tabulated import FEWEST, Beyond, TabulatedStructure, full_table, noise_share, smoothed
from slipstick.typing import Array, ComplexArray, FrequencyRange

QUANTITIES = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""Measured quantities, by the number of time derivatives of the displacement."""
_NAMES = {"receptance": "displacement", "mobility": "velocity", "accelerance": "acceleration"}
"""Names of the functions in arrays and datasets."""
_ORDINATES = {8: "displacement", 11: "velocity", 12: "acceleration"}
_DIRECTIONS = {1: "x", 2: "y", 3: "z", 4: "rx", 5: "ry", 6: "rz"}
_EXPECTED = (
    "an xarray.Dataset with omega and complex receptance(omega, output, input), or the path of a universal file "
    "(.unv, .uff), a .csv, .npz or .nc file"
)
UNIVERSAL = (".unv", ".uff", ".bunv")
_FRF = 4
"""A frequency response function, in data set 58."""


def modal_analysis(
    measured: Any,
    *,
    modes: int | None = None,
    range: FrequencyRange | None = None,
    quantity: str | None = None,
    columns: Mapping[str, str] | None = None,
    time_limit: float = TIME_LIMIT,
) -> ModalFit:
    """A structure from measured frequency response functions: real modes are fitted to them.

    Poles that many orders of a common denominator agree on are the start (least-squares complex frequency method).
    Modes are those of greatest likelihood, with the noise that the table shows itself: a floor, and a share of what is
    measured. Modes that do not stand out of it are left out.

    Parameters
    ----------
    measured
        An ``xarray.Dataset`` with ``omega`` (rad/s, or with the attribute ``units`` "Hz") and complex
        ``receptance(omega, output, input)``, displacement over force; or ``mobility``, ``accelerance``. ``output`` and
        ``input`` hold names of dofs; nan is what was not measured. Or the path of a file:

        - ``.unv``, ``.uff``: frequency response functions of data set 58, read by pyuff; node 12 in direction X is the
          dof "n12x", and what was measured along -X has its sign turned;
        - ``.npz``: arrays ``omega`` or ``frequency`` (Hz), ``receptance`` (n, n_outputs, n_inputs) or one of the
          others, ``outputs``, ``inputs``;
        - ``.csv``: columns ``omega`` or ``frequency``, and for each function two, ``tip/root.re`` and ``tip/root.im``:
          the motion of "tip" by a force on "root";
        - ``.nc``: the dataset.
    modes
        How many modes are kept, the strongest in the range first; by default all that stand out of the noise. Others
        that were seen are taken into account for the fit, and become compliance.
    range
        Frequencies between which they are fitted, rad/s or with a unit, ``("20 Hz", "400 Hz")``; by default all.
    quantity
        "displacement", "velocity" or "acceleration": what was measured, where the file does not say.
    columns
        Of a .csv file with other names: what the columns are, ``{"frequency": "f", "tip/root.re": "Re H21", ...}``;
        these alone are read. Lines before the names, semicolons, decimal commas and units of frequencies are
        understood as in ``identify``; receptances are taken as they stand, all in one unit.
    time_limit
        Seconds after which no further modes are sought; a warning says so.

    Returns
    -------
    ModalFit
        Its ``structure`` is a ``ModalStructure`` at all measured dofs: contacts and loads act on any of them. ``error``
        says how well it fits, ``noise`` what of this is noise; ``omega_error`` and ``damping_error`` are standard
        deviations of the modes; ``summary()`` says it all.

    The time dependence is ``exp(+i w t)``: receptances lag. Reciprocity and passivity are checked: functions measured
    both ways are averaged, and power that comes out of a driving point gives a warning.

    Raises
    ------
    InputError
        For files that cannot be read, without a driving point, where no mode stands out of the noise, where the driving
        points are those of conjugated functions, of accelerance or mobility, or of a sensor the wrong way round.

    Warns
    -----
    SlipstickWarning
        For functions that are not reciprocal or not passive beyond their noise, for what the fit leaves, and for modes
        that are not to be trusted.

    Examples
    --------
    >>> import numpy as np, xarray as xr, slipstick as ss
    >>> omega = np.linspace(2.0, 15.0, 400)
    >>> table = 1.0 / (40.0 + 0.4j * omega - omega**2)
    >>> data = xr.Dataset({"receptance": (("omega", "output", "input"), table[:, None, None])},
    ...                   coords={"omega": omega, "output": ["x"], "input": ["x"]})
    >>> modal_analysis(data).structure.natural_frequencies.round(6).tolist()
    [6.324555]
    """
    checks = Gathering()
    table = checks.take(read_receptances, measured, quantity, columns)
    count = None if modes is None else checks.take(whole, "modes", modes, 1)
    seconds = checks.take(number, "time_limit", time_limit, above=0.0)
    ends = None if range is None else checks.take(_range, range)
    checks.end()
    assert table is not None
    assert seconds is not None
    table = _within(table, ends)
    least = 4 * (2 if count is None else count + 1)
    if table.omega.size < least:
        raise InputError(Fault("receptances", f"{table.omega.size} frequencies", expected=f"at least {least}"))
    found = fit_modes(table, count, time_limit=seconds)
    warn(found.warnings)
    return found


def tabulated_structure(
    measured: Any,
    *,
    static: Any = None,
    beyond: Beyond = "refuse",
    smooth: bool = True,
    range: FrequencyRange | None = None,
    quantity: str | None = None,
    columns: Mapping[str, str] | None = None,
) -> TabulatedStructure:
    """A structure from measured frequency response functions as they are: cubic splines through the lines, no modes.

    Parameters
    ----------
    measured, quantity, columns
        As for ``modal_analysis``.
    static
        Compliance at rest (n_dofs, n_dofs), length/force, which harmonic 0 needs; dofs in the order in which they are
        measured (``structure.dofs``). By default it follows from the lowest lines: up to twice the lowest frequency
        ``(a + b w^2) / (1 + d w^2)`` is fitted.
    beyond
        What is done about frequencies outside the table: "refuse" them, or go on with a "line": above it the mass line
        ``(a + b / w^2) / (1 + d / w^2)`` of its last fifth, from its last value on; below it the line to rest.
    smooth
        Take noise off first, by smoothing splines as far from the table as the noise that its fourth differences show,
        a floor and a share of what is measured (``noise``: root mean square, as a share of the receptance). A table
        without noise stays as it is. Left in it makes small false peaks, and curves with more points.
    range
        Frequencies between which the table is used, rad/s or with a unit, ``("20 Hz", "400 Hz")``; by default all.

    Returns
    -------
    TabulatedStructure
        At all measured dofs. ``error`` is the root mean square, ``worst`` the largest of what a spline through every
        second line is off at the others (relative): an upper bound of the error of interpolation.
        ``static_error``, ``line_error`` and ``summary()`` say the rest.

    Receptances are needed up to the highest harmonic of the highest frequency, between all points that contacts, loads
    and outputs are at; reciprocity fills in what was measured the other way. What asks for motion in time (stability,
    ``transient``, ``check_in_time``) or for modes is refused: a table has no states.

    Raises
    ------
    InputError
        For files that cannot be read, where the lowest lines do not tell the static compliance, and where the driving
        points are those of conjugated functions, of accelerance or mobility, or of a sensor the wrong way round.

    Warns
    -----
    SlipstickWarning
        For functions that are not reciprocal or not passive, for a coarse table, for a static compliance that is
        uncertain, and for lines beyond the table.

    Examples
    --------
    >>> import numpy as np, xarray as xr
    >>> omega = np.linspace(2.0, 50.0, 2000)
    >>> table = 1.0 / (40.0 + 0.4j * omega - omega**2)
    >>> data = xr.Dataset({"receptance": (("omega", "output", "input"), table[:, None, None])},
    ...                   coords={"omega": omega, "output": ["x"], "input": ["x"]})
    >>> structure = tabulated_structure(data)
    >>> structure.error < 1e-4, bool(abs(structure.static[0, 0] * 40.0 - 1.0) < 1e-3)
    (True, True)
    """
    checks = Gathering()
    table = checks.take(read_receptances, measured, quantity, columns)
    ends = None if range is None else checks.take(_range, range)
    checks.take(one, "smooth", smooth, bool, "True or False")
    checks.end()
    assert table is not None
    table = _within(table, ends)
    if table.omega.size < FEWEST:
        raise InputError(Fault("receptances", f"{table.omega.size} frequencies", expected=f"at least {FEWEST}"))
    mean = reciprocal(table)
    checked(mean)
    noise = 0.0
    if smooth:
        values = smoothed(mean.omega, mean.values)
        if not np.array_equal(values, mean.values):
            noise = float(np.median(noise_share(mean.omega, mean.values)))
        mean = replace(mean, values=values)
    whole_table = full_table(mean.values, mean.rows, mean.columns, len(table.dofs))
    found = TabulatedStructure(
        omega=table.omega, real=whole_table.real, imaginary=whole_table.imag, dofs=table.dofs, static=static,
        beyond=beyond, noise=noise, notes=tuple(table.warnings("rad/s")),
    )  # fmt: skip
    warn(found.warnings)
    return found


def _within(table: Receptances, ends: tuple[float, float] | None) -> Receptances:
    if ends is None:
        return table
    inside = (table.omega >= ends[0]) & (table.omega <= ends[1])
    return replace(table, omega=table.omega[inside], values=table.values[inside])


def _range(value: Any) -> tuple[float, float]:
    if not isinstance(value, tuple | list) or len(value) != 2:
        raise wrong("range", value, 'two frequencies such as (10.0, 400.0) or ("20 Hz", "400 Hz")')
    low, high = sorted(frequency("range", end) for end in value)
    return low, high


def read_receptances(measured: Any, quantity: str | None = None, columns: object = None) -> Receptances:
    """Displacement over force, however it was measured."""
    if quantity is not None and not (isinstance(quantity, str) and quantity in QUANTITIES):
        raise wrong("quantity", quantity, ", ".join(map(repr, QUANTITIES)))
    if columns is not None and not (isinstance(measured, str | Path) and Path(measured).suffix.lower() == ".csv"):
        raise InputError(Fault("columns", "are those of a .csv file", remedy="leave them out"))
    if isinstance(measured, str | Path):
        file = path("measured", measured)
        if not file.is_file():
            raise InputError(Fault("measured", f"there is no file {file}"))
        if file.suffix.lower() in UNIVERSAL:
            return _joined(_universal(file, quantity), str(file))
        if file.suffix.lower() == ".csv":
            return _csv(file, quantity, columns)
        measured = _arrays(file)
    if not is_dataset(measured):
        raise wrong("measured", measured, _EXPECTED)
    return _of_dataset(measured, quantity)


def _of_dataset(data: Any, quantity: str | None) -> Receptances:
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

    def functions() -> Iterator[Function]:
        for o, output in enumerate(outputs):
            for i, point in enumerate(inputs):
                if np.isfinite(values[:, o, i]).any():
                    yield output, point, omega, values[:, o, i], quantity or _NAMES[name]

    return _joined(functions(), "measured")


Function = tuple[str, str, Array, ComplexArray, str]
"""Dof that moves, dof that is forced, frequencies, values, what moves."""


def _joined(functions: Iterator[Function], where: str) -> Receptances:
    """All functions at the same frequencies, as displacement over force."""
    found = list(functions)
    if not found:
        raise InputError(Fault(where, "holds no frequency response functions"))
    omega, dofs = found[0][2], dict[str, int]()
    for _, point, *_rest in found:
        dofs.setdefault(point, len(dofs))
    rows, columns, values = [], [], []
    for output, point, at, numbers_there, what in found:
        if at.shape != omega.shape or np.any(np.abs(at - omega) > 1e-6 * np.abs(omega).max()):
            raise InputError(Fault((where, f"{output}/{point}"), "has other frequencies than the first function"))
        rows.append(dofs.setdefault(output, len(dofs)))
        columns.append(dofs[point])
        values.append(numbers_there / (1j * np.where(omega > 0.0, omega, 1.0)) ** QUANTITIES[what])
    if len(set(zip(rows, columns, strict=True))) < len(rows):
        raise InputError(Fault(where, "holds a function twice", remedy="keep one of each pair of points"))
    used = (omega > 0.0) & np.all(np.isfinite(values), axis=0)
    if np.any(np.diff(omega[used]) <= 0.0):
        raise InputError(Fault((where, "omega"), "frequencies that do not increase"))
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
        raise InputError(Fault(str(file), "cannot be read", remedy=str(error).splitlines()[0])) from None
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


def _csv(file: Path, quantity: str | None, columns: object) -> Receptances:
    found = read_columns(file, columns)
    column, head = in_units(file, found, None), found.names
    if gaps := [name for name, values in column.items() if not np.isfinite(values).all()]:
        raise InputError(
            Fault((str(file), gaps[0]), "has cells that are no finite numbers", remedy="leave these lines out")
        )
    units = {found.units[name] for name in column if name not in ("omega", "frequency")}
    if len(units) > 1:
        remedy = "export them in one"
        raise InputError(Fault(str(file), f"functions in several units, {enumerated(sorted(units))}", remedy=remedy))
    if "frequency" in column:
        column["omega"] = 2.0 * np.pi * column.pop("frequency")
    if "omega" not in column:
        raise InputError(
            Fault(
                str(file), f"has the columns {enumerated(head)}", expected="omega (rad/s) or frequency (Hz) among them"
            )
        )
    omega = numbers((str(file), "omega"), column.pop("omega"))

    def functions() -> Iterator[Function]:
        for name in column:
            pair, _, part = name.rpartition(".")
            output, _, point = pair.partition("/")
            if part == "im" and f"{pair}.re" in column:
                continue
            if part != "re" or not point or f"{pair}.im" not in column:
                expected = "two columns a function such as tip/root.re and tip/root.im"
                raise InputError(
                    Fault(
                        (str(file), name), f"is not understood; the columns are {enumerated(head)}", expected=expected
                    )
                )
            yield output, point, omega, column[name] + 1j * column[f"{pair}.im"], quantity or "displacement"

    return _joined(functions(), str(file))


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
        raise InputError(Fault(str(file), "cannot be read as a universal file", remedy=str(error))) from None
    for k, held in enumerate(sets, 1):
        if int(held.get("func_type", 0)) != _FRF:
            continue
        sign, names = 1.0, []
        for node, direction in (("rsp_node", "rsp_dir"), ("ref_node", "ref_dir")):
            code = int(held[direction])
            sign *= -1.0 if code < 0 else 1.0
            names.append(f"n{int(held[node])}{_DIRECTIONS.get(abs(code), '')}")
        what = quantity or _ORDINATES.get(int(held.get("ordinate_spec_data_type", 0)))
        if what is None:
            said = shown(held.get("ordinate_spec_data_type"))
            remedy = 'say quantity="acceleration" or what else was measured'
            raise InputError(
                Fault((str(file), f"function {k}"), f"does not say what moves (type {said})", remedy=remedy)
            )
        values: ComplexArray = np.asarray(sign * np.asarray(held["data"]), dtype=complex)
        yield names[0], names[1], 2.0 * np.pi * np.asarray(held["x"], dtype=float), values, what
