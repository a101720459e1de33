"""Columns of the loads: forces on dofs, load shapes, and supports that move, whose columns turn with the frequency.

In coordinates relative to a support that moves by ``u(t)`` it is felt as the load ``-M r u''``, with ``r`` the motion
of the dofs as a rigid body. A displacement of harmonic m makes it ``(m omega)^2 M r u``: the factor is part of the
receptance from that column, with its derivative, so that nothing else need know of it.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.balance.contacts import dof_faults
from slipstick.balance.loads import UNBALANCE, Load
from slipstick.errors import Fault, InputError
from slipstick.structure.checks import beside, dense
from slipstick.structure.receptance import Factors, Receptance
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
        if not isinstance(plain, Receptance):
            found = f"a {type(structure).__name__} projects to a {type(plain).__name__}"
            remedy = "derive its class from ss.models.Receptance"
            raise InputError(Fault("structure", found, expected="a receptance", remedy=remedy))
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
    mass: Any = problem.structure.M
    return r if load.base is None else np.asarray(mass @ r, dtype=np.float64)


def base_shape(load: Load, structure: Structure) -> str | None:
    """The load shape ``M r`` that a name such as "x" stands for; None where the mass matrix is asked instead."""
    return load.target if isinstance(load.base, str) and load.target in structure.load_shapes else None


def static_forces(load: Load, problem: Problem) -> list[Load]:
    """A load of harmonic 0 as forces at rest: a support that is accelerated is felt as ``-M r`` times its acceleration.

    Displaced or not, a support at rest is felt not at all.
    """
    if load.motion is None:
        return [load]
    if load.motion != ACCELERATION:
        return []
    shape = base_shape(load, problem.structure)
    if shape is not None:
        return [Load(shape=shape, harmonic=0, cos=-load.cos)]
    forces = -load.cos * _vector(load, problem)
    return [Load(dof=problem.structure.dofs[k], harmonic=0, cos=float(forces[k])) for k in np.flatnonzero(forces)]


def base_faults(
    base: Mapping[str, float] | str, structure: Structure | None, dofs: Sequence[str] | None
) -> Iterator[Fault]:
    """Why a moving support cannot be computed; of a structure that is not known, perhaps its ``dofs``."""
    if structure is not None and structure.M is None:
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


class BaseReceptance(Receptance):
    """A receptance whose columns of moving supports are asked for their motion instead of their force."""

    def __init__(self, plain: Receptance, motions: Sequence[str | None]) -> None:
        self._plain, self._motions = plain, tuple(motions)
        self._at_rest = _factors(self._motions, np.zeros(()))[0]
        self.static = plain.static * self._at_rest
        self.highest, self.summed, self.waves = plain.highest, plain.summed, plain.waves

    def _of(self, plain: Receptance) -> BaseReceptance:
        return self if plain is self._plain else BaseReceptance(plain, self._motions)

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """As of every receptance, with the derivative by the fundamental frequency."""
        value, slope = self._plain.at(orders, omega)
        factor, rate = self._factor(orders, omega)
        order = np.asarray(orders, dtype=float)[:, None, None]
        return value * factor, slope * factor + value * (order * rate)

    def of_order(self, order: int, frequency: ArrayLike, wave_number: int = 0) -> ComplexArray | None:
        """As of the receptance of forces, whose columns of supports stay: disturbances do not move them."""
        return self._plain.of_order(order, frequency, wave_number)

    def conjugates(self, orders: Array, omega: float) -> ComplexArray:
        """As of the receptance of forces, with factors on the columns."""
        out = self._plain.conjugates(orders, omega)
        self._times_factors(out, orders, omega)
        return out

    def conjugates_of(self, orders: Array, omega: Array, out: ComplexArray) -> None:
        """As of the receptance of forces, with factors on the columns."""
        self._plain.conjugates_of(orders, omega, out)
        self._times_factors(out, orders, omega)

    def _times_factors(self, out: ComplexArray, orders: Array, omega: ArrayLike) -> None:
        """Conjugates and their slopes (..., 2, n_columns, n_rows, 1 + k) times the factors on the columns."""
        m, (value, slope) = np.append(0.0, orders), np.moveaxis(out, -4, 0)
        both = _factors(self._motions, np.multiply.outer(omega, m))
        factor, rate = (part.swapaxes(-1, -2)[..., None, :] for part in both)
        slope *= factor
        slope += value * (m * rate)
        value *= factor

    def answer(self, orders: Array, omega: Array, forces: Array) -> Array:
        """As of the receptance of forces, with the forces that the motions are."""
        factor = self._factor(orders, omega)[0][:, :, 0].transpose(0, 2, 1)
        return self._plain.answer(orders, omega, forces * np.repeat(factor, 2, axis=2))

    def changed(self, **values: float) -> BaseReceptance:
        """With other values of the structure's parameters."""
        return self._of(self._plain.changed(**values))

    def turning_with(self, omega: float) -> BaseReceptance:
        """As it is at a fundamental frequency that a speed of rotation is tied to."""
        return self._of(self._plain.turning_with(omega))

    def by_parameter(self, name: str, orders: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Derivative by a parameter of the structure."""
        return np.asarray(self._plain.by_parameter(name, orders, omega) * self._factor(orders, omega)[0])

    def static_by_parameter(self, name: str) -> Array:
        """Derivative of ``static`` by a parameter of the structure."""
        return self._plain.static_by_parameter(name) * self._at_rest

    def written(self) -> BaseReceptance:
        """With all entries, where the receptance of forces is applied by solutions."""
        return self._of(self._plain.written())

    def nearly(self) -> BaseReceptance:
        """Without solutions, where the receptance of forces is applied by them."""
        return self._of(self._plain.nearly())

    def factors(self, orders: ArrayLike, omega: ArrayLike, along: Mapping[str, float] | None = None) -> Factors:
        """As of the receptance of forces, if that is a sum over modes, with factors on the columns."""
        w = np.append(0.0, np.multiply.outer(omega, orders))
        m = np.append(0.0, np.resize(np.asarray(orders, dtype=float), w.size - 1))
        factor, rate = _factors(self._motions, w)
        slope = np.zeros_like(rate) if along else m[:, None] * rate
        return replace(self._plain.factors(orders, omega, along), columns=factor.T, columns_slope=slope.T)

    def _factor(self, orders: ArrayLike, omega: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        w = np.asarray(omega, dtype=float)[..., None] * np.asarray(orders, dtype=float)
        factor, rate = _factors(self._motions, w)
        return factor[..., None, :], rate[..., None, :]
