"""Kinds of measurement and their properties for a fit: steady vibration, loops of a contact, backbones, free decays."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.parameters import parameter_units
from slipstick.balance.problem import Problem
from slipstick.typing import Array, IntArray

QUANTITIES = {"peak": ("omega", "amplitude"), "mode": ("omega", "damping ratio")}
"""Names of the two numbers of a point, by kind of backbone."""


class Described(NamedTuple):
    """Dimensions, coordinates, units and name of measured numbers in a dataset."""

    dims: tuple[str, ...]
    coords: dict[str, Any]
    units: str
    name: str


@dataclass(frozen=True, kw_only=True)
class Measured(ABC):
    """Measured numbers as arrays."""

    values: Array
    """Measured numbers; nan where nothing was measured."""
    noise: Array | None
    """Standard deviations, of the shape of ``values``."""
    conditions: Mapping[str, Array] = field(default_factory=dict)
    """Named parameters that were set at each point, (n,) each."""
    notes: tuple[str, ...] = ()
    """Sentences for the user about the measurement."""
    omega: Array | float
    """Frequency of each point (n,), or of the first periods, rad/s."""

    in_time: ClassVar[bool] = False
    """Whether motions are integrated and compared in time."""

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of the two numbers of a point, where ``values`` (n, 2) have two kinds; else empty."""
        return ()

    @property
    def sizes(self) -> Array:
        """Divisors that make numbers of several kinds comparable, of the shape of ``values``."""
        return np.ones(self.values.shape)

    def scale(self, used: NDArray[np.bool_]) -> Array:
        """Divisors (m,) of the used numbers without known noise: their root mean square."""
        numbers = self.values[used]
        return np.full(numbers.shape, float(np.sqrt(np.mean(numbers**2))) or 1.0)

    @abstractmethod
    def shares(self, predicted: Array) -> dict[str, Array]:
        """Sizes that noise may be proportional to, by name in words, each of the shape of ``predicted``.

        Noise ``r`` times a complex number is ``r / sqrt(2)`` times its modulus in each part.
        """

    @property
    @abstractmethod
    def runs(self) -> list[IntArray]:
        """Indices of points that were measured successively."""

    @property
    def levels(self) -> list[tuple[str, IntArray]]:
        """Conditions in words with the indices of their points; empty with a single condition."""
        return []

    def conjugated(self) -> Self | None:
        """The measurement with the opposite sign of the phase; None without a phase."""
        return None

    def at_frequencies(self, factor: float) -> Self | None:
        """The measurement at frequencies times a factor; None where that is not a possible mistake."""
        return None

    def integrated(self, orders: Array, order: int) -> Self | None:
        """Displacements, if the numbers are derivatives of an order; None where they cannot be.

        ``orders`` are those of the harmonics > 0.
        """
        return None

    @property
    def one_complex(self) -> bool:
        """Whether each point has one complex number, of one harmonic: then a shift in time is a change of phase."""
        return False

    @abstractmethod
    def described(self, problem: Problem) -> Described:
        """Description of the numbers in the dataset of a fit."""


@dataclass(frozen=True, kw_only=True)
class _AtFrequencies(Measured):
    """A measurement at n points, each with its frequency."""

    omega: Array
    """Fundamental frequencies (n,), rad/s."""

    @property
    def groups(self) -> list[IntArray]:
        """Indices of points with the same conditions."""
        rows = np.array([*self.conditions.values()]).T.reshape(self.omega.size, -1)
        which = np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
        return [np.flatnonzero(which == g) for g in range(int(which.max()) + 1)]

    @property
    def levels(self) -> list[tuple[str, IntArray]]:
        """Conditions in words with the indices of their points; empty with a single condition."""
        groups = self.groups
        if len(groups) < 2:
            return []
        return [(", ".join(f"{n} = {v[g[0]]:g}" for n, v in self.conditions.items()), g) for g in groups]

    def at_frequencies(self, factor: float) -> Self | None:
        """The measurement at frequencies times a factor."""
        return replace(self, omega=self.omega * factor, noise=None)

    def _points(self, problem: Problem) -> dict[str, Any]:
        label = problem.units.label
        known = {
            name: ("point", values, {"units": label(parameter_units(problem, name))})
            for name, values in self.conditions.items()
        }
        units = label("rad/time")
        return {"omega": ("point", self.omega, {"units": units, "long_name": "frequency"}), **known}


@dataclass(frozen=True, kw_only=True)
class Vibration(_AtFrequencies):
    """Steady vibration at n points: coefficients (n, n_dofs, L), or amplitudes (n, n_dofs)."""

    dofs: tuple[str, ...]

    @property
    def of_amplitude(self) -> bool:
        """Whether only amplitudes were measured."""
        return self.values.ndim == 2

    def shares(self, predicted: Array) -> dict[str, Array]:
        """Size of each number, of the vibration at the point, and of that at the level."""
        if self.of_amplitude:
            own = np.abs(predicted)
            return {"of each amplitude": own, **self._of_level(own)}
        own, whole = _moduli(predicted)
        found = {"of each complex number": own}
        if np.isfinite(self.values[..., 1:]).reshape(-1, predicted.shape[-1] - 1).any(axis=0).sum() > 2:
            found["of the vibration at the point"] = whole
        return found | self._of_level(own)

    def _of_level(self, own: Array) -> dict[str, Array]:
        groups = self.groups
        if len(groups) < 2 or max(map(len, groups)) < 2:
            return {}
        level = np.empty_like(own)
        for group in groups:
            level[group] = np.sqrt(np.mean(own[group] ** 2, axis=0))
        return {"of the vibration of the level": level}

    @property
    def runs(self) -> list[IntArray]:
        """Points of each condition, by frequency."""
        return [group[np.argsort(self.omega[group])] for group in self.groups]

    def conjugated(self) -> Self | None:
        """The measurement with the opposite sign of the phase."""
        if self.of_amplitude:
            return None
        values = self.values.copy()
        values[..., 2::2] *= -1.0
        return replace(self, values=values, noise=None)

    def integrated(self, orders: Array, order: int) -> Self | None:
        """``z = c - i s`` over ``(i m omega)^order``."""
        if self.of_amplitude:
            return replace(self, values=self.values / self.omega[:, None] ** order, noise=None)
        values = np.full_like(self.values, np.nan)
        z = self.values[..., 1::2] - 1j * self.values[..., 2::2]
        z = z / (1j * orders * self.omega[:, None, None]) ** order
        values[..., 1::2], values[..., 2::2] = z.real, -z.imag
        return replace(self, values=values, noise=None)

    @property
    def one_complex(self) -> bool:
        """Whether each point has one complex number, of one harmonic."""
        if self.of_amplitude:
            return False
        there = np.asarray(np.isfinite(self.values).reshape(-1, self.values.shape[-1]).any(axis=0), dtype=bool)
        return bool(there[1::2].sum() == 1 and np.array_equal(there[1::2], there[2::2]) and not there[0])

    def described(self, problem: Problem) -> Described:
        """Amplitudes, or displacements by their coefficients."""
        coords, units = {**self._points(problem), "dof": list(self.dofs)}, problem.units.of_dofs(self.dofs)
        if self.of_amplitude:
            return Described(("point", "dof"), coords, units, "amplitude")
        coords["coefficient"] = _coefficients(problem)
        return Described(("point", "dof", "coefficient"), coords, units, "displacement")


@dataclass(frozen=True, kw_only=True)
class Loops(_AtFrequencies):
    """n hysteresis loops of one contact: coefficients (n, L) of the force along its first port.

    An unused mean is nan.
    """

    contact: str
    motion: Mapping[str, Array]
    """Coefficients of the relative motion (n, L) by port."""

    def shares(self, predicted: Array) -> dict[str, Array]:
        """Size of the loop, whose samples have equal noise."""
        return {"of the loop": _moduli(predicted)[1]}

    @property
    def runs(self) -> list[IntArray]:
        """Empty: loops are not successive points."""
        return []

    @property
    def levels(self) -> list[tuple[str, IntArray]]:
        """Each loop as a level, where there are several."""
        count = len(self.values)
        return [(f"loop {k + 1}", np.array([k])) for k in range(count)] if count > 1 else []

    def at_frequencies(self, factor: float) -> Self | None:
        """None: the motion of loops is given."""
        return None

    def described(self, problem: Problem) -> Described:
        """Forces by their coefficients."""
        coords = {**self._points(problem), "coefficient": _coefficients(problem)}
        return Described(("point", "coefficient"), coords, problem.units.label("force"), f"force of {self.contact}")


@dataclass(frozen=True, kw_only=True)
class Backbone(_AtFrequencies):
    """Peaks of the response at n conditions, or n points of a nonlinear mode, at one dof.

    ``values`` (n, 2) are frequency, and amplitude or damping ratio; ``omega`` are approximate frequencies.
    """

    kind: str
    """A key of ``QUANTITIES``."""
    dof: str
    mode: int = 1
    """Number of the mode, from 1."""
    amplitude: Array
    """Amplitudes (n,) of harmonic 1 at the points of a mode; empty for peaks."""

    @property
    def quantities(self) -> tuple[str, ...]:
        """Frequency, and amplitude or damping ratio."""
        return QUANTITIES[self.kind]

    @property
    def sizes(self) -> Array:
        """Root mean square of each quantity, at every point (n, 2)."""
        there = np.isfinite(self.values)
        squares = np.sum(np.where(there, self.values, 0.0) ** 2, axis=0)
        size = np.sqrt(squares / np.maximum(there.sum(axis=0), 1))
        return np.broadcast_to(np.where(size > 0.0, size, 1.0), self.values.shape)

    def scale(self, used: NDArray[np.bool_]) -> Array:
        """Root mean square of the quantity of each number."""
        return np.asarray(self.sizes[used])

    def shares(self, predicted: Array) -> dict[str, Array]:
        """Size of each number."""
        return {"of each number": np.abs(predicted)}

    @property
    def runs(self) -> list[IntArray]:
        """Peaks over one condition; points of a mode at each condition."""
        order = self.amplitude if self.amplitude.size else self.values[:, 1]
        one = self.kind == "peak" and len(self.conditions) == 1
        return [group[np.argsort(order[group])] for group in ([np.arange(self.omega.size)] if one else self.groups)]

    def at_frequencies(self, factor: float) -> Self | None:
        """The measurement at frequencies times a factor, among its values too."""
        return replace(self, omega=self.omega * factor, values=self.values * [factor, 1.0], noise=None)

    def described(self, problem: Problem) -> Described:
        """Two quantities at each point."""
        coords = {**self._points(problem), "quantity": list(self.quantities)}
        if self.amplitude.size:
            coords["modal_amplitude"] = ("point", self.amplitude, {"units": problem.units.label("length")})
        return Described(("point", "quantity"), coords, problem.units.label("1"), f"backbone of {self.dof}")


@dataclass(frozen=True, kw_only=True)
class Decay(Measured):
    """A free decay of one dof: displacements (n,)."""

    time: Array
    """Times (n,) from the first sample."""
    dof: str
    omega: float
    """Frequency of the first periods, rad/s."""

    in_time = True

    def shares(self, predicted: Array) -> dict[str, Array]:
        """Size of each displacement."""
        return {"of each displacement": np.abs(predicted)}

    @property
    def runs(self) -> list[IntArray]:
        """All samples."""
        return [np.arange(self.time.size)]

    def described(self, problem: Problem) -> Described:
        """Displacements over time."""
        label = problem.units.label
        coords = {"time": ("time", self.time, {"units": label("time"), "long_name": "time"})}
        return Described(("time",), coords, label("length"), f"displacement of {self.dof}")


def _moduli(predicted: Array) -> tuple[Array, Array]:
    """Sizes of each complex number in coefficients (..., L), and of all of them together, in each part."""
    moduli = np.hypot(predicted[..., 1::2], predicted[..., 2::2]) / np.sqrt(2.0)
    own = np.empty_like(predicted)
    own[..., 0] = np.abs(predicted[..., 0])
    own[..., 1::2] = own[..., 2::2] = moduli
    return own, np.broadcast_to(np.sqrt(np.sum(moduli**2, axis=-1, keepdims=True)), own.shape)


def _coefficients(problem: Problem) -> list[str]:
    return ["0", *(f"{part}{m}" for m in problem.harmonics.orders[1:] for part in "cs")]
