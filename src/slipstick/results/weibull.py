"""The Weibull distribution of maxima: what the largest of many samples stay below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import gamma, log

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.typing import Array

FEWEST = 8
"""Samples from which a distribution is fitted."""
_SAME = 1e-9


@dataclass(frozen=True, kw_only=True)
class WeibullMaxima:
    """``F(a) = exp(-(1 - shape (a - place) / scale)^(1 / shape))``: extreme values, bounded above where shape > 0.

    That is the Weibull distribution of maxima: none is above ``place + scale / shape``.
    """

    shape: float
    place: float
    scale: float

    @property
    def upper(self) -> float:
        """The bound; inf where there is none."""
        return self.place + self.scale / self.shape if self.shape > 0.0 else float("inf")

    def percentile(self, percent: float) -> float:
        """What so many percent of the values stay below."""
        return self.place + self.scale * (1.0 - (-log(percent / 100.0)) ** self.shape) / self.shape

    @classmethod
    def fitted(cls, values: Sequence[float] | Array) -> WeibullMaxima:
        """By probability-weighted moments (Hosking, Wallis, Wood, Technometrics 27 (1985) 251).

        Raises
        ------
        InputError
            For fewer than 8 values, or values that are all equal.
        """
        a = np.sort(np.asarray(values, dtype=float))
        n, i = a.size, np.arange(a.size)
        if n < FEWEST or not np.ptp(a) > 0.0:
            raise InputError(Fault("values", found=f"{n} values", expected=f"at least {FEWEST} that differ"))
        b0, b1, b2 = a.mean(), (i * a).mean() / (n - 1), (i * (i - 1) * a).mean() / ((n - 1) * (n - 2))
        c = (2.0 * b1 - b0) / (3.0 * b2 - b0) - log(2.0) / log(3.0)
        shape = 7.8590 * c + 2.9554 * c * c
        shape = shape if abs(shape) > _SAME else _SAME
        scale = (2.0 * b1 - b0) * shape / (gamma(1.0 + shape) * (1.0 - 2.0**-shape))
        return cls(shape=float(shape), scale=float(scale), place=float(b0 + scale * (gamma(1.0 + shape) - 1.0) / shape))
