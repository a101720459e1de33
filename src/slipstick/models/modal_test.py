"""Measured frequency response functions, of universal files, tables and arrays: as they are, or the modes that fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, frequency, number, one, warn, whole, wrong
from slipstick.results.measured_receptances import read_receptances
from slipstick.structure.measured import Receptances, checked, reciprocal
from slipstick.structure.modal_fit import TIME_LIMIT, ModalFit, fit_modes
from slipstick.structure.tabulated import FEWEST, Beyond, TabulatedStructure, full_table, noise_share, smoothed
from slipstick.typing import FrequencyRange


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
        - ``.mat`` (MATLAB, any version from 5 on): its vectors are columns, of matrices ``H(:,2)`` or ``H(:,2,1)``, of
          structs ``rig.f``, real or complex (``tip/root``); ``columns`` says what they are;
        - ``.nc``: the dataset.
    modes
        How many modes are kept, the strongest in the range first; by default all that stand out of the noise. Others
        that were seen are taken into account for the fit, and become compliance.
    range
        Frequencies between which they are fitted, rad/s or with a unit, ``("20 Hz", "400 Hz")``; by default all.
    quantity
        "displacement", "velocity" or "acceleration": what was measured, where the file does not say.
    columns
        Of a file with other names: what the columns are, ``{"frequency": "f", "tip/root.re": "Re H21", ...}``, of a
        .mat file ``{"frequency": "f", "tip/root": "H(:,2)"}``, of a universal file ``{"tip/root": "n12x/n1x"}``;
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
