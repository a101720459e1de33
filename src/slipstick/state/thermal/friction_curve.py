"""Contact parameters as functions of the contact temperature, from tables [THEORY.md section 8]."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import Fault, InputError
from slipstick.faults import numbers, shown
from slipstick.state.contact_state import Sampled
from slipstick.typing import Array, Reals

CURVED_PARAMETERS = ("mu", "kt", "kn")
INTERPOLATIONS = ("pchip", "cubic", "natural")


class FrictionCurve:
    """mu, kt and kn of temperature, interpolated between the rows of tables and never beyond them.

    Parameters
    ----------
    temperature
        Temperatures of the table rows, (n,), increasing; in the unit of the background temperature.
    mu
        Friction coefficient at these temperatures, (n,), >= 0. Without ``temperature`` it is a table of its own, (n,
        2), with rows (temperature, value). None: it does not depend on temperature.
    kt
        Tangential stiffness, force/length, as ``mu``.
    kn
        Normal stiffness, force/length, as ``mu``.
        "pchip" keeps the shape of the table (no overshoot; one continuous derivative); "cubic" is the not-a-knot
        cubic spline, "natural" the natural one (two continuous derivatives). One for all, or by parameter name.

    Raises
    ------
    InputError
        One sentence for each fault of the tables; on evaluation, when a temperature lies outside them.

    Examples
    --------
    >>> curve = FrictionCurve(temperature=[25, 200, 400, 600, 800], mu=[0.50, 0.45, 0.38, 0.31, 0.27])
    >>> curve.mu([25.0, 400.0])
    array([0.5 , 0.38])
    >>> curve.limits, curve.names
    ((25.0, 800.0), ('mu',))
    >>> curve.mu(900.0)
    Traceback (most recent call last):
    ...
    slipstick.errors.InputError: mu: temperature 900 lies outside its table, 25 to 800; extend the table ...
    """

    def __init__(
        self,
        *,
        temperature: Reals | None = None,
        mu: Reals | None = None,
        kt: Reals | None = None,
        kn: Reals | None = None,
        interpolation: str | Mapping[str, str] = "pchip",
    ) -> None:
        faults: list[Fault] = []
        kinds = _interpolations(interpolation, faults)
        curved = {name: table for name, table in zip(CURVED_PARAMETERS, (mu, kt, kn), strict=True) if table is not None}
        if not curved:
            faults.append(Fault("friction curve", "no table was given", remedy="give at least one of mu, kt, kn"))
        tables = {name: _checked_table(name, temperature, table, faults) for name, table in curved.items()}
        if faults:
            raise InputError(faults)
        self.interpolation = {name: kinds.get(name, "pchip") for name in tables}
        self.tables: dict[str, Array] = tables
        self._splines = {name: _spline(name, table, self.interpolation[name], faults) for name, table in tables.items()}
        low, high = self.limits
        if low >= high:
            faults.append(Fault("friction curve", f"its tables have no temperatures in common ({self._ranges()})"))
        if faults:
            raise InputError(faults)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that depend on temperature, out of mu, kt, kn."""
        return tuple(self.tables)

    @cached_property
    def limits(self) -> tuple[float, float]:
        """Lowest and highest temperature that every table covers."""
        return max(float(t[0, 0]) for t in self.tables.values()), min(float(t[-1, 0]) for t in self.tables.values())

    @cached_property
    def knots(self) -> Array:
        """All temperatures of the tables within the limits, increasing."""
        low, high = self.limits
        rows = np.unique(np.concatenate([table[:, 0] for table in self.tables.values()]))
        return rows[(rows >= low) & (rows <= high)]

    def at(self, temperature: ArrayLike) -> dict[str, Sampled]:
        """Value and derivative of every tabulated parameter; temperatures of any shape."""
        return {name: self._sampled(name, temperature) for name in self.tables}

    def within(self, temperature: Array) -> dict[str, Sampled]:
        """As ``at`` for temperatures (n,) known to lie within the limits."""
        return {name: spline.within(temperature) for name, spline in self._splines.items()}

    @cached_property
    def content(self) -> tuple[tuple[str, str, bytes], ...]:
        """What makes two curves equal."""
        return tuple((name, self.interpolation[name], table.tobytes()) for name, table in self.tables.items())

    def mu(self, temperature: ArrayLike) -> Array:
        """Friction coefficient."""
        return self._sampled("mu", temperature).value

    def dmu(self, temperature: ArrayLike) -> Array:
        """Derivative of the friction coefficient by temperature."""
        return self._sampled("mu", temperature).derivative

    def kt(self, temperature: ArrayLike) -> Array:
        """Tangential contact stiffness."""
        return self._sampled("kt", temperature).value

    def dkt(self, temperature: ArrayLike) -> Array:
        """Derivative of the tangential contact stiffness by temperature."""
        return self._sampled("kt", temperature).derivative

    def kn(self, temperature: ArrayLike) -> Array:
        """Normal contact stiffness."""
        return self._sampled("kn", temperature).value

    def dkn(self, temperature: ArrayLike) -> Array:
        """Derivative of the normal contact stiffness by temperature."""
        return self._sampled("kn", temperature).derivative

    def _sampled(self, name: str, temperature: ArrayLike) -> Sampled:
        if name not in self._splines:
            raise InputError(
                Fault(name, "the friction curve has no table of it", remedy=f"it has {', '.join(self.names)}")
            )
        if not (isinstance(temperature, np.ndarray) and temperature.dtype == np.float64):
            temperature = numbers("temperature", temperature)
        return self._splines[name].at(temperature)

    def _ranges(self) -> str:
        return ", ".join(f"{name}: {table[0, 0]:g} to {table[-1, 0]:g}" for name, table in self.tables.items())

    def __repr__(self) -> str:
        return f"FrictionCurve({self._ranges()})"


@dataclass(frozen=True, kw_only=True)
class _Spline:
    """Piecewise cubic: ``coefficients`` (4, n - 1), highest power first, in the distance from the left knot."""

    name: str
    knots: Array
    coefficients: Array

    def at(self, temperature: Array) -> Sampled:
        low, high = self.knots[0], self.knots[-1]
        if not np.all((temperature >= low) & (temperature <= high)):
            wrong = temperature[~((temperature >= low) & (temperature <= high))].flat[0]
            raise InputError(
                Fault(
                    self.name,
                    f"temperature {wrong:g} lies outside its table, {low:g} to {high:g}",
                    remedy="extend the table by measured rows (it is not extrapolated) or lower the heat or the "
                    "background temperature",
                )
            )
        return self.within(temperature)

    def within(self, temperature: Array) -> Sampled:
        piece = np.searchsorted(self.knots[1:-1], temperature, side="right")
        s = temperature - self.knots[piece]
        c3, c2, c1, c0 = self.coefficients[:, piece]
        return Sampled(((c3 * s + c2) * s + c1) * s + c0, (3.0 * c3 * s + 2.0 * c2) * s + c1)

    def lowest(self) -> tuple[float, float]:
        """Temperature and value of the smallest value between the first and last knot."""
        candidates = [self.knots]
        for left, right, (c3, c2, c1, _) in zip(self.knots, self.knots[1:], self.coefficients.T, strict=False):
            roots = np.roots([3.0 * c3, 2.0 * c2, c1])
            inner = left + roots[np.isreal(roots)].real
            candidates.append(inner[(inner > left) & (inner < right)])
        temperature = np.concatenate(candidates)
        value = self.at(temperature).value
        return float(temperature[value.argmin()]), float(value.min())


def _interpolations(interpolation: Any, faults: list[Fault]) -> dict[str, str]:
    """Kind of interpolation by parameter; appends every fault."""
    kinds = dict.fromkeys(CURVED_PARAMETERS, interpolation)
    if isinstance(interpolation, Mapping):
        kinds = dict(interpolation)
        faults += [
            Fault(
                "interpolation",
                found=f"a kind for {shown(name)}",
                remedy=f"the parameters are {', '.join(CURVED_PARAMETERS)}",
            )
            for name in kinds
            if name not in CURVED_PARAMETERS
        ]
    wrong_kinds = (kind for kind in kinds.values() if not (isinstance(kind, str) and kind in INTERPOLATIONS))
    expected = f"one of {', '.join(INTERPOLATIONS)}"
    faults += dict.fromkeys(Fault("interpolation", found=shown(kind), expected=expected) for kind in wrong_kinds)
    return kinds


def _checked_table(name: str, temperature: Reals | None, values: Reals, faults: list[Fault]) -> Array:
    """The table as (n, 2); appends every fault."""
    expected = "a table of finite numbers: rows of temperature and value, or one value for each temperature"
    try:
        table = numbers(name, values, expected)
        rows = None if temperature is None else numbers("temperature", temperature)
    except InputError as error:
        faults += [fault for fault in error.faults if fault not in faults]
        return np.zeros((2, 2))
    if rows is not None:
        if rows.ndim != 1 or rows.shape != table.shape:
            faults.append(
                Fault(
                    name,
                    found=f"values of shape {table.shape} for temperatures of shape {rows.shape}",
                    expected="one value for each temperature",
                )
            )
            return np.zeros((2, 2))
        table = np.column_stack([rows, table])
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < 2:
        faults.append(
            Fault(
                name,
                f"the table has the shape {table.shape}",
                expected="at least two rows of temperature and value",
            )
        )
    else:
        falling = np.flatnonzero(np.diff(table[:, 0]) <= 0)
        if falling.size:
            first = falling[0]
            faults.append(
                Fault(
                    name,
                    f"temperature {table[first + 1, 0]:g} follows {table[first, 0]:g}",
                    expected="increasing temperatures",
                )
            )
        if np.any(table[:, 1] < 0):
            faults.append(Fault(name, f"the table holds {table[:, 1].min():g}, negative", expected="values >= 0"))
    return table


def _spline(name: str, table: Array, interpolation: str, faults: list[Fault]) -> _Spline:
    from scipy.interpolate import CubicSpline, PchipInterpolator  # slow to import

    x, y = np.ascontiguousarray(table.T)
    if interpolation == "pchip":
        made = PchipInterpolator(x, y)
    else:
        made = CubicSpline(x, y, bc_type="natural" if interpolation == "natural" else "not-a-knot")
    spline = _Spline(name=name, knots=x, coefficients=np.asarray(made.c))
    where, smallest = spline.lowest()
    if smallest < -1e-12 * y.max():
        faults.append(
            Fault(
                name,
                f"the {interpolation} spline overshoots to {smallest:.3g} at temperature {where:.4g}",
                remedy='use interpolation = "pchip", which keeps the shape of the table, or add rows there',
            )
        )
    return spline
