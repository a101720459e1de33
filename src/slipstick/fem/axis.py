"""An axis of rotation: radial, circumferential and axial directions, radius and angle of places about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import Fault, InputError
from slipstick.faults import SMALLEST, Gathering, numbers, shown, wrong
from slipstick.typing import Array

DIRECTIONS = ("radial", "circumferential", "axial")

_ON_AXIS = 1e-9
"""Distance from the axis below which there is no radial direction, over the coordinates of which it is a difference."""
_EXPECTED = 'a table such as {"point": (0, 0, 0), "direction": (0, 0, 1)}'


@dataclass(frozen=True, kw_only=True)
class Axis:
    """Right-handed: circumferential is axial x radial, and so grow the angles.

    Parameters
    ----------
    point
        Any point of the axis (3,), length.
    direction
        Along it (3,), of any size.
    zero
        Where the angle is 0 (3,), any direction not along the axis; None: that of x, or of y where the axis is along x.

    Raises
    ------
    InputError
        For what is no vector, or has no direction.

    Examples
    --------
    >>> axis = Axis(direction=(0, 0, 2))
    >>> axis.frame([[0.0, 3.0, 1.0]])["circumferential"].tolist(), axis.radius([[0.0, 3.0, 1.0]])
    ([[-1.0, 0.0, 0.0]], array([3.]))
    """

    point: ArrayLike = (0.0, 0.0, 0.0)
    direction: ArrayLike = (0.0, 0.0, 1.0)
    zero: ArrayLike | None = None

    def __post_init__(self) -> None:
        checks = Gathering()
        point = checks.take(_vector, "point", self.point)
        along = checks.take(_unit, "direction", self.direction)
        if along is not None:
            towards = (np.eye(3)[0] if abs(along[0]) < 0.99 else np.eye(3)[1]) if self.zero is None else self.zero
            zero = checks.take(_across, "zero", towards, along)
            checks.end("axis")
            object.__setattr__(self, "zero", zero)
        checks.end("axis")
        object.__setattr__(self, "point", point)
        object.__setattr__(self, "direction", along)

    @classmethod
    def of(cls, axis: Any) -> Axis:
        """An axis, or a table of its arguments."""
        if isinstance(axis, Axis):
            return axis
        if not isinstance(axis, Mapping) or set(axis) - {"point", "direction", "zero"} or "direction" not in axis:
            raise wrong("axis", axis, _EXPECTED)
        return cls(**axis)

    def frame(self, positions: ArrayLike) -> dict[str, Array]:
        """Unit vectors "radial", "circumferential", "axial" at positions (n, 3), (n, 3) each.

        Raises
        ------
        InputError
            If a position lies on the axis.
        """
        arm, axial = self._arm(positions), np.asarray(self.direction)
        size = np.linalg.norm(arm, axis=1)
        places = np.linalg.norm(np.asarray(positions, dtype=float), axis=1)
        on_axis = size <= np.maximum(_ON_AXIS * (places + np.linalg.norm(self.point)), SMALLEST)
        if np.any(on_axis):
            at = f"point {int(np.argmax(on_axis)) + 1} lies on it, where no direction is radial"
            raise InputError(Fault("axis", at, remedy="give a point of the axis, and its direction"))
        radial = arm / size[:, None]
        whole = np.broadcast_to(axial, radial.shape)
        return {"radial": radial, "circumferential": np.cross(whole, radial), "axial": whole.copy()}

    def radius(self, positions: ArrayLike) -> Array:
        """Distances of positions (n, 3) from the axis, (n,)."""
        return np.asarray(np.linalg.norm(self._arm(positions), axis=1))

    def angle(self, positions: ArrayLike) -> Array:
        """Angles of positions (n, 3) from ``zero``, growing as the circumferential direction points, rad, (n,)."""
        arm, zero, axial = self._arm(positions), np.asarray(self.zero), np.asarray(self.direction)
        return np.asarray(np.arctan2(arm @ np.cross(axial, zero), arm @ zero))

    def _arm(self, positions: ArrayLike) -> Array:
        """From the axis to each position, across it."""
        away = np.asarray(positions, dtype=float) - self.point
        axial = np.asarray(self.direction)
        return np.asarray(away - (away @ axial)[:, None] * axial)


def _vector(name: str, value: Any) -> Array:
    vector = numbers(name, value, "three finite numbers such as (0, 0, 1)")
    if vector.shape != (3,):
        raise wrong(name, value, "three finite numbers such as (0, 0, 1)")
    return vector


def _unit(name: str, value: Any) -> Array:
    vector = _vector(name, value)
    size = float(np.linalg.norm(vector))
    if size < SMALLEST:
        raise InputError(Fault(name, found=shown(value), expected="a vector other than zero"))
    return np.asarray(vector / size)


def _across(name: str, value: Any, axial: Array) -> Array:
    unit = _unit(name, value)
    across = unit - (unit @ axial) * axial
    if np.linalg.norm(across) < 1e-6:
        raise InputError(Fault(name, found=shown(value), expected="a direction that is not along the axis"))
    return np.asarray(across / np.linalg.norm(across))
