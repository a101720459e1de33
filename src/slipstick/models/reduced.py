"""Common parts of reduced bodies and sectors: contact points by side, and checks of their options."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from slipstick.errors import Fault, InputError, Where
from slipstick.faults import (
    SMALLEST,
    Gathering,
    frequency,
    names,
    number,
    several,
    shown,
    suggestion,
    table,
    text,
    truth,
    whole,
)
from slipstick.fem.axis import Axis
from slipstick.fem.contact_points import ContactPoints
from slipstick.fem.mesh import Surface, user_names
from slipstick.fem.model import FiniteElementModel
from slipstick.models.surface_pair import SurfacePair
from slipstick.structure.matrix_checks import is_symmetric, symmetric_part
from slipstick.structure.reduction.request import relative_error, tools
from slipstick.typing import Array


@dataclass(frozen=True, kw_only=True)
class ReducedModel:
    """A reduced finite element model: see ``ReducedBody`` and ``ReducedSector``."""

    points: ContactPoints | None = field(repr=False)
    n_dofs: int
    source: str
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    axis: Axis | None = None

    @property
    def sides(self) -> dict[str, ContactPoints]:
        """Contact points by the letter of their names: "c" those on the surface."""
        return {} if self.points is None else {"c": self.points}

    def cosines(self, side: str, vectors: Array) -> list[dict[str, float]]:
        """Motion at the points of a side along unit vectors (n, 3), by dof, one dict a point."""
        return self.sides[side].cosines(vectors)


def checked_options(gathering: Gathering, **given: Any) -> dict[str, Any]:
    """Checked options that bodies and sectors share, with pressures by load shape and keep as names; gathers faults."""
    surface = given["surface"]
    if not (surface is None or isinstance(surface, str | Surface)):
        surface = gathering.take(table, "surface", surface, 'the name of a surface, or {"direction": (0, 1, 0)}')
    pressure = {"pressure": given["pressure"]} if isinstance(given["pressure"], str) else given["pressure"]
    shapes = gathering.optional(table, "pressure", pressure, "a surface, or surfaces by load shape") or {}
    for name, on in shapes.items():
        gathering.take(text, ("pressure", name), on, "the name of a surface")
    options = {
        "surface": surface,
        "contacts": given["contacts"],
        "radius": gathering.optional(number, "radius", given["radius"], "a length > 0", above=SMALLEST),
        "pressure": shapes,
        "keep": gathering.take(names, "keep", given["keep"]) or (),
        "pairs": gathering.take(several, "pairs", given["pairs"], SurfacePair, "what ss.surface_pair returns") or (),
        "modes": gathering.optional(whole, "modes", given["modes"], 1),
        "accuracy": gathering.optional(relative_error, "accuracy", given["accuracy"]),
        "up_to": gathering.optional(frequency, "up_to", given["up_to"]),
    }
    gathering.take(truth, "force", given["force"])
    gathering.take(tools, None, given["cache"], given["listener"])
    return options


def checked_fields(gathering: Gathering, temperature: object, initial: object) -> dict[str, Any]:
    """Temperature fields by name; gathers faults."""
    fields = gathering.optional(table, "temperature", temperature, "temperature fields by name") or {}
    if initial is not None and not fields:
        remedy = 'give the fields that act too: temperature={"hot": 120.0}'
        gathering.faults.append(Fault("initial_temperature", "is given without temperature", remedy=remedy))
    return fields


def mode_faults(options: Mapping[str, Any]) -> Iterator[Fault]:
    """A number of modes that is given in two ways, or an accuracy without its range."""
    modes, accuracy, up_to = options["modes"], options["accuracy"], options["up_to"]
    other = "up_to" if accuracy is None else "accuracy"
    if modes is not None and options[other] is not None:
        yield Fault("modes", f"both modes and {other} are given", remedy="keep one")
    if accuracy is not None and up_to is None:
        yield Fault("accuracy", "is given without up_to", remedy="give the highest frequency of that accuracy")


def require_names(
    model: FiniteElementModel, options: Mapping[str, Any], *, between: Sequence[str] = (), others: Sequence[Fault] = ()
) -> None:
    """InputError with ``others``, and every surface, set and dof that is not in the model."""
    faults = [*others, *_dof_faults(model, options["keep"]), *_surface_faults(model, options, between)]
    faults += _pair_faults(model, options["pairs"])
    if faults:
        raise InputError(faults)


def _dof_faults(model: FiniteElementModel, keep: Sequence[str]) -> Iterator[Fault]:
    for name in keep:
        if not model.has_direction(name):
            yield Fault("keep", f"there is no free dof '{name}' in the model", remedy=_names_like(model, name))


def _names_like(model: FiniteElementModel, name: str) -> str:
    """What dofs are called, or the surface or node set whose name is close."""
    sets = user_names({**model.node_sets, **({} if model.mesh is None else model.mesh.surfaces)})
    of, _, axis = name.rpartition(" ")
    if axis in ("x", "y", "z") and (close := suggestion(of, sets)).startswith("did"):
        return close
    means = f', or "{sets[0]} x", the mean of a surface or node set' if sets else ""
    return f"names look like {', '.join(model.dofs[:3])}{means}"


def _pair_faults(model: FiniteElementModel, pairs: Sequence[SurfacePair]) -> Iterator[Fault]:
    called = [pair.name for pair in pairs]
    for name in sorted({name for name in called if called.count(name) > 1}):
        yield Fault("pairs", f"two are called '{name}'", remedy="give each its own name")
    for pair in pairs:
        n_nodes = pair.facing.weights.shape[0]
        if model.mesh is None or model.mesh.n_nodes != n_nodes:
            what = f"'{pair.name}' was made of another model, with {n_nodes} nodes"
            yield Fault("pairs", what, remedy="give ss.surface_pair this model")


def _surface_faults(model: FiniteElementModel, options: Mapping[str, Any], between: Sequence[str]) -> Iterator[Fault]:
    if model.mesh is None:
        return
    known, sets = user_names(model.mesh.surfaces), {*model.mesh.node_sets, *model.mesh.surfaces}
    named: dict[Where, str] = {("surface",): options["surface"]} if isinstance(options["surface"], str) else {}
    named |= {("pressure", shape): on for shape, on in options["pressure"].items()}
    named |= {("between", k): name for k, name in enumerate(between)}
    named |= {("films", name): name for name in options.get("films", ()) if name != "boundary"}
    for where, name in named.items():
        if name not in model.mesh.surfaces:
            films = where[0] == "films"
            remedy = suggestion(name, [*known, "boundary"] if films else known)
            yield Fault("films" if films else where, f"there is no surface '{name}' in the model", remedy=remedy)
    cold = options.get("cold")
    if cold is not None and cold not in sets:
        yield Fault("cold", f"there is no node set '{cold}' in the model", remedy=suggestion(cold, user_names(sets)))


_SKEW_ROUNDING = 1e-12
"""Largest entry of the symmetric part of a skew-symmetric matrix, over that of the matrix: rounding of its assembly."""


def damping_warnings(model: FiniteElementModel, modes: str = "real modes", otherwise: str = "") -> Iterator[str]:
    """Warnings of a damping matrix, which a reduction to ``modes`` leaves out.

    ``otherwise`` names the way that keeps Coriolis forces.
    """
    if model.C is None or not model.C.nnz:
        return
    if not is_symmetric(model.C):
        yield f"{model.source}: holds Coriolis forces, which a reduction to {modes} leaves out{otherwise}"
    if abs(symmetric_part(model.C)).max() > _SKEW_ROUNDING * abs(model.C).max():
        yield (
            f"{model.source}: holds a damping matrix, which a reduction to {modes} does not use; give "
            "loss_factor or damping_ratio"
        )


def two_surfaces(name: str, given: Any) -> tuple[str, ...]:
    """Two surfaces, low and high; none of None."""
    if given is None:
        return ()
    if not (isinstance(given, list | tuple) and len(given) == 2 and all(isinstance(part, str) for part in given)):
        expected = 'two surfaces, low and high, such as ("shroud_low", "shroud_high")'
        raise InputError(Fault(name, found=shown(given), expected=expected))
    return tuple(given)
