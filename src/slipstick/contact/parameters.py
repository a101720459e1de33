"""Parameters of friction contact elements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.errors import InputError
from slipstick.faults import Gathering, number_or_numbers, same_length, shown

LARGEST = 1e100
"""No stiffness, gap or coefficient of a machine is above it in any units; beyond, products overflow."""


_SAME = 1e-9


@dataclass(frozen=True, init=False)
class FrictionContact:
    """Parameters of one friction contact element, or of many (arrays of shape (n_elements,)).

    Normal force ``f_y = kn max(y - gap, 0)``, friction limit ``mu f_y``, tangential stiffness ``kt`` while stuck
    (THEORY.md section 2). A negative gap is an interference: the static preload is ``N0 = -kn gap``.

    Parameters
    ----------
    kt, kn
        Tangential and normal contact stiffness, force/length, >= 0.
    mu
        Friction coefficient, >= 0.
    gap
        Gap (> 0) or interference (< 0), length.
    normal_load
        The static preload, force, >= 0, instead of ``gap``: it becomes ``gap = -normal_load / kn``. One of the two is
        needed. What is kept is the gap: a copy with another ``kn`` has another normal load.

    Raises
    ------
    InputError
        If a parameter is not finite, or kt, kn, mu or the normal load is negative; if neither gap nor normal load is
        given, or both and they contradict each other; if numbers of elements differ.

    Examples
    --------
    >>> FrictionContact(kt=100.0, mu=0.3, kn=2.0, normal_load=800.0)
    FrictionContact(kt=100.0, mu=0.3, kn=2.0, gap=-400.0)
    >>> float(FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0).normal_load)
    800.0
    """

    kt: ArrayLike
    mu: ArrayLike
    kn: ArrayLike
    gap: ArrayLike

    def __init__(
        self,
        *,
        kt: ArrayLike,
        mu: ArrayLike,
        kn: ArrayLike = 1.0,
        gap: ArrayLike | None = None,
        normal_load: ArrayLike | None = None,
    ) -> None:
        given = {"kt": kt, "mu": mu, "kn": kn, "gap": gap, "normal_load": normal_load}
        values, found = {}, Gathering()
        for name, value in given.items():
            if value is not None or name not in ("gap", "normal_load"):
                values[name] = found.take(_checked, name, value)
        if gap is None and normal_load is None:
            found.problems.append(
                "the normal load is missing; give normal_load=800.0, or gap=-800.0 (interference) with kn=1.0"
            )
        found.end()
        found.take(same_length, "friction contact", values)
        found.end()
        load = values.pop("normal_load", None)
        if load is not None:
            values["gap"] = _gap(values["kn"], values.get("gap"), load)
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def normal_load(self) -> NDArray[np.float64]:
        """Static preload at ``y = 0``: ``kn max(-gap, 0)``."""
        return np.asarray(self.kn, dtype=float) * np.maximum(-np.asarray(self.gap, dtype=float), 0.0)


def _checked(name: str, value: Any) -> Any:
    value = number_or_numbers(name, value)
    if np.any(np.abs(value) > LARGEST):
        raise InputError(f"{name}: found {shown(value)}; expected a number below {LARGEST:g}: check the units")
    if name != "gap" and np.any(np.asarray(value) < 0):
        raise InputError(f"{name}: found {shown(value)}, negative; expected a value >= 0")
    return value


def _gap(kn: Any, gap: Any, load: Any) -> Any:
    """The gap that carries a normal load; where a gap is given too, that one if both agree."""
    kn, load = np.asarray(kn), np.asarray(load)
    if gap is not None:
        carried = kn * np.maximum(-np.asarray(gap), 0.0)
        if np.any(np.abs(carried - load) > _SAME * np.maximum(carried, load)):
            raise InputError(
                f"gap = {shown(gap)} carries the normal load {shown(carried.tolist())}, but normal_load = "
                f"{shown(load.tolist())} is given too; give one of them"
            )
        return gap
    if np.any((kn == 0) & (load > 0)):
        raise InputError(f"kn = 0 cannot carry the normal load {shown(load.tolist())}; give kn > 0")
    found = np.divide(-load, kn, out=np.zeros(np.broadcast_shapes(kn.shape, load.shape)), where=(load > 0) & (kn > 0))
    return _checked("gap", found)
