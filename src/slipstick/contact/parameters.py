"""Parameters of friction contact elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.errors import InputError

LARGEST = 1e100
"""No stiffness, gap or coefficient of a machine is above it in any units; beyond, products overflow."""


@dataclass(frozen=True, kw_only=True)
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

    Raises
    ------
    InputError
        If a parameter is not finite, or kt, kn or mu is negative.

    Examples
    --------
    >>> float(FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0).normal_load)
    800.0
    """

    kt: ArrayLike
    mu: ArrayLike
    kn: ArrayLike = 1.0
    gap: ArrayLike = 0.0

    def __post_init__(self) -> None:
        problems = []
        for name in ("kt", "mu", "kn", "gap"):
            value = np.asarray(getattr(self, name), dtype=float)
            if not np.all(np.isfinite(value)):
                problems.append(f"{name}: found {value}; expected finite numbers")
            elif np.any(np.abs(value) > LARGEST):
                problems.append(f"{name}: found {value}; expected a number below {LARGEST:g}: check the units")
            elif name != "gap" and np.any(value < 0):
                problems.append(f"{name}: found {value}, negative; expected a value >= 0")
        if problems:
            raise InputError(problems)

    @property
    def normal_load(self) -> NDArray[np.float64]:
        """Static preload at ``y = 0``: ``kn max(-gap, 0)``."""
        return np.asarray(self.kn, dtype=float) * np.maximum(-np.asarray(self.gap, dtype=float), 0.0)
