"""Coordinate systems of Nastran bulk data: CORD1R, CORD2R, CORD1C, CORD2C, CORD1S, CORD2S.

A system is rectangular, cylindrical (radius, angle in degrees, height) or spherical (radius, angle from the axis, angle
about it, in degrees). Its origin, a point on its z axis and one in its x z plane are given in another system (CORD2) or
by three grid points (CORD1); system 0 is the basic one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from slipstick.importers.findings import refused
from slipstick.typing import Array

_DEEPEST = 100
"""Systems defined in one another, at most."""


@dataclass(frozen=True, kw_only=True)
class Definition:
    """A card: "R", "C" or "S", and three points, as grid labels (3,) or as coordinates (3, 3) in system ``within``."""

    kind: str
    points: Array
    within: int | None = None


@dataclass(frozen=True, kw_only=True)
class Frame:
    """A coordinate system: its origin and, as columns, its axes in the basic system."""

    kind: str = "R"
    origin: Array = field(default_factory=lambda: np.zeros(3))
    axes: Array = field(default_factory=lambda: np.eye(3))

    def position(self, coordinates: Array) -> Array:
        """Point in the basic system from coordinates in this one, both (3,).

        >>> Frame(kind="C").position(np.array([2.0, 90.0, 1.0])).round(12).tolist()
        [0.0, 2.0, 1.0]
        """
        a, b, c = coordinates
        if self.kind == "C":
            local = np.array([a * np.cos(np.radians(b)), a * np.sin(np.radians(b)), c])
        elif self.kind == "S":
            polar, turn = np.radians(b), np.radians(c)
            local = a * np.array([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
        else:
            local = coordinates
        return self.origin + self.axes @ local

    def directions(self, at: Array) -> Array:
        """Directions 1, 2, 3 of displacements at a point of the basic system, as columns (3, 3).

        On the axis of a system with angles they are those of its rectangular system.
        """
        x, y, z = self.axes.T @ (at - self.origin)
        across = np.hypot(x, y)
        if self.kind == "R" or across <= 1e-12 * (abs(z) + np.linalg.norm(self.origin) + across):
            return self.axes
        around = np.array([-y, x, 0.0]) / across
        if self.kind == "C":
            return self.axes @ np.stack([[x / across, y / across, 0.0], around, [0.0, 0.0, 1.0]], axis=1)
        outward = np.array([x, y, z]) / np.hypot(across, z)
        return self.axes @ np.stack([outward, np.cross(around, outward), around], axis=1)


class Frames:
    """The systems of a file, worked out where they are asked for.

    Parameters
    ----------
    definitions
        Cards by number.
    grids
        System and coordinates of each grid point, by label.
    source
        Name for messages.
    """

    def __init__(
        self, definitions: Mapping[int, Definition], grids: Mapping[int, tuple[int, Sequence[float]]], source: str
    ) -> None:
        self.definitions, self.grids, self.source = definitions, grids, source
        self._known: dict[int, Frame] = {0: Frame()}
        self._open: list[int] = []

    def frame(self, number: int) -> Frame:
        """The system of that number.

        Raises
        ------
        InputError
            If it is not defined, defined by itself, or its points lie on a line.
        """
        if number in self._known:
            return self._known[number]
        if number not in self.definitions:
            raise refused(self.source, f"coordinate system {number} is used, but no CORD card defines it")
        if number in self._open or len(self._open) >= _DEEPEST:
            raise refused(self.source, f"coordinate system {number} is defined by itself")
        self._open.append(number)
        self._known[number] = self._made(number, self.definitions[number])
        self._open.pop()
        return self._known[number]

    def position(self, grid: int) -> Array:
        """Position of a grid point in the basic system, (3,)."""
        if grid not in self.grids:
            raise refused(self.source, f"a coordinate system uses grid point {grid}, which is not in the file")
        number, coordinates = self.grids[grid]
        point = np.asarray(coordinates, dtype=float)
        return self.frame(number).position(point) if number else point

    def _made(self, number: int, card: Definition) -> Frame:
        if card.within is None:
            origin, on_axis, in_plane = (self.position(int(grid)) for grid in card.points)
        else:
            within = self.frame(card.within)
            origin, on_axis, in_plane = (within.position(point) for point in card.points)
        third, across = on_axis - origin, in_plane - origin
        second = np.cross(third, across)
        size = np.linalg.norm(third) * np.linalg.norm(across)
        if not (np.isfinite(size) and np.linalg.norm(second) > 1e-12 * size):
            raise refused(self.source, f"the three points of coordinate system {number} lie on a line")
        third, second = third / np.linalg.norm(third), second / np.linalg.norm(second)
        return Frame(kind=card.kind, origin=origin, axes=np.stack([np.cross(second, third), second, third], axis=1))
