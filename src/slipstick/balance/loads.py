"""Loads of a problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2, cos, hypot, sin
from typing import Any

from slipstick.faults import Gathering, number, shown, text, whole


@dataclass(frozen=True, init=False)
class Load:
    """A periodic force ``cos * cos(m tau) + sin * sin(m tau)`` on a dof, or times a load shape of the structure.

    Parameters
    ----------
    dof, shape
        Name of a dof, or of a load shape: one of the two.
    harmonic
        Harmonic ``m`` of the excitation; 0 is a static load, given by ``cos``.
    cos, sin
        Amplitudes, force (0-to-peak).
    amplitude, phase
        Instead of cos and sin: ``amplitude * cos(m tau + phase)``, phase in rad, 0 where it is left out.

    Raises
    ------
    InputError
        For values of another kind, an amplitude together with cos or sin, or a phase without amplitude.

    Examples
    --------
    >>> from math import pi
    >>> load = Load(dof="x", amplitude=100.0, phase=-pi / 2)
    >>> round(load.cos, 9), load.sin
    (0.0, 100.0)
    """

    dof: str | None
    shape: str | None
    harmonic: int
    cos: float
    sin: float

    def __init__(
        self,
        *,
        dof: str | None = None,
        shape: str | None = None,
        harmonic: int = 1,
        cos: float | None = None,
        sin: float | None = None,
        amplitude: float | None = None,
        phase: float | None = None,
    ) -> None:
        on = dof if dof is not None else shape
        name, found = f"load on {shown(on)}" if on is not None else "load", Gathering()
        given = {"cos": cos, "sin": sin, "amplitude": amplitude, "phase": phase}
        force = {k: found.take(number, f"{name}, {k}", v) for k, v in given.items() if v is not None}
        values: dict[str, Any] = {"harmonic": found.take(whole, f"{name}, harmonic", harmonic)}
        for key, value in (("dof", dof), ("shape", shape)):
            values[key] = None if value is None else found.take(text, f"load, {key}", value, "a name")
        if amplitude is not None and (cos is not None or sin is not None):
            found.problems.append(f"{name}: amplitude is given together with cos or sin; keep one way to say the force")
        if phase is not None and amplitude is None:
            found.problems.append(f"{name}: phase is given without amplitude; give both")
        found.end()
        values |= _parts(force)
        for key, value in values.items():
            object.__setattr__(self, key, value)

    @property
    def target(self) -> str:
        """Name of the dof or load shape."""
        return str(self.dof if self.dof is not None else self.shape)

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
