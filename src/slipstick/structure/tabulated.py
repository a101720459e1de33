"""A structure known by a table of receptances: cubic splines through the lines, no modes.

Real and imaginary part of every receptance are one cubic spline (``scipy.interpolate.CubicSpline``), so that the
derivative by the frequency is that of what is interpolated, exactly. How good the interpolation is comes from the table
itself: the spline through every second line is held against the lines left out. With all lines its own error is about a
sixteenth of that (fourth order); the noise of the measurement stays as it is.

Harmonic 0 asks for the static compliance, which no vibration test measures. It is given, or follows from the lowest
lines: below the first resonance ``A(w) = (a + b w^2) / (1 + d w^2)``, one ``d`` for all, by linear least squares
(E. C. Levy, IRE Trans. Automatic Control 4, 1959).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from math import inf
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import Fault, InputError
from slipstick.faults import shown
from slipstick.structure.checks import array_faults, checked_names, known_shapes, number_faults
from slipstick.structure.measured import FEWEST_NOISY, FLOOR, deviation, noise_squares, resonances
from slipstick.structure.protocol import Structure, TimeEquations
from slipstick.structure.receptance import Receptance
from slipstick.structure.truncation import Truncation
from slipstick.typing import Array, ComplexArray, IntArray

Beyond = Literal["refuse", "line"]
"""What is done about frequencies that the table does not reach."""
FEWEST = 8
"""Lines of a table, at least."""
_LOW, _HIGH = 2.0, 0.8
"""Lines up to twice the lowest frequency tell the static compliance, those above 0.8 of the highest the mass line."""
_CLEAR = 0.9
"""As far from a resonance, damping does not show in the real part."""
_ABOVE_NOISE = 4.0
"""Resonances are seen from so many times the noise on."""
_CLEAN = 1e-5
"""Noise below which nothing is smoothed."""
_COARSE, _DOUBTFUL, _UNKNOWN = 0.02, 0.02, 0.2
"""From here on the interpolation and the static compliance are warned of; from the last on the latter is not taken."""


_FED = 6.0
"""How many times the noise the work of a force has to be negative to count."""
_ROUNDED = 1e-6


class Lines(NamedTuple):
    """How receptances go on outside the table, with its values at its ends.

    Below ``A(0) + c w^2 / (1 + low w^2)``, above ``A(w_n) + rise (s - s_n) / (1 + high s)`` with ``s = 1 / w^2``:
    a stiffness and a mass line, each with the nearest resonance.
    """

    low: float
    rise: Array
    high: float


class _Rational(NamedTuple):
    """``(a + b s) / (1 + d s)``: a and b (n_pairs,)."""

    a: Array
    b: Array
    d: float

    def at(self, s: float) -> Array:
        return (self.a + self.b * s) / (1.0 + self.d * s)


class TabulatedReceptance(Receptance):
    """``A(w)`` between a few directions, by a spline through its values at the lines of a table.

    Parameters
    ----------
    omega
        Lines (n,), rad/s, ascending.
    values
        Complex (n, n_rows, n_columns).
    static
        (n_rows, n_columns).
    lines
        How it goes on below the lowest and above the highest line; None: not at all.
    """

    def __init__(self, omega: Array, values: ComplexArray, static: Array, lines: Lines | None = None) -> None:
        from scipy.interpolate import CubicSpline

        self.static, self.highest = static, inf if lines is not None else float(omega[-1])
        self._ends, self._lines = (float(omega[0]), float(omega[-1])), lines
        self._first, self._last = values[0], values[-1]
        self._spline = CubicSpline(omega, values, extrapolate=False)

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """See ``Receptance.at``; InputError for what the table does not reach."""
        m = np.asarray(orders, dtype=float)
        w = np.multiply.outer(np.asarray(omega, dtype=float), m)
        low, high = self._ends
        still, below, above = w == 0.0, (w > 0.0) & (w < low), w > high
        if self._lines is None and (outside := below | above).any():
            raise InputError(
                Fault(
                    "structure", f"its receptance is asked for at {w[outside].flat[0]:.6g} rad/s",
                    expected=f"frequencies of its table, {low:.6g} to {high:.6g} rad/s",
                    remedy='keep fewer harmonics, measure further, or say beyond="line"',
                )
            )  # fmt: skip
        inside = np.clip(w, low, high)
        value = np.asarray(self._spline(inside), dtype=complex)
        slope = np.asarray(self._spline(inside, 1), dtype=complex)
        value[still], slope[still] = self.static, 0.0
        if self._lines is not None:
            v, u = w[below][:, None, None], w[above][:, None, None]
            to_rest, rise, d = self._lines
            rest = (self._first - self.static) * (1.0 + to_rest * low**2) / low**2
            value[below] = self.static + rest * v**2 / (1.0 + to_rest * v**2)
            slope[below] = 2.0 * rest * v / (1.0 + to_rest * v**2) ** 2
            s, end = u**-2, high**-2
            value[above] = self._last + rise * (s - end) / (1.0 + d * s)
            slope[above] = rise * (1.0 + d * end) / (1.0 + d * s) ** 2 * (-2.0 * s / u)
        return value, slope * m[:, None, None]


class _Errors(NamedTuple):
    """Of the interpolation: root mean square, the worst, and where that is."""

    mean: float
    worst: float
    pair: tuple[int, int]
    omega: float


class TabulatedStructure(Structure):
    """Receptances between named dofs at the lines of a table; made by ``ss.models.tabulated_structure``.

    Parameters
    ----------
    omega
        Lines (n,), rad/s, ascending, above 0.
    real, imaginary
        Parts (n, n_dofs, n_dofs) of the receptance, length/force: row moves, column is forced; nan (of both, at every
        line) where it is not known.
    dofs
        Names.
    static
        Compliance (n_dofs, n_dofs) at rest; by default it follows from the lowest lines.
    beyond
        "refuse" frequencies outside the table, or go on with a "line", see :class:`Lines`.
    noise
        What smoothing took off before, root mean square, as a share of the receptances; 0 where it is as measured.
    notes
        What was suspicious in the measurement.

    Attributes
    ----------
    error
        Root mean square of what the spline through every second line is off at the others, relative.
    worst
        The largest of them.
    static_error
        What the static compliance from the lowest lines is uncertain by, relative; 0 where it was given.
    line_error
        What the line from before the last fifth of the table is off at its end, relative; nan where none is in use.

    Raises
    ------
    InputError
        For arrays that do not fit, and where the lowest lines do not tell the static compliance.

    Examples
    --------
    >>> import numpy as np
    >>> from slipstick.structure.tabulated import TabulatedStructure
    >>> omega = np.linspace(2.0, 50.0, 2000)
    >>> H = (1.0 / (40.0 + 0.4j * omega - omega**2))[:, None, None]
    >>> structure = TabulatedStructure(omega=omega, real=H.real, imaginary=H.imag, dofs=["x"], static=[[1.0 / 40.0]])
    >>> structure.covers, structure.natural_frequencies.round(2), structure.error < 1e-4
    ((2.0, 50.0), array([6.32]), True)
    """

    def __init__(
        self,
        *,
        omega: Any,
        real: Any,
        imaginary: Any,
        dofs: Any,
        static: Any = None,
        beyond: Beyond = "refuse",
        noise: float = 0.0,
        notes: Sequence[str] = (),
    ) -> None:
        names, faults = checked_names(dofs)
        self.dofs: tuple[str, ...] = names
        self.noise, self.notes = float(noise), tuple(notes)
        self.omega = np.array(omega, dtype=float)
        n = self.omega.size
        if self.omega.ndim != 1 or n < FEWEST or np.any(np.diff(self.omega) <= 0.0) or not self.omega[0] > 0.0:
            faults.append(Fault("omega", shown(omega), expected=f"at least {FEWEST} ascending frequencies > 0"))
        parts = [np.array(part, dtype=float) for part in (real, imaginary)]
        for name, part in zip(("real", "imaginary"), parts, strict=True):
            if part.shape != (n, len(names), len(names)):
                faults.append(Fault(name, f"shape {part.shape}", expected=str((n, len(names), len(names)))))
        if not (isinstance(beyond, str) and beyond in ("refuse", "line")):
            faults.append(Fault("beyond", shown(beyond), expected='"refuse" or "line"'))
        if faults:
            raise InputError(faults)
        self.beyond, self.table = beyond, parts[0] + 1j * parts[1]
        self.known = np.asarray(np.isfinite(self.table).all(axis=0))
        if not np.array_equal(np.isfinite(self.table).any(axis=0), self.known):
            raise InputError(Fault("real", "holds nan at some lines of a receptance, and numbers at others"))
        self._given: Array | None = None
        if static is not None:
            if faults := number_faults("static", static):
                raise InputError(faults)
            self._given = np.asarray(static, dtype=complex).real
        if self._given is None:
            self.static, self.static_error = self._static()
        else:
            if faults := array_faults("static", self._given, (len(names),) * 2):
                raise InputError(faults)
            self.static, self.static_error = self._given, 0.0
        self._errors = self._left_out()
        self._lines: Lines | None = None
        self.line_error = np.nan
        if beyond == "line":
            self._lines, self.line_error = self._beyond()

    @property
    def arguments(self) -> dict[str, Any]:
        """What an equal one is made of."""
        return {
            "omega": self.omega, "real": self.table.real, "imaginary": self.table.imag, "dofs": self.dofs,
            "static": self._given, "beyond": self.beyond, "noise": self.noise, "notes": self.notes,
        }  # fmt: skip

    @property
    def error(self) -> float:
        """Of the interpolation through every second line."""
        return self._errors.mean

    @property
    def worst(self) -> float:
        """The largest of these errors."""
        return self._errors.worst

    @property
    def covers(self) -> tuple[float, float]:
        """Lowest and highest frequency that is answered, rad/s."""
        return (0.0, inf) if self.beyond == "line" else (float(self.omega[0]), float(self.omega[-1]))

    @property
    def natural_frequencies(self) -> Array:
        """Where the table shows resonances above its noise, ascending, rad/s: to a line, no better."""
        squares = np.sum(np.abs(self.table[:, self.known]) ** 2, axis=1)
        size = np.sqrt(squares + (_ABOVE_NOISE * self.noise) ** 2 * np.mean(squares))
        return np.array([peak[0] for peak in resonances(self.omega, size)])

    @cached_property
    def energy_fed(self) -> str:
        """Where a force at a measured point takes energy out, beyond the noise of the table, in words."""
        told = []
        for i in np.flatnonzero(self.known.diagonal()):
            own = self.table[:, i, i]
            size = float(np.sqrt(np.mean(np.abs(own) ** 2)))
            noise = np.maximum(deviation(self.omega, own[:, None])[:, 0], self.noise * size)
            off = own.imag / np.maximum(np.maximum(_FED * noise, _ROUNDED * np.abs(own)), np.finfo(float).tiny)
            if (off > 1.0).any():
                told.append(f"at '{self.dofs[i]}', {self.omega[int(np.argmax(off))]:.5g} rad/s")
        return "; ".join(told)

    def truncations(self, order: int) -> tuple[Truncation, ...]:
        """Nothing: it has no modes; see ``error`` for its own."""
        del order
        return ()

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What is suspicious or approximated, one sentence each."""
        return (*self.notes, *self._told())

    def _told(self) -> Iterator[str]:
        off, (low, high) = self._errors, (self.omega[0], self.omega[-1])
        if off.worst > _COARSE:
            name = f"'{self.dofs[off.pair[0]]}' by a force on '{self.dofs[off.pair[1]]}'"
            yield (
                f"the table is coarse or noisy: interpolated from every second line {name} is off by up to "
                f"{100 * off.worst:.2g} % at {off.omega:.6g} rad/s ({100 * off.mean:.2g} % in the mean)"
            )
        if self.static_error > _DOUBTFUL:
            yield (
                f"the static compliance, which harmonic 0 needs, follows from the lines above {low:.6g} rad/s to "
                f"{100 * self.static_error:.2g} % only: give it as static"
            )
        if self.beyond == "line":
            yield (
                f"below {low:.6g} and above {high:.6g} rad/s nothing was measured: the table goes on in straight "
                f"lines; over its last fifth such lines are off by {100 * self.line_error:.2g} %"
            )

    def summary(self) -> str:
        """What it is and how good, as a text."""
        static = "given" if self._given is not None else f"from the lowest lines, to {100 * self.static_error:.2g} %"
        taken, (low, high) = (
            f"; noise of {100 * self.noise:.2g} % smoothed away" * (self.noise > 0.0),
            self.omega[[0, -1]],
        )
        lines = [
            f"{self.omega.size} lines, {low:.6g} to {high:.6g} rad/s, {len(self.dofs)} points{taken}",
            f"interpolated from every second line off by {100 * self.error:.2g} %, at worst {100 * self.worst:.2g} %",
            f"static compliance {static}",
        ]
        return "\n".join([*lines, *self.warnings])

    def project(self, rows: Array, columns: Array, shapes: Sequence[str] = ()) -> TabulatedReceptance:
        """Receptance between directions, see ``Structure.project``; InputError where one was not measured."""
        known_shapes(shapes, {})
        rows, columns = np.asarray(rows, dtype=float), np.asarray(columns, dtype=float)
        asked = (np.abs(rows).sum(axis=1)[:, None] > 0) & (np.abs(columns).sum(axis=1) > 0)
        for i, j in np.argwhere(asked & ~self.known)[:1]:
            raise InputError(
                Fault(
                    "structure", f"the motion of '{self.dofs[i]}' by a force on '{self.dofs[j]}' was not measured",
                    expected="receptances between all points that contacts, loads and outputs are at",
                    remedy="measure it, or its converse, or fit modes (ss.models.modal_analysis)",
                )
            )  # fmt: skip

        def between(A: Any) -> Any:
            return rows.T @ np.where(self.known, A, 0.0) @ columns

        lines = None if self._lines is None else self._lines._replace(rise=between(self._lines.rise))
        return TabulatedReceptance(self.omega, between(self.table), between(self.static), lines)

    def time_equations(self, rows: Array, columns: Array, shapes: Sequence[str] = (), **_: Any) -> TimeEquations:
        """Raises InputError: a table of receptances has none."""
        raise InputError(
            Fault(
                "structure",
                "is a table of receptances, which has no equations in time",
                remedy="fit modes to it (ss.models.modal_analysis) for motion in time, stability and modes",
            )
        )

    def _left_out(self) -> _Errors:
        from scipy.interpolate import CubicSpline

        kept = np.r_[0 : self.omega.size : 2]
        out = np.arange(1, kept[-1], 2)
        pairs, table = np.argwhere(self.known), self.table[:, self.known]
        spline = CubicSpline(self.omega[kept], table[kept])
        off = np.abs(spline(self.omega[out]) - table[out]) / relative_to(table)[out]
        k, pair = np.unravel_index(int(np.argmax(off)), off.shape)
        i, j = pairs[pair]
        return _Errors(
            float(np.sqrt(np.mean(off**2))), float(off[k, pair]), (int(i), int(j)), float(self.omega[out][k])
        )

    def _static(self) -> tuple[Array, float]:
        """Compliance at rest from the lowest lines, and how much less of them would change it."""
        found, fewer = (self._below(count).a for count in (self._low_lines, self._low_lines // 2))
        off = float(np.linalg.norm(found - fewer)) / (float(np.linalg.norm(found)) or 1.0)
        if off > _UNKNOWN:
            raise InputError(
                Fault(
                    "static",
                    f"the lines above {self.omega[0]:.6g} rad/s do not determine it ({100 * off:.0f} % uncertain)",
                    expected="the compliance at rest, (n_dofs, n_dofs), which harmonic 0 needs",
                    remedy="give it; zeros do where no contact or load acts in the mean",
                )
            )  # fmt: skip
        return self._matrix(found), off

    @property
    def _low_lines(self) -> int:
        top = min([_LOW * self.omega[0], *(_CLEAR * self.natural_frequencies[:1])])
        return max(FEWEST, int(np.sum(self.omega <= top)))

    def _below(self, count: int) -> _Rational:
        return self._rational(slice(count), 2)

    def _above(self, end: int) -> _Rational:
        """Of the lines up to number ``end`` from 0.8 of its frequency, above all resonances."""
        peaks = self.natural_frequencies[self.natural_frequencies < self.omega[end]]
        bottom = max([_HIGH * self.omega[end], *(peaks[-1:] / _CLEAR)])
        first = min(int(np.searchsorted(self.omega, bottom)), end + 1 - FEWEST)
        return self._rational(slice(max(first, 0), end + 1), -2)

    def _rational(self, part: slice, power: int) -> _Rational:
        A = self.table[part].real
        own = np.sqrt(np.mean(A**2, axis=0))
        driving = np.sqrt(np.diag(own))
        size = np.where(np.isfinite(across := np.outer(driving, driving)) & (across > 0.0), across, own)
        return _rational(self.omega[part] ** power, A[:, self.known], size[self.known])

    def _matrix(self, pairs: Array) -> Array:
        out = np.full(self.known.shape, np.nan)
        out[self.known] = pairs
        return out

    def _beyond(self) -> tuple[Lines, float]:
        """The lines, and what one from before the last fifth of the table is off at the end."""
        table, last = self.table[:, self.known], self.omega[-1] ** -2
        end = max(int(np.searchsorted(self.omega, _HIGH * self.omega[-1])) - 1, 0)
        early, model = self._above(end), self._above(self.omega.size - 1)
        guess = table[end] + early.at(last) - early.at(self.omega[end] ** -2)
        off = float(np.linalg.norm(guess - table[-1]) / np.linalg.norm(table[-1]))
        rise = (model.b - model.a * model.d) / (1.0 + model.d * last)
        return Lines(self._below(self._low_lines).d, self._matrix(rise), model.d), off

    def __repr__(self) -> str:
        low, high = self.omega[0], self.omega[-1]
        return f"TabulatedStructure({len(self.dofs)} dofs, {self.omega.size} lines, {low:.6g} to {high:.6g} rad/s)"


def _rational(s: Array, A: Array, size: Array) -> _Rational:
    """That of ``A`` (n, n_pairs) at ``s`` (n,), ``a + b s - d s A = A`` in the mean of pairs over their size (Levy)."""
    scale, size = float(np.abs(s).max()), np.where(size > 0.0, size, 1.0)
    basis, right = np.column_stack([np.ones(s.size), s / scale]), A / size
    times, project = (s / scale)[:, None] * right, np.linalg.pinv(basis)
    rest = [part - basis @ (project @ part) for part in (times, right)]  # without a and b of each pair
    norm = float(np.sum(rest[0] ** 2))
    d = -float(np.sum(rest[0] * rest[1])) / norm if norm > 0.0 else 0.0
    if d <= -1.0:  # a pole where the line is asked for
        d = 0.0
    a, b = project @ (right + d * times) * size
    return _Rational(a, b / scale, d / scale)


def relative_to(table: ComplexArray) -> Array:
    """What errors of receptances (n, n_pairs) are relative to: their size with a share of its mean."""
    size = np.abs(table)
    return np.asarray(size + FLOOR * np.sqrt(np.mean(size**2, axis=0)))


def noise_of(values: ComplexArray) -> Array:
    """Standard deviation of the noise of receptances (n, n_pairs), real and imaginary part each, relative, (n_pairs,).

    That of the median line, of those at which fourth differences show noise; 0 where hardly any do.
    """
    squares, used = noise_squares(values)
    size = np.abs(values)
    share = np.sqrt(squares) / np.where(size > 0.0, size, np.inf)
    out = np.zeros(values.shape[1])
    for pair in np.flatnonzero(used.mean(axis=0) > FEWEST_NOISY):
        out[pair] = np.median(share[used[:, pair], pair]) / np.sqrt(2.0 * np.log(2.0))
    return out


def noise_share(omega: Array, values: ComplexArray) -> Array:
    """Root mean square of the noise of receptances (n, n_pairs) as a share of theirs, (n_pairs,).

    Of real and imaginary part each, as ``noise_of``; lines where resonances are large count most.
    """
    size = np.sqrt(np.mean(np.abs(values) ** 2, axis=0))
    return np.asarray(np.sqrt(np.mean(deviation(omega, values) ** 2, axis=0)) / np.where(size > 0.0, size, np.inf))


def smoothed(omega: Array, values: ComplexArray) -> ComplexArray:
    """Receptances (n, n_pairs) without the noise that a smoothing spline takes off.

    Its knots lie as close as the table asks for (P. Dierckx, Curve and Surface Fitting with Splines, 1993, chapter 5);
    what is taken off is as large as the noise.
    """
    from scipy.interpolate import splev, splrep

    out, n = values.copy(), omega.size
    noise = deviation(omega, values)
    for pair in np.flatnonzero(noise_of(values) >= _CLEAN):
        weight = 1.0 / noise[:, pair]
        parts = [
            splev(omega, splrep(omega, part, w=weight, s=n - np.sqrt(2.0 * n), full_output=True, quiet=True)[0])
            for part in (values[:, pair].real, values[:, pair].imag)
        ]
        out[:, pair] = parts[0] + 1j * parts[1]
    return out


def full_table(values: ComplexArray, rows: IntArray, columns: IntArray, n_dofs: int) -> ComplexArray:
    """Reciprocal receptances (n, n_pairs) as matrices (n, n_dofs, n_dofs), nan where neither way was measured."""
    out = np.full((len(values), n_dofs, n_dofs), np.nan + 1j * np.nan)
    out[:, rows, columns] = values
    out[:, columns, rows] = values
    return out
