"""Prescribed rubbing motion ``u = velocity t + periodic part``, and its common period with the excitation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import gcd, lcm
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.faults import Gathering, number_or_numbers, same_length, whole, wrong
from slipstick.trig.harmonics import Harmonics


@dataclass(frozen=True, kw_only=True)
class RubbingMotion:
    """Prescribed motion of the counter surface [Eq. 7]: ``u(t) = velocity t + sum cos_m cos(m omega t) + ...``

    The friction force pulls a soft structure towards ``x < 0`` where ``velocity > 0`` (THEORY.md section 2).

    Parameters
    ----------
    velocity
        Constant part, length per time; scalar or (n_elements,).
    cos, sin
        Amplitudes of the periodic part by harmonic order, length; order 0 is allowed in ``cos`` (an offset, which
        changes no force). Values are scalars or (n_elements,).

    Raises
    ------
    InputError
        If a value is not a finite number or an order is negative or not whole.
    """

    velocity: ArrayLike = 0.0
    cos: Mapping[int, ArrayLike] = field(default_factory=dict)
    sin: Mapping[int, ArrayLike] = field(default_factory=dict)

    def __post_init__(self) -> None:
        found = Gathering()
        values: dict[str, Any] = {"velocity": found.take(number_or_numbers, "rubbing velocity", self.velocity)}
        for part in ("cos", "sin"):
            values[part] = found.take(_amplitudes, f"rubbing {part}", getattr(self, part), least=int(part == "sin"))
        found.end()
        amplitudes = {f"{part} {order}": a for part in ("cos", "sin") for order, a in values[part].items()}
        same_length("rubbing motion", {"velocity": values["velocity"], **amplitudes})
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def orders(self) -> tuple[int, ...]:
        """Harmonic orders of the periodic part with a nonzero amplitude."""
        parts = (*self.cos.items(), *self.sin.items())
        return tuple(sorted({int(m) for m, value in parts if np.any(np.asarray(value) != 0)}))

    @property
    def moves(self) -> bool:
        """Whether there is any rubbing motion at all."""
        return bool(np.any(np.asarray(self.velocity) != 0) or any(m > 0 for m in self.orders))

    def coefficients(self, harmonics: Harmonics, order_factor: int = 1) -> NDArray[np.float64]:
        """Coefficients ``U`` of the periodic part, (L,) or (n_elements, L).

        ``order_factor`` turns harmonics of the rubbing motion into harmonics of the principal frequency.
        """
        shape = np.broadcast_shapes(*(np.shape(v) for v in (*self.cos.values(), *self.sin.values())), ())
        U = np.zeros((*shape, harmonics.size))
        for part, values in (("c", self.cos), ("s", self.sin)):
            for order, value in values.items():
                if np.any(np.asarray(value) != 0):
                    U[..., harmonics.index(int(order) * order_factor, part)] += value
        return U


def _amplitudes(name: str, given: Any, least: int) -> dict[int, Any]:
    """Amplitudes by whole order >= ``least``."""
    if not isinstance(given, Mapping):
        raise wrong(name, given, "amplitudes by harmonic such as {1: 2.0}")
    found, amplitudes = Gathering(), {}
    for order, value in given.items():
        at = found.take(whole, f"{name}, harmonic", order, least)
        amplitude = found.take(number_or_numbers, f"{name} {order}", value)
        if at is not None and amplitude is not None:
            amplitudes[at] = amplitude
    found.end()
    return amplitudes


def common_period(j1: int, j2: int) -> tuple[int, int]:
    """Harmonics of the principal frequency on which excitation and rubbing motion sit [Eqs. 2, 3].

    With periods in the ratio ``T_p / T_u = j1 / j2`` the response has the period ``T = (T_p / j1) lcm(j1, j2)``; the
    excitation sits on harmonic ``lcm / j1`` of ``2 pi / T`` and its multiples, the rubbing motion on ``lcm / j2``.

    >>> common_period(1, 1), common_period(2, 3), common_period(4, 2)
    ((1, 1), (3, 2), (1, 2))
    """
    j1, j2 = whole("period ratio", j1, 1), whole("period ratio", j2, 1)
    j1, j2 = j1 // gcd(j1, j2), j2 // gcd(j1, j2)
    common = lcm(j1, j2)
    return common // j1, common // j2
