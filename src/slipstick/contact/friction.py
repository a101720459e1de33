"""Friction contact elements: their parameters, and their forces at given motion."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.forces import ContactForces, element_forces, one_element_forces
from slipstick.contact.friction_law import FrictionLaw
from slipstick.contact.law import default
from slipstick.contact.rubbing import RubbingMotion
from slipstick.errors import IS_MISSING, Fault, InputError
from slipstick.faults import LARGEST, Gathering, frequency, number_or_numbers, numbers, one, plain, same_length, shown
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, Frequency, Numbers, Orders, Reals

_SAME_LOAD = 1e-9
"""Relative difference of normal loads by gap and as given that is rounding."""


@dataclass(frozen=True, init=False, repr=False)
class FrictionContact(FrictionLaw):
    """Parameters of one friction contact element, or of many (arrays of shape (n_elements,)).

    Normal force ``f_y = kn max(y - gap, 0)``, friction limit ``mu f_y``, tangential stiffness ``kt`` while stuck
    (THEORY.md (2.1), (2.2)). A negative gap is an interference: the static preload is ``N0 = -kn gap``.

    Parameters
    ----------
    kt
        Tangential contact stiffness, force/length, >= 0.
    kn
        Normal contact stiffness, force/length, >= 0. By default 1, a mere scale of the gap: a contact that moves along
        its normal needs it.
    mu
        Friction coefficient, >= 0. Without both kt and mu it is a stop, which needs no tangential direction. With kt it
        may be left to ``ss.surface_pair``, which takes that of the imported model; nothing else is computed without it.
    gap
        Gap (> 0) or interference (< 0), length.
    normal_load
        The static preload, force, >= 0, instead of ``gap``: it becomes ``gap = -normal_load / kn``. One of the two is
        needed. What is kept is the gap: a copy with another ``kn`` has another normal load.
    rest
        Tangential motion, length, at which the stuck contact has no friction force, as ``ss.preload`` leaves it. While
        it sticks all period its mean force is ``kt (x - rest)``, as far as friction admits; motion in time begins in
        equilibrium with that force. None: the middle of what friction admits; motion in time begins without force.

    Raises
    ------
    InputError
        If a parameter is not finite, or kt, kn, mu or the normal load is negative; if neither gap nor normal load is
        given, or both and they contradict each other; if numbers of elements differ.

    Examples
    --------
    >>> FrictionContact(kt=100.0, mu=0.3, kn=2.0, normal_load=800.0)
    FrictionContact(kt=100.0, mu=0.3, kn=2.0, normal_load=800.0)
    >>> float(FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0).normal_load)
    800.0
    """

    kt: Numbers
    mu: Numbers
    kn: Numbers
    gap: Numbers
    rest: Numbers | None
    _scaled: ClassVar[bool]
    """Whether kn was not given (set for each object; no parameter)."""
    _loaded: ClassVar[bool] = False
    """Whether a normal load was given, and no gap."""
    _stop: ClassVar[bool]
    """Whether kt and mu were not given."""
    lacks_mu: ClassVar[bool] = False
    """Whether kt was given and mu was not."""

    def __init__(
        self,
        *,
        kt: Reals | None = None,
        mu: Reals | None = None,
        kn: Reals | None = None,
        gap: Reals | None = None,
        normal_load: Reals | None = None,
        rest: Reals | None = None,
    ) -> None:
        object.__setattr__(self, "_scaled", kn is None)
        object.__setattr__(self, "_loaded", gap is None)
        object.__setattr__(self, "_stop", kt is None and mu is None)
        object.__setattr__(self, "lacks_mu", kt is not None and mu is None)
        kt = 0.0 if self._stop else kt
        mu = 0.0 if self._stop or self.lacks_mu else mu
        arguments = {"kt": kt, "mu": mu, "kn": 1.0 if kn is None else kn, "gap": gap, "normal_load": normal_load}
        arguments["rest"] = rest
        values, checks = {}, Gathering()
        for name, value in arguments.items():
            if value is not None or name not in ("gap", "normal_load", "rest"):
                values[name] = checks.take(_checked, name, value)
        if gap is None and normal_load is None:
            checks.faults.append(
                Fault(
                    statement="the normal load is missing",
                    remedy="give normal_load=800.0, or gap=-800.0 (interference) with kn=1.0",
                )
            )
        checks.end()
        checks.take(same_length, "friction contact", values)
        checks.end()
        load = values.pop("normal_load", None)
        if load is not None:
            values["gap"] = _gap(values["kn"], values.get("gap"), load)
        for name, value in {"rest": None, **values}.items():
            object.__setattr__(self, name, value)

    @property
    def normal_load(self) -> NDArray[np.float64]:
        """Static preload at ``y = 0``: ``kn max(-gap, 0)``."""
        return np.asarray(self.kn, dtype=float) * np.maximum(-np.asarray(self.gap, dtype=float), 0.0)

    @default
    def values(self) -> Mapping[str, Numbers]:
        """Every parameter by name."""
        own = {"kt": self.kt, "mu": self.mu, "kn": self.kn, "gap": self.gap}
        return own if self.rest is None else {**own, "rest": self.rest}

    @default
    def kind(self) -> str:
        """Contacts of which the motion without tangential force is known are computed by themselves."""
        return "friction" if self.rest is None else self.kind_at_rest

    @default
    def linear_states(self) -> tuple[str, ...]:
        """After load steps most contacts are closed, whatever their gaps are."""
        usual = FrictionLaw.linear_states
        return usual if self.rest is None else ("pressed", *usual)

    def __repr__(self) -> str:
        shown: dict[str, Any] = {"kt": self.kt, "mu": self.mu, "kn": self.kn}
        if self._scaled:
            del shown["kn"]
        if self._stop:
            del shown["kt"]
        if self._stop or self.lacks_mu:
            del shown["mu"]
        again = {**shown, "normal_load": self.normal_load}
        shown |= {} if self.rest is None else {"rest": self.rest}
        again |= {} if self.rest is None else {"rest": self.rest}
        if self._loaded and self._makes_equal(again):
            shown = again
        else:
            shown["gap"] = self.gap
        return f"{type(self).__name__}({', '.join(f'{name}={plain(value)}' for name, value in shown.items())})"

    def _makes_equal(self, arguments: Mapping[str, Numbers]) -> bool:
        """Whether such arguments make the same contact."""
        return bool(np.array_equal(type(self)(**arguments).gap, self.gap))

    def changed(self, **values: Reals) -> FrictionContact:
        """A copy with other parameters; a normal load becomes a gap at the present ``kn``."""
        numbers: dict[str, Any] = {**self.values, **({"kn": None} if self._scaled else {}), **values}
        if self._stop and not {"kt", "mu"} & set(values):
            del numbers["kt"], numbers["mu"]
        if self.lacks_mu and "mu" not in values:
            del numbers["mu"]
        if "normal_load" in values:
            del numbers["gap"]
        new = type(self)(**numbers)
        object.__setattr__(new, "_loaded", "normal_load" in values or (self._loaded and "gap" not in values))
        return new

    @default
    def optional_ports(self) -> tuple[str, ...]:
        """The normal, whose load is constant then; without kt and mu the tangential port too."""
        frictionless = not (np.any(np.asarray(self.kt) != 0) or np.any(np.asarray(self.mu) != 0))
        return self.ports if frictionless else ("normal",)

    def missing(self, ports: set[str]) -> Iterator[Fault]:
        """Friction that was not given, where something moves along the surface; a normal stiffness across it."""
        if self._stop and "tangential" in ports:
            remedy = "give both; a stop without friction needs no tangential direction"
            yield Fault(statement="kt and mu are missing", remedy=remedy)
        if self.lacks_mu:
            yield Fault("mu", IS_MISSING, remedy="give the friction coefficient")
        if self._scaled and "normal" in ports:
            remedy = "give the normal contact stiffness: the contact, or its opposing surface, moves along the normal"
            yield Fault("kn", "is missing", remedy=remedy)


def _checked(name: str, value: Any) -> Any:
    value = number_or_numbers(name, value)
    if name not in ("gap", "rest", "second_rest") and np.any(np.asarray(value) < 0):
        raise InputError(Fault(name, found=f"{shown(value)}, negative", expected="a value >= 0"))
    return value


def _gap(kn: Any, gap: Any, load: Any) -> Any:
    """The gap that carries a normal load; where a gap is given too, that one if both agree."""
    kn, load = np.asarray(kn), np.asarray(load)
    if gap is not None:
        carried = kn * np.maximum(-np.asarray(gap), 0.0)
        if np.any(np.abs(carried - load) > _SAME_LOAD * np.maximum(carried, load)):
            raise InputError(
                Fault(
                    statement=f"gap = {shown(gap)} carries the normal load {shown(carried.tolist())}, but "
                    f"normal_load = {shown(load.tolist())} is given too",
                    remedy="give one of them",
                )
            )
        return gap
    if np.any(kn * LARGEST < load):
        raise InputError(
            Fault(
                statement=f"kn = {shown(kn.tolist())} is too small to carry the normal load {shown(load.tolist())}",
                remedy="give a larger kn",
            )
        )
    clearance = np.divide(
        -load, kn, out=np.zeros(np.broadcast_shapes(kn.shape, load.shape)), where=(load > 0) & (kn > 0)
    )
    return _checked("gap", clearance)


def _coefficients(name: str, value: Reals, size: int) -> Array:
    array = numbers(name, value, "finite real coefficients")
    if array.shape[-1:] != (size,) or array.ndim > 2:
        raise InputError(Fault(name, found=f"shape {array.shape}", expected=f"({size},) or (n_elements, {size})"))
    return array


_AT_REST = RubbingMotion()


def contact_forces(
    contact: FrictionContact,
    harmonics: Orders,
    X: Reals,
    Y: Reals,
    *,
    omega: Frequency,
    rubbing: RubbingMotion | None = None,
) -> ContactForces:
    """Exact multiharmonic forces of friction contact elements, with all derivatives (THEORY.md sections 2 to 7).

    Parameters
    ----------
    contact
        Parameters, scalars or (n_elements,).
    harmonics
        The harmonic set, L coefficients; orders, or a count, will do.
    X, Y
        Coefficients of the relative tangential and normal motion (node 1 minus node 2), length;
        (L,) or (n_elements, L).
    omega
        Fundamental frequency, rad/s, > 0.
    rubbing
        Prescribed rubbing motion; none by default.

    Returns
    -------
    ContactForces
        Shapes (..., L) and (..., L, L); no leading axis where everything given is a single element.

    Raises
    ------
    InputError
        For wrong shapes, values that are not finite real numbers, or ``omega <= 0``.

    Examples
    --------
    Full slip: the friction force is ``mu N`` in the direction of the rubbing motion.

    >>> import numpy as np
    >>> contact = FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0)
    >>> h = Harmonics(range(4))
    >>> rub = RubbingMotion(velocity=9.0)
    >>> f = contact_forces(contact, h, [0, 0, 1, 0, 0, 0, 0], np.zeros(7), omega=2.0, rubbing=rub)
    >>> f.Fx.round(12).tolist(), f.states, float(f.power.round(9))
    ([240.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [(0.0, 6.283185307179586, 'slip+')], 2160.0)
    """
    contact = one("contact", contact, FrictionContact, "an ss.FrictionContact")
    if "second" in contact.ports:
        remedy = (
            "ask the law: contact.respond(motion, values), slipstick.contact.law.Motion has the motion of all ports"
        )
        raise InputError(Fault("contact", "slides in two directions, and X is motion along one", remedy=remedy))
    if contact.lacks_mu:
        raise InputError(list(contact.missing({"tangential"})))
    if contact.rest is not None:
        remedy = "ask the law: contact.respond(motion, values), or leave rest out"
        raise InputError(
            Fault("contact", "has rest, which the forces of a single element do not take into account", remedy=remedy)
        )
    rubbing = _AT_REST if rubbing is None else one("rubbing", rubbing, RubbingMotion, "an ss.RubbingMotion")
    harmonics, omega = Harmonics.of(harmonics), frequency("omega", omega)
    X, Y = _coefficients("X", X, harmonics.size), _coefficients("Y", Y, harmonics.size)
    U, N = rubbing.coefficients(harmonics), rubbing.normal_coefficients(harmonics)
    parts = velocity, swept, kt, mu, kn, gap = (
        rubbing.velocity, rubbing.velocity_per_omega, contact.kt, contact.mu, contact.kn, contact.gap
    )  # fmt: skip
    v = velocity / omega
    if X.ndim + Y.ndim + U.ndim + N.ndim > 4 or any(isinstance(part, np.ndarray) for part in parts):
        lead = [array.shape[:-1] for array in (X, Y, U, N)]
        lead += [part.shape for part in parts if isinstance(part, np.ndarray)]
        many = (*_elements(lead), harmonics.size)
        X, Y = np.broadcast_to(X + U, many), np.broadcast_to(Y + N, many)
        values = {"v": v + swept, "kt": kt, "mu": mu, "kn": kn, "gap": gap}
        arrays = {name: np.asarray(value, dtype=float) for name, value in values.items()}
        f = element_forces(harmonics, X, Y, **arrays)
    else:
        f = one_element_forces(harmonics, X + U, Y + N, np.array((v + swept, kt, mu, kn, gap)))
    f.omega, f._v = omega, v
    return f


def _elements(lead: Sequence[tuple[int, ...]]) -> tuple[int, ...]:
    """Number of elements, as the shape of an array, of what is given for one or for all of them."""
    try:
        return np.broadcast_shapes(*lead)
    except ValueError:
        raise InputError(
            Fault(
                "contact forces",
                "numbers of elements do not agree",
                remedy=f"found {[s for s in lead if s]} in X, Y, U, parameters",
            )
        ) from None
