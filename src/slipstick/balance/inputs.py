"""What is given to the balance besides motion and frequency, and how it moves with a parameter."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import cos, sin
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from slipstick.typing import Array

SURFACE = ("velocity", "velocity_per_omega", "motion")
_CACHED = 8
"""Numbers of motions for which repeated inputs are cached: a curve uses the same few many times."""


@dataclass(frozen=True, kw_only=True)
class ContactInputs:
    """Numbers of one batch of n elements."""

    values: Mapping[str, Array]
    """Parameters of the law, (n,) each."""
    velocity: Array
    """Constant velocity of the rubbing motion along each port, (n_ports, n), length/time."""
    velocity_per_omega: Array
    """Increase of that velocity for each rad/s of the fundamental frequency, (n_ports, n), length."""
    motion: Array
    """Periodic part of the rubbing motion along each port, (n_ports, n, L)."""

    def map(self, change: Callable[..., Array], *others: ContactInputs) -> ContactInputs:
        """``change(name, own, *others')`` of every array."""
        return ContactInputs(
            values={n: change(n, v, *(o.values[n] for o in others)) for n, v in self.values.items()},
            **{n: change(n, getattr(self, n), *(getattr(o, n) for o in others)) for n in SURFACE},
        )

    @property
    def slides(self) -> NDArray[np.bool_]:
        """Where there is a constant velocity, (n_ports, n)."""
        return np.asarray((self.velocity != 0) | (self.velocity_per_omega != 0))

    @cached_property
    def at_speed(self) -> bool:
        """Whether some velocity is not proportional to the frequency."""
        return bool(self.velocity.any())

    def speed(self, omega: float | Array) -> Array:
        """Constant velocity along each port at a fundamental frequency (rad/s), (n_ports, n), length/time."""
        return self.velocity + omega * self.velocity_per_omega

    def drift(self, omega: float | Array) -> Array:
        """That velocity over omega, (n_ports, n), length per rad; must not be written."""
        return self.velocity / omega + self.velocity_per_omega if self.at_speed else self.velocity_per_omega

    @cached_property
    def _tables(self) -> dict[tuple[str, ...], tuple[Array, ...]]:
        return {}

    def table(self, names: tuple[str, ...]) -> tuple[Array, ...]:
        """Motion, velocity, its increase with omega, and named parameters (n, n_names), as compiled code takes them.

        Cached: must not be written.
        """
        if (table := self._tables.get(names)) is None:
            values = np.stack([self.values[name] for name in names], axis=1)
            arrays = self.motion, self.velocity, self.velocity_per_omega, values
            table = self._tables[names] = tuple(np.require(array, float, ["C", "W"]) for array in arrays)
        return table

    def repeated(self, n: int) -> ContactInputs:
        """The same elements n times over, cached: the arrays must not be written."""
        if n == 1:
            return self
        if n not in self._repeated:
            if len(self._repeated) >= _CACHED:
                self._repeated.clear()
            self._repeated[n] = self.map(
                lambda name, array: np.tile(array, n if name in self.values else (1, n, 1)[: array.ndim])
            )
        return self._repeated[n]

    @cached_property
    def _repeated(self) -> dict[int, ContactInputs]:
        return {}

    def changed(self, /, **arrays: Array) -> ContactInputs:
        """A copy with other arrays: "velocity", "velocity_per_omega", "motion", or parameters by name."""
        surface = {name: arrays.pop(name, getattr(self, name)) for name in SURFACE}
        return ContactInputs(values={**self.values, **arrays}, **surface)


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """Contacts by batch, load coefficients ``P`` (n_loads, L), and parameters of the structure that are not its own.

    The latter are empty except on a path ``StructureValue``.
    """

    batches: tuple[ContactInputs, ...]
    P: Array
    structure: Mapping[str, float] = field(default_factory=dict)

    def map(self, change: Callable[..., Array], *others: Inputs) -> Inputs:
        """``change(name, own, *others')`` of every array; loads are "load"."""
        batches = (b.map(change, *(o.batches[k] for o in others)) for k, b in enumerate(self.batches))
        return replace(self, batches=tuple(batches), P=change("load", self.P, *(o.P for o in others)))

    def moved(self, direction: Inputs, step: float) -> Inputs:
        """``self + step * direction``."""
        return self.map(lambda _, array, other: array + step * other, direction)

    def scaled(self, factor: float) -> Inputs:
        """All multiplied by a factor."""
        return self.map(lambda _, array: factor * array)

    def only(self, *names: str) -> Inputs:
        """Zero but for "load", "velocity", "motion" or parameters by name."""
        return self.map(lambda name, array: array if name in names else np.zeros_like(array))

    def any(self, name: str) -> bool:
        """Whether "load", "velocity", "motion" or a parameter is anywhere other than zero."""
        arrays = [self.P] if name == "load" else []
        for batch in self.batches:
            arrays.append(getattr(batch, name) if name in SURFACE else batch.values.get(name, np.zeros(0)))
        return any(bool(np.any(array)) for array in arrays)

    def with_batch(self, k: int, /, **arrays: Array) -> Inputs:
        """A copy with other arrays in one batch."""
        changed = tuple(b.changed(**arrays) if i == k else b for i, b in enumerate(self.batches))
        return replace(self, batches=changed)


class Assigned:
    """The inputs of n motions: ``distinct`` ones of one form, and the number ``which`` (n,) of those of each motion."""

    def __init__(self, distinct: Sequence[Inputs], which: NDArray[np.intp]) -> None:
        self.distinct, self.which = tuple(distinct), which
        self._stacked: dict[int, ContactInputs] = {}
        self._loads: list[Array] = []

    @classmethod
    def of(cls, inputs: Sequence[Inputs]) -> Assigned:
        """From the inputs of each motion; along a curve over the frequency these are all the same."""
        numbers: dict[int, int] = {}
        which = [numbers.setdefault(id(one), len(numbers)) for one in inputs]
        return cls(tuple({id(one): one for one in inputs}.values()), np.array(which, dtype=np.intp))

    def __len__(self) -> int:
        return len(self.which)

    def at(self, which: Any) -> Assigned:
        """The inputs of some of the motions."""
        some = Assigned(self.distinct, self.which[which])
        some._stacked, some._loads = self._stacked, self._loads
        return some

    @property
    def loads(self) -> Array:
        """Load coefficients (n, n_loads, L)."""
        if not self._loads:
            self._loads.append(np.array([one.P for one in self.distinct]))
        return np.asarray(self._loads[0][self.which])

    @property
    def structures(self) -> list[Mapping[str, float]]:
        """Parameters of the structure of each motion that are not its own."""
        each = [one.structure for one in self.distinct]
        return [each[i] for i in self.which.tolist()]

    @property
    def joined(self) -> Inputs:
        """Contacts of all motions, elements of the first motion first, and loads (n, n_loads, L)."""
        batches = range(len(self.distinct[0].batches))
        return Inputs(batches=tuple(self.contacts(k) for k in batches), P=self.loads)

    def contacts(self, k: int) -> ContactInputs:
        """Batch ``k`` of all motions along one axis, elements of the first motion first; must not be written."""
        if len(self.distinct) == 1:
            return self.distinct[0].batches[k].repeated(len(self.which))
        if k not in self._stacked:
            self._stacked[k] = _side_by_side([one.batches[k] for one in self.distinct])
        together, which = self._stacked[k], self.which
        ports = len(together.velocity)
        return ContactInputs(
            values={name: value[which].reshape(-1) for name, value in together.values.items()},
            velocity=together.velocity[:, which].reshape(ports, -1),
            velocity_per_omega=together.velocity_per_omega[:, which].reshape(ports, -1),
            motion=together.motion[:, which].reshape(ports, -1, together.motion.shape[-1]),
        )


def _side_by_side(inputs: Sequence[ContactInputs]) -> ContactInputs:
    """Numbers of one batch of several inputs, stacked on the axis before that of the elements."""
    return ContactInputs(
        values={name: np.array([one.values[name] for one in inputs], dtype=float) for name in inputs[0].values},
        velocity=np.stack([one.velocity for one in inputs], axis=1),
        velocity_per_omega=np.stack([one.velocity_per_omega for one in inputs], axis=1),
        motion=np.stack([one.motion for one in inputs], axis=1),
    )


class Path(Protocol):
    """Inputs over one parameter."""

    def at(self, value: float) -> tuple[Inputs, Inputs]:
        """Inputs at a value of the parameter, and their derivative by it."""
        ...


@dataclass(frozen=True)
class Line:
    """``base + value * direction``."""

    base: Inputs
    direction: Inputs

    def at(self, value: float) -> tuple[Inputs, Inputs]:
        """Inputs at a value of the parameter, and their derivative by it."""
        return self.base.moved(self.direction, value), self.direction


@dataclass(frozen=True)
class LoadPhase:
    """A load ``amplitude cos(m tau + value)`` at ``P[row, column]`` (its cosine) and the next (its sine)."""

    base: Inputs
    amplitude: float
    row: int
    column: int

    def at(self, value: float) -> tuple[Inputs, Inputs]:
        """Inputs at a value of the parameter, and their derivative by it."""
        c, s = self.amplitude * cos(value), self.amplitude * sin(value)
        return self._with(self.base, c, -s), self._with(self.base.scaled(0.0), -s, -c)

    def _with(self, inputs: Inputs, cosine: float, sine: float) -> Inputs:
        P = inputs.P.copy()
        P[self.row, self.column : self.column + 2] = cosine, sine
        return replace(inputs, P=P)


@dataclass(frozen=True)
class StructureValue:
    """A named parameter of the structure."""

    base: Inputs
    name: str

    def at(self, value: float) -> tuple[Inputs, Inputs]:
        """Inputs at a value of the parameter, and their derivative by it."""
        zero = self.base.scaled(0.0)
        return replace(self.base, structure={self.name: value}), replace(zero, structure={self.name: 1.0})
