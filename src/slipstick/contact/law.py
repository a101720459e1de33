"""What a contact law is: ports, named parameters, and an answer to multiharmonic motion.

A port is a direction of relative motion with the force along it. Forces act ON the left-hand side of the structure's
equations: they resist the motion (THEORY.md (1.1)). The balance and everything round it know ports and names only,
so a new law is one class that has the members of ``Law``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol, TypeVar, runtime_checkable

from numpy.typing import ArrayLike

from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, Numbers

Key = TypeVar("Key", int, tuple[int, int])

ByPort = Mapping[int, Array]
"""Derivatives of the forces at some ports, (n, L) each; ports left out do not depend on it."""


def add_to(parts: dict[Key, Array], key: Key, part: Array) -> None:
    """Add to what stands under a key, or begin with it; no array is written on."""
    own = parts.get(key)
    parts[key] = part if own is None else own + part


class Motion(NamedTuple):
    """Relative motion of n elements at the ports of their law, the rubbing motion included."""

    harmonics: Harmonics
    omega: float | Array
    """Fundamental frequency, rad/s; (n,) where the elements belong to different solutions."""
    Q: tuple[Array, ...]
    """Coefficients (n, L) for each port, length; zero where an element does not have the port."""
    drift: Array
    """Constant velocity along each port over omega, (n_ports, n), length per rad."""
    swept: float | Array = 0.0
    """The part of it that stays as it is when omega changes, because the velocity grows with omega."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Response:
    """Forces of n elements with their exact derivatives, each at fixed other arguments. Ports are counted from 0."""

    force: tuple[Array, ...]
    """Coefficients (n, L) for each port, force."""
    by_motion: Mapping[tuple[int, int], Array]
    """``(i, j) -> dF_i/dQ_j`` (n, L, L); pairs left out are zero."""
    by_parameter: Callable[[str], ByPort]
    """``name -> {i: dF_i/dname}``."""
    by_drift: Mapping[tuple[int, int], Array] = field(default_factory=dict)
    """``(i, j) -> dF_i/ddrift_j`` (n, L)."""
    by_omega: ByPort = field(default_factory=dict)
    """``i -> dF_i/domega`` (n, L) at fixed motion and drift: of laws that feel velocities."""
    values: Mapping[str, Array]
    """The parameters it was computed with, (n,) each."""
    work: Array
    """Dissipated energy a period over 2 pi, (n,), force x length [THEORY.md (7.1)]."""
    detail: Any = None
    """What the law itself wants to find again."""


@runtime_checkable
class Law(Protocol):
    """A contact law with its parameters: numbers, or arrays (n,) for n elements.

    A law may have more, which is used where it is there: see ``slipstick.contact.traits``.
    """

    @property
    def ports(self) -> tuple[str, ...]:
        """Names of the ports, such as ("tangential", "normal")."""
        ...

    @property
    def values(self) -> Mapping[str, ArrayLike]:
        """Every parameter by name."""
        ...

    def changed(self, **values: Numbers) -> Law:
        """A copy with other parameters."""
        ...

    def respond(self, motion: Motion, values: Mapping[str, Array]) -> Response:
        """Forces of n elements whose parameters are ``values``, (n,) each."""
        ...
