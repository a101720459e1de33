"""Columns of the loads: forces on dofs, load shapes, and supports that move, whose columns turn with the frequency.

In coordinates relative to a support that moves by ``u(t)`` it is felt as the load ``-M r u''``, with ``r`` the motion
of the dofs as a rigid body. A displacement of harmonic m makes it ``(m omega)^2 M r u``: the factor is part of the
receptance from that column, with its derivative, so that nothing else need know of it.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.balance.contacts import dof_faults
from slipstick.balance.loads import UNBALANCE, Load
from slipstick.errors import Fault
from slipstick.structure.checks import beside, dense
from slipstick.structure.dynamic import turning_with
from slipstick.structure.protocol import Receptance
from slipstick.structure.receptance import Factors
from slipstick.typing import Array, ComplexArray

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem
    from slipstick.structure.protocol import Structure

DISPLACEMENT, ACCELERATION = "displacement", "acceleration"
MOTION_UNITS = {DISPLACEMENT: "length", ACCELERATION: "length/time^2", UNBALANCE: "force time^2"}


@dataclass(frozen=True, kw_only=True)
class LoadColumns:
    """What the loads of a problem act on, each once: first what has a vector (n_dofs, n), then load shapes."""

    vectors: Array
    shapes: tuple[str, ...]
    places: tuple[tuple[Hashable, ...], ...]
    """``Load.place`` of each."""
    motions: tuple[str | None, ...]
    """What is given of a support, or of a mass that turns; None for a force."""

    def row(self, load: Load) -> int:
        """The place of a load among them."""
        return self.places.index(load.place)

    def receptance(self, structure: Structure, rows: Any, ports: Any) -> Receptance:
        """Receptance from contact ports (n_dofs, n_ports) and these loads to ``rows`` (n_dofs, n_rows)."""
        columns = beside(ports, self.vectors)
        if not structure.sparse_directions:
            rows, columns = dense(rows), dense(columns)
        plain = structure.project(rows, columns, self.shapes)
        if not any(self.motions):
            return plain
        return BaseReceptance(plain, (None,) * ports.shape[1] + self.motions)

    def forces(self, P: Array, orders: Sequence[int], omega: float) -> Array:
        """Force coefficients (n, L) of load coefficients ``P`` (n, L) at harmonics 0 and ``orders`` of ``omega``."""
        w = omega * np.array([0, *orders], dtype=float)
        factor, _ = _factors(self.motions, w)
        return P * np.concatenate([factor[:1], np.repeat(factor[1:], 2, axis=0)]).T


def load_columns(problem: Problem) -> LoadColumns:
    """What the loads of a problem act on."""
    vectors: dict[tuple[Hashable, ...], tuple[Array, str | None]] = {}
    shapes: dict[tuple[Hashable, ...], tuple[str, str | None]] = {}
    for load in problem.loads:
        shape = load.shape if load.base is None else base_shape(load, problem.structure)
        if shape is not None and load.dof is None:
            shapes[load.place] = shape, load.motion
        else:
            vectors[load.place] = _vector(load, problem), load.motion
    empty = np.zeros((len(problem.structure.dofs), 0))
    return LoadColumns(
        vectors=np.column_stack([empty, *(vector for vector, _ in vectors.values())]),
        shapes=tuple(shape for shape, _ in shapes.values()),
        places=(*vectors, *shapes),
        motions=tuple(motion for _, motion in (*vectors.values(), *shapes.values())),
    )


def _vector(load: Load, problem: Problem) -> Array:
    """Forces on the dofs for a unit load: of a support, ``M r``."""
    pattern = load.dof if load.base is None else load.base
    r = problem.direction_matrix([{pattern: 1.0} if isinstance(pattern, str) else dict(pattern or {})])[:, 0]
    mass: Any = getattr(problem.structure, "M", None)
    return r if load.base is None else np.asarray(mass @ r, dtype=np.float64)


def base_shape(load: Load, structure: Structure) -> str | None:
    """The load shape ``M r`` that a name such as "x" stands for; None where the mass matrix is asked instead."""
    return load.target if isinstance(load.base, str) and load.target in structure.load_shapes else None


def base_faults(
    base: Mapping[str, float] | str, structure: Structure | None, dofs: Sequence[str] | None
) -> Iterator[Fault]:
    """Why a moving support cannot be computed; of a structure that is not known, perhaps its ``dofs``."""
    if structure is not None and not hasattr(structure, "M"):
        name = base if isinstance(base, str) else "x"
        if isinstance(base, str) and f"base {base}" in structure.load_shapes:
            return
        yield Fault(
            "base",
            f"a {type(structure).__name__} has neither a mass matrix nor a load shape 'base {name}'",
            remedy=f'reduce the model with that load shape (M r; base = "{name}" of a body), and give base = "{name}"',
        )
    elif not isinstance(base, str):
        for dof in base:
            yield from (fault.inside("base") for fault in dof_faults(dof, dofs))
    elif structure is not None and f"base {base}" not in structure.load_shapes:
        yield from (fault.inside("base") for fault in dof_faults(base, dofs))


def _factors(motions: Sequence[str | None], w: Array) -> tuple[Array, Array]:
    """Force over load for each column at frequencies ``w`` (...), (..., n_columns), and its derivative by ``w``."""
    square = np.array([motion in (DISPLACEMENT, UNBALANCE) for motion in motions])
    constant = np.array([-1.0 if motion == ACCELERATION else 1.0 for motion in motions])
    frequency = w[..., None]
    return np.where(square, frequency**2, constant), np.where(square, 2.0 * frequency, 0.0)


class BaseReceptance:
    """A receptance whose columns of moving supports are asked for their motion instead of their force."""

    def __init__(self, plain: Any, motions: Sequence[str | None]) -> None:
        self._plain, self._motions = plain, tuple(motions)
        self.static: Array = plain.static * _factors(self._motions, np.zeros(()))[0]

    def at(self, orders: ArrayLike, omega: float | Array) -> tuple[ComplexArray, ComplexArray]:
        """As of every receptance, with the derivative by the fundamental frequency."""
        value, slope = self._plain.at(orders, omega)
        factor, rate = self._factor(np.asarray(orders, dtype=float), omega)
        order = np.asarray(orders, dtype=float)[:, None, None]
        return value * factor, slope * factor + value * (order * rate)

    def changed(self, **values: float) -> BaseReceptance:
        """With other values of the structure's parameters."""
        return BaseReceptance(self._plain.changed(**values), self._motions)

    def turning_with(self, omega: float) -> BaseReceptance:
        """As it is at a fundamental frequency that a speed of rotation is tied to."""
        return BaseReceptance(turning_with(self._plain, omega), self._motions)

    def by_parameter(self, name: str, orders: Array, omega: float) -> ComplexArray:
        """Derivative by a parameter of the structure."""
        rate: ComplexArray = self._plain.by_parameter(name, orders, omega) * self._factor(orders, omega)[0]
        return rate

    @property
    def static_by_parameter(self) -> Callable[[str], Array]:
        """As of the receptance of forces, if that has it."""
        plain, factor = self._plain.static_by_parameter, _factors(self._motions, np.zeros(()))[0]
        return lambda name: plain(name) * factor

    @property
    def written(self) -> Callable[[], BaseReceptance]:
        """With all entries, if the receptance of forces is applied by solutions."""
        plain = self._plain.written
        return lambda: BaseReceptance(plain(), self._motions)

    @property
    def factors(self) -> Callable[..., Factors] | None:
        """As of the receptance of forces, if it is known by its modes."""
        return self._with_columns if hasattr(self._plain, "factors") else None

    def _with_columns(self, orders: Array, omega: float | Array, along: Mapping[str, float] | None = None) -> Factors:
        w = np.append(0.0, np.multiply.outer(omega, orders))
        m = np.append(0.0, np.resize(orders, w.size - 1))
        factor, rate = _factors(self._motions, w)
        slope = np.zeros_like(rate) if along else m[:, None] * rate
        return replace(self._plain.factors(orders, omega, along), columns=factor.T, columns_slope=slope.T)

    def _factor(self, orders: Array, omega: float | Array) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        w = np.asarray(omega, dtype=float)[..., None] * np.asarray(orders, dtype=float)
        factor, rate = _factors(self._motions, w)
        return factor[..., None, :], rate[..., None, :]
