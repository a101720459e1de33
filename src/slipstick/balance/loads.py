"""Loads of a problem."""

from __future__ import annotations

from collections.abc import Container, Hashable, Iterator, Mapping
from dataclasses import dataclass, field
from math import atan2, cos, hypot, pi, sin
from typing import Any

from slipstick.errors import Fault
from slipstick.faults import Gathering, number, table, text, warn, whole, wrong

MOTIONS = ("displacement", "acceleration")
"""What can be given of a support that moves."""

UNBALANCE = "unbalance"
"""What can be given on a dof instead of a force: its size over the square of its frequency."""


@dataclass(frozen=True, init=False, repr=False)
class Load:
    """A periodic force ``cos * cos(m tau) + sin * sin(m tau)`` on a dof, or times a load shape; or a moving support.

    A support that moves by ``u(t)`` is followed in coordinates relative to it: with ``r`` the motion of the dofs for a
    unit motion of the support as a rigid body, the absolute displacement is ``x + r u`` and

        M x'' + C x' + K x + f(x, x') = p - M r u''.

    All springs and dampers to ground (in K, C and the contacts, whose opposing surface moves with the support) then
    belong to the support. All results are relative to it, and say so. A displacement ``u`` of harmonic m makes the
    load ``(m omega)^2 M r u``, which grows with the square of the frequency, an acceleration ``u'' = a`` the load
    ``-M r a``; a constant acceleration ``-g`` is weight in the direction of ``r``.

    Parameters
    ----------
    dof
        Name of a dof that the force acts on. One of ``dof``, ``shape`` and ``base`` is given.
    shape
        Name of a load shape of the structure.
    base
        Motion of a support: ``r`` as a dict of dofs such as ``{"x1": 1.0, "x2": 1.0}``, which needs the mass matrix
        (``MatrixStructure``); or a name such as "x", which stands for the load shape "base x" of a reduced structure,
        ``M r``, or else for the dof of that name.
    motion
        With ``base``: "displacement" or "acceleration", what ``cos``, ``sin`` or ``amplitude`` give of the support.
        With ``dof``: "unbalance", mass times eccentricity: harmonic m is the force ``(m omega)^2`` times that.
    harmonic
        Harmonic ``m`` of the excitation; 0 is a static load, given by ``cos``.
    cos, sin
        Amplitudes (0-to-peak): force, of a support length or length/time^2.
    amplitude, phase
        Instead of cos and sin: ``amplitude * cos(m tau + phase)``, phase in rad, 0 where it is left out.

    Raises
    ------
    InputError
        For values of another kind, an amplitude together with cos or sin, a phase without amplitude, base without
        motion or the reverse.

    Examples
    --------
    >>> from math import pi
    >>> load = Load(dof="x", amplitude=100.0, phase=-pi / 2)
    >>> round(load.cos, 9), load.sin
    (0.0, 100.0)
    >>> Load(base={"x": 1.0}, motion="displacement", amplitude=1e-3).target
    'base'
    """

    dof: str | None
    shape: str | None
    base: Mapping[str, float] | str | None = field(hash=False)
    motion: str | None
    harmonic: int
    cos: float
    sin: float

    def __init__(
        self,
        *,
        dof: str | None = None,
        shape: str | None = None,
        base: Mapping[str, float] | str | None = None,
        motion: str | None = None,
        harmonic: int = 1,
        cos: float | None = None,
        sin: float | None = None,
        amplitude: float | None = None,
        phase: float | None = None,
    ) -> None:
        checks = Gathering()
        parts = {"cos": cos, "sin": sin, "amplitude": amplitude, "phase": phase}
        force = {k: checks.take(number, k, v) for k, v in parts.items() if v is not None}
        values: dict[str, Any] = {"harmonic": checks.take(whole, "harmonic", harmonic)}
        for key, value in (("dof", dof), ("shape", shape)):
            values[key] = None if value is None else checks.take(text, key, value, "a name")
        values["base"] = None if base is None else checks.take(_pattern, base)
        values["motion"] = None if motion is None else checks.take(_motion, motion)
        turning = values["motion"] == UNBALANCE and base is None
        present = {"base": base, "motion": None if turning else motion, **parts}
        checks.faults += way_faults({name for name, value in present.items() if value is not None})
        if turning and dof is None and shape is None:
            checks.faults.append(Fault("motion", "an unbalance is on no dof", remedy="give dof"))
        if values["motion"] == UNBALANCE and base is not None:
            expected = '"displacement" or "acceleration" of a support'
            checks.faults.append(Fault("motion", found='"unbalance"', expected=expected))
        on = next((name for name in (dof, shape, base) if isinstance(name, str)), None)
        checks.end(*(("load", on) if on is not None else ()))
        values |= _parts(force)
        for key, value in values.items():
            object.__setattr__(self, key, value)
        warn(phase_warnings(self.target, force.get("phase")))

    @property
    def target(self) -> str:
        """Name of the dof or load shape; "base" or "base x" of a support."""
        if self.base is not None:
            return f"base {self.base}" if isinstance(self.base, str) else "base"
        return str(self.dof if self.dof is not None else self.shape)

    def __repr__(self) -> str:
        values = {name: getattr(self, name) for name in ("dof", "shape", "base", "motion", "harmonic", "cos", "sin")}
        usual = {"harmonic": 1, "cos": 0.0, "sin": 0.0}
        said = (f"{name}={value!r}" for name, value in values.items() if value != usual.get(name))
        return f"Load({', '.join(said)})"

    @property
    def place(self) -> tuple[Hashable, ...]:
        """What it acts on; equal for loads that add up."""
        pattern = tuple(sorted(self.base.items())) if isinstance(self.base, Mapping) else self.base
        return self.dof, self.shape, pattern, self.motion

    @property
    def amplitude(self) -> float:
        """``amplitude`` in ``amplitude * cos(m tau + phase)``, force, >= 0."""
        return hypot(self.cos, self.sin)

    @property
    def phase(self) -> float:
        """``phase`` in ``amplitude * cos(m tau + phase)``, rad, from -pi to pi."""
        return atan2(-self.sin, self.cos)


def _parts(force: Mapping[str, Any]) -> dict[str, float]:
    """Cosine and sine parts of a force said in either way."""
    if "amplitude" not in force:
        return {"cos": force.get("cos", 0.0), "sin": force.get("sin", 0.0)}
    size, phase = force["amplitude"], force.get("phase", 0.0)
    return {"cos": size * cos(phase), "sin": -size * sin(phase) if phase else 0.0}


def phase_warnings(name: str, phase: float | None) -> Iterator[str]:
    """Whether the phase of a load, rad, looks like degrees."""
    if phase is not None and abs(phase) > _TURN:
        yield (
            f"load on '{name}': a phase of {phase:g} rad is more than a turn; was it meant in degrees? 90 degrees are "
            'pi/2 = 1.5708 rad, in a case file also "90 deg"'
        )


_TURN = 2.0 * pi * (1.0 + 1e-12)


def place_faults(present: Container[str]) -> Iterator[Fault]:
    """What is acted on is said once; ``present`` are the names of what is given."""
    first, *others = [name for name in ("dof", "shape", "base") if name in present] or [""]
    if not first:
        yield Fault(statement="where it acts is missing", remedy="give dof, shape or base, one of them alone")
    for name in others:
        yield Fault(name, f"is given together with {first}", remedy="keep one of them")


def way_faults(present: Container[str]) -> Iterator[Fault]:
    """What is said in two ways, or in half of one; ``present`` are the names of what is given."""
    for one, other in (("base", "motion"), ("motion", "base")):
        if one in present and other not in present:
            yield Fault(one, f"is given without {other}", remedy="give both for a support that moves")
    if "amplitude" in present and ("cos" in present or "sin" in present):
        yield Fault("amplitude", "is given together with cos or sin", remedy="keep one form of the force")
    if "phase" in present and "amplitude" not in present:
        yield Fault("phase", "is given without amplitude", remedy="give both")


def _pattern(base: Any) -> Mapping[str, float] | str:
    """Motion of the dofs for a unit motion of the support."""
    expected = 'dofs with their motion such as {"x1": 1.0, "x2": 1.0}, or a name such as "x"'
    if isinstance(base, str) and base:
        return text("base", base, expected)
    moved = {dof: number(("base", dof), c) for dof, c in table("base", base, expected).items()}
    if not any(moved.values()):
        raise wrong("base", base, expected)
    return moved


def _motion(motion: Any) -> str:
    """What is given of the support."""
    expected = '"displacement" or "acceleration", what is given of the support, or "unbalance" on a dof'
    if not isinstance(motion, str) or motion not in (*MOTIONS, UNBALANCE):
        raise wrong("motion", motion, expected)
    return motion
