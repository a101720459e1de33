"""Contact points on a surface: where they are, which way is out, what share of the surface each has.

Points are named "c1", "c2", ...; the motion of point k, averaged over its patch, has the degrees of freedom "c<k>x",
"c<k>y", "c<k>z".
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import Fault, InputError
from slipstick.faults import SMALLEST, listed, numbers, shown, whole, wrong
from slipstick.fem.axis import DIRECTIONS, Axis
from slipstick.typing import Array, Reals

_EDGE_ON = 0.1
"""Cosine between a normal direction and the surface's own normal below which the surface does not look that way."""


@dataclass(frozen=True, kw_only=True)
class ContactPoints:
    """Contact points of one surface.

    Attributes
    ----------
    positions, normals
        Coordinates and outward unit normals, (n, 3).
    areas
        Share of the surface nearest to each point, (n,); they sum to the surface's area.
    influence
        Temperature rise per power, (n, n); None without conduction.
    side
        Letter with which their names begin.
    """

    positions: Array
    normals: Array
    areas: Array
    influence: Array | None = None
    side: str = "c"

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.positions)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the points: "c1", "c2", ..."""
        return tuple(f"{self.side}{k}" for k in range(1, self.count + 1))

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom, point by point, x y z."""
        return tuple(f"{name}{axis}" for name in self.names for axis in "xyz")

    def tangents(self, direction: Reals | str, *, axis: Axis | None = None, across: Array | None = None) -> Array:
        """Unit vectors (n, 3): a direction, as of rubbing, projected on the surface at each point.

        Parameters
        ----------
        direction
            (3,), or with an ``axis`` "radial", "circumferential" or "axial".
        across
            Unit vectors (n, 3) that stand for the normals of the surface; None: these.

        Raises
        ------
        InputError
            If the direction is zero or normal to the surface at a point.
        """
        normals = self.normals if across is None else across
        wanted = np.broadcast_to(self._wanted(direction, axis), normals.shape)
        flat = wanted - np.sum(normals * wanted, axis=1)[:, None] * normals
        size = np.linalg.norm(flat, axis=1)
        if not np.all(size > np.maximum(1e-3 * np.linalg.norm(wanted, axis=1), SMALLEST)):
            along = direction if isinstance(direction, str) else np.asarray(direction).tolist()
            raise InputError(Fault("direction", f"{along} is normal to the surface", remedy="give one along it"))
        return np.asarray(flat / size[:, None])

    def _wanted(self, direction: Any, axis: Axis | None) -> Array:
        """A direction (3,), or one of the axis at each point, (n, 3)."""
        if isinstance(direction, str):
            return self.about(axis, direction, "direction")
        expected = "a vector of three finite numbers"
        wanted = numbers("direction", direction, expected)
        if wanted.shape != (3,):
            raise wrong("direction", direction, expected)
        return wanted

    def about(self, axis: Axis | None, word: str, name: str = "normal") -> Array:
        """Unit vectors "radial", "circumferential" or "axial" at the points, (n, 3)."""
        if word not in DIRECTIONS:
            raise InputError(Fault(name, found=shown(word), expected=f"one of {', '.join(DIRECTIONS)}"))
        if axis is None:
            remedy = 'give axis, such as {"point": (0, 0, 0), "direction": (0, 0, 1)}'
            raise InputError(Fault(name, f"{word} needs the axis of the rotor", remedy=remedy))
        return axis.frame(self.positions)[word]

    def outward(self, axis: Axis | None, word: str) -> Array:
        """The same, each turned so that it looks out of the body, (n, 3).

        Raises
        ------
        InputError
            If the surface does not look that way at a point.
        """
        across = self.about(axis, word)
        side = np.sum(across * self.normals, axis=1)
        edge_on = np.abs(side) < _EDGE_ON
        if edge_on.any():
            at = int(np.argmax(edge_on))
            statement = f"{word} runs along the surface at point {at + 1}, not across it"
            raise InputError(Fault("normal", statement, remedy="give another direction, or the axis of the rotor"))
        return np.asarray(across * np.sign(side)[:, None])

    def tangential(self, direction: Reals | str, **options: Any) -> list[dict[str, float]]:
        """A direction projected on the surface, as direction cosines by dof, one dict a point; see ``tangents``."""
        return self.cosines(self.tangents(direction, **options))

    @property
    def normal(self) -> list[dict[str, float]]:
        """Outward normals as direction cosines by dof: a positive motion closes the contact."""
        return self.cosines(self.normals)

    def cosines(self, vectors: Array) -> list[dict[str, float]]:
        """Direction cosines by dof of one unit vector a point, (n, 3); those that are rounding alone are left out."""
        return [
            {f"{name}{axis}": float(value) for axis, value in zip("xyz", vector, strict=True) if abs(value) > 1e-12}
            for name, vector in zip(self.names, vectors, strict=True)
        ]

    def chosen(self, points: str | Iterable[int]) -> list[int]:
        """Rows of points by their numbers, counted from 1, or of "all".

        Raises
        ------
        InputError
            If a point is not there or given twice.
        """
        if isinstance(points, str) and points == "all":
            return list(range(self.count))
        wanted = listed("points", points, '"all" or numbers counted from 1')
        numbers = [whole("points", p, 1, self.count) for p in wanted]
        if not numbers or len(set(numbers)) != len(numbers):
            raise InputError(Fault("points", found=shown(numbers), remedy="give every point once"))
        return [p - 1 for p in numbers]

    def share(self, total: float, points: str | Iterable[int] = "all") -> Array:
        """A total (normal load, stiffness) shared among the chosen points by area, (n_chosen,)."""
        areas = self.areas[self.chosen(points)]
        return np.asarray(total * areas / areas.sum())

    def resistance(self, points: str | Iterable[int] = "all", *, own: ArrayLike = 0.0) -> Array:
        """Temperature per power among the chosen points, (n_chosen, n_chosen), for a thermal model.

        ``own`` is added to the diagonal: what each contact has by itself, as at the spots where the metals touch.

        Raises
        ------
        InputError
            If the body has no influence matrix.
        """
        if self.influence is None:
            raise InputError(
                Fault("influence", "the body has no influence matrix", remedy="give films or cold and a conductivity")
            )
        at = self.chosen(points)
        return np.asarray(self.influence[np.ix_(at, at)] + np.diag(np.broadcast_to(np.asarray(own, float), len(at))))
