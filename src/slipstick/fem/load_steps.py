"""Load steps as the file of a model states them: kept for whoever solves them, without effect on the matrices."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import suggestion
from slipstick.fem.mesh import Mesh
from slipstick.fem.unit_systems import Conversion
from slipstick.typing import IntArray

Vector = tuple[float, float, float]

DIMENSIONS: Mapping[str, tuple[int, int, int]] = {
    "force": (1, 0, 0),
    "moment": (1, 1, 0),
    "pressure": (1, -2, 0),
    "body force": (1, -3, 0),
    "gravity": (0, 1, -2),
    "centrifugal": (0, 0, -2),
    "temperature": (0, 0, 0),
    "displacement": (0, 1, 0),
    "bolt force": (1, 0, 0),
    "bolt shortening": (0, 1, 0),
    "bolt locked": (0, 0, 0),
}
"""Kinds of loads, and the powers of force, length and time in their values."""


@dataclass(frozen=True, kw_only=True)
class StepLoad:
    """One load of a step, as a line of the file states it.

    Attributes
    ----------
    kind
        "force" or "moment" (each node), "pressure" (> 0 presses), "body force" (per volume), "gravity" (acceleration),
        "centrifugal" (square of the speed, rad/time), "temperature", "displacement" (of held nodes), "bolt force" (> 0
        pulls), "bolt shortening" or "bolt locked" (its shortening stays).
    where
        A set, a surface or a pretension section by name, or the label of a node or an element; empty: everything.
    value
        Its size, before the amplitude.
    axis
        1 to 3 of a force, moment or displacement, along the node's own directions where the file gives some; 0: none.
    direction, point
        Of gravity; of the axis that a centrifugal load has, through the point; of a body force.
    face
        Of the elements that a pressure acts on, 1 to 6 as the file counts; 0: a surface has them.
    amplitude
        Name of the curve over time that multiplies it; empty: the step's own.
    replaces
        Whether the loads of the same keyword in earlier steps end (``OP=NEW``).
    """

    kind: str
    where: str
    value: float = 0.0
    axis: int = 0
    direction: Vector | None = None
    point: Vector | None = None
    face: int = 0
    amplitude: str = ""
    replaces: bool = False

    def converted(self, factors: Conversion) -> StepLoad:
        """The load in other units; temperatures stay."""
        force, length, time = DIMENSIONS[self.kind]
        factor = factors.force**force * factors.length**length * factors.time**time
        x = self.point
        point = None if x is None else (factors.length * x[0], factors.length * x[1], factors.length * x[2])
        return replace(self, value=self.value * factor, point=point)


@dataclass(frozen=True, kw_only=True)
class LoadStep:
    """The loads that a step of the file adds or changes; those of earlier steps stay unless they are replaced.

    Attributes
    ----------
    procedure
        "static" or another one that loads the model; empty for others, and for what holds before the first step.
    large
        Whether displacements are large (``NLGEOM``).
    perturbation
        Whether its loads are small ones about the state of the step before.
    loads
        In the order of the file.
    """

    procedure: str = ""
    large: bool = False
    perturbation: bool = False
    loads: tuple[StepLoad, ...] = ()

    def converted(self, factors: Conversion) -> LoadStep:
        """The step in other units."""
        return replace(self, loads=tuple(load.converted(factors) for load in self.loads))

    @classmethod
    def of(cls, known: Mapping[str, Any]) -> LoadStep:
        """From the plain values of ``dataclasses.asdict``; ValueError or KeyError for others."""
        loads = []
        for each in known["loads"]:
            if each["kind"] not in DIMENSIONS or not isfinite(each["value"]):
                raise ValueError(f"a load of the kind {each['kind']}, {each['value']}")
            loads.append(
                StepLoad(
                    kind=str(each["kind"]), where=str(each["where"]), value=float(each["value"]),
                    axis=int(each["axis"]), direction=_vector(each["direction"]), point=_vector(each["point"]),
                    face=int(each["face"]), amplitude=str(each["amplitude"]), replaces=bool(each["replaces"]),
                )
            )  # fmt: skip
        flags = {name: bool(known[name]) for name in ("large", "perturbation")}
        return cls(procedure=str(known["procedure"]), loads=tuple(loads), **flags)


INITIAL = "INITIAL"
"""What holds before the first step."""


def acting(steps: Mapping[str, LoadStep], name: str, kind: str) -> list[StepLoad]:
    """Loads of a kind that act at the end of a step, in their order; a later one replaces those on the same nodes.

    InputError where there is no such step, or no such load in it and before it.
    """
    known = [other for other in steps if other != INITIAL or name == INITIAL]
    if name not in steps:
        with_some = [other for other in steps if any(load.kind == kind for load in steps[other].loads)]
        what = f"the file of the model has no load step '{name}'"
        raise InputError(Fault(statement=what, remedy=suggestion(name, with_some)))
    found: list[StepLoad] = []
    for other in known[: known.index(name) + 1]:
        own = [load for load in steps[other].loads if load.kind == kind]
        found = own if any(load.replaces for load in own) else found + own
    if not found:
        raise InputError(Fault(statement=f"no {kind} acts in the load step '{name}' of the file"))
    return found


def nodes_of(load: StepLoad, mesh: Mesh) -> IntArray:
    """Nodes of the mesh that a load acts on: all, those of a set, or one."""
    if not load.where:
        return np.arange(mesh.n_nodes)
    if load.where in mesh.node_sets or load.where in mesh.surfaces:
        return mesh.node_set(load.where)
    if load.where.isdigit():
        return np.flatnonzero(mesh.labels == int(load.where))
    raise InputError(Fault(statement=f"a load step of the file acts on '{load.where}', which the mesh does not have"))


def curve_warnings(source: str, steps: Mapping[str, LoadStep], named: Iterable[str], kind: str) -> Iterator[str]:
    """Whether curves over time multiply loads of the steps named: their values are taken as the lines give them."""
    for name in named:
        curves = sorted({load.amplitude for load in acting(steps, name, kind) if load.amplitude})
        if curves:
            yield (
                f"{source}: the {kind} of the load step '{name}' has the amplitude {', '.join(curves)}, which is left "
                "out: values are those of its lines"
            )


def _vector(values: Any) -> Vector | None:
    if values is None:
        return None
    x, y, z = map(float, values)
    return x, y, z
