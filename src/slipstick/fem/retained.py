"""Retained dofs of a finite element model that is to be reduced: directions with names and places, loads, contacts.

All three directions of every contact point are retained, so that rubbing direction and contact law can change without a
new reduction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_array, csr_array, hstack

from slipstick.errors import Fault, InputError
from slipstick.faults import count_or_numbers, shown, whole, wrong
from slipstick.fem.axis import Axis
from slipstick.fem.boundary import skin_of, surface_towards
from slipstick.fem.conduction import LinearSolver, conductance, default_solver, influence_matrix
from slipstick.fem.contact_points import ContactPatches, ContactPoints, WeightedPoints, contact_patches, spread_nodes
from slipstick.fem.cyclic import turned
from slipstick.fem.expansion import TemperatureFields
from slipstick.fem.loads import pressure_load
from slipstick.fem.mesh import Mesh, Surface, node_indices
from slipstick.fem.model import FiniteElementModel
from slipstick.fem.moved_supports import MovedSupports
from slipstick.fem.rotation import centrifugal_forces
from slipstick.fem.strains import chosen_elements, strain_matrix
from slipstick.structure.protocol import CENTRIFUGAL
from slipstick.structure.reduction.reduce import SkinRows, StrainRows
from slipstick.typing import Array, Reals

_OPPOSITE = 0.1
"""Distance of opposite contact points of neighbours that is accepted, over the root of a point's area."""

_NODES_A_CONTACT, _MOST_AT_CONTACTS = 4, 45_000
"""Nodes of the surface mesh that show each contact, where the mesh has them; nodes at all contacts, at most."""


@dataclass(frozen=True, kw_only=True)
class Retained:
    """Retained dofs, loads and contact points of a model.

    Attributes
    ----------
    model
        The full model, n rows.
    directions
        Sparse (n, n_keep); the motion of each is its column times that of the rows.
    names, places
        Of the directions, (n_keep,), and their positions, (n_keep, 3), nan where they have none.
    loads
        Force on the rows (n,) by load shape.
    sides
        Contact points by the start of their names: "c" on the surface of a body, "h" and "l" of a sector towards its
        neighbours, then those of pairs of surfaces. The directions begin with theirs, in this order.
    surface
        The surface of the points "c".
    moved
        Supports that move.
    """

    model: FiniteElementModel
    directions: csc_array
    names: tuple[str, ...]
    places: Array
    loads: Mapping[str, Array]
    sides: Mapping[str, ContactPoints]
    surface: Surface | None = None
    moved: MovedSupports | None = None

    @property
    def points(self) -> ContactPoints | None:
        """The contact points on the surface; their influence is None without films and a cold set."""
        return self.sides.get("c")

    @property
    def K(self) -> csr_array:
        """Stiffness of the full model, (n, n)."""
        return self.model.K

    @property
    def M(self) -> csr_array:
        """Mass of the full model, (n, n)."""
        return self.model.M

    @cached_property
    def skin(self) -> SkinRows | None:
        """The surface mesh of the body, for pictures; None of a model without the mesh of its rows."""
        try:
            self.model.in_mesh("a skin")
        except InputError:
            return None
        on, count = (None, 0) if self.surface is None else (self.surface.nodes, self.sides["c"].count)
        return skin_rows(self.model, self.places, on, count, self.moved)

    @property
    def request(self) -> dict[str, Any]:
        """Keywords ``keep``, ``names``, ``load_shapes`` and ``skin`` for ``reduce_model``."""
        return {"keep": self.directions, "names": self.names, "load_shapes": dict(self.loads), "skin": self.skin}


@dataclass(frozen=True, kw_only=True)
class Neighbours:
    """Surfaces of a sector that touch those of its neighbours.

    Attributes
    ----------
    low, high
        Names of the surfaces.
    contacts
        How many points, or node labels (n,) or positions (n, 3) on the high one.
    axis, turn
        Of the disc; rotation (3, 3) from a sector to the next one.
    """

    low: str
    high: str
    contacts: int | Reals
    axis: Axis
    turn: Array


def retain(
    model: FiniteElementModel,
    *,
    surface: str | Surface | Mapping[str, Any] | None = None,
    contacts: int | Reals = 8,
    radius: float | None = None,
    pressure: Mapping[str, str] | None = None,
    base: Sequence[str] = (),
    films: Mapping[str, float] | None = None,
    cold: str | None = None,
    keep: Sequence[str] = (),
    between: Neighbours | None = None,
    pairs: Sequence[WeightedPoints] = (),
    temperature: TemperatureFields | None = None,
    displacement: MovedSupports | None = None,
    centrifugal: Axis | None = None,
    solve: LinearSolver = default_solver,
) -> Retained:
    """Retained dofs of a constrained model: the motion of contact points, then that of named dofs.

    Parameters
    ----------
    surface, contacts, radius
        Contacts: how many spread uniformly over the surface, or node labels, or positions (n, 3); see
        ``contact_patches`` for the radius.
    pressure
        Load shapes ``{name: surface}``: unit pressure, positive into the body.
    base
        Directions "x", "y", "z" of a translation of the support: load shapes "base x", ...
    films
        Convection coefficient by surface, W/(m2 K), or for the "boundary"; with a conductivity it gives the influence
        matrix.
    cold
        Node set or surface whose temperature does not rise.
    keep
        Names of dofs.
    between
        Points towards the neighbours of a sector.
    pairs
        Points between two surfaces, whose motion is that of one surface less that of the other one.
    temperature
        Temperature fields: load shapes "temperature NAME".
    displacement
        Supports that move: load shapes "displacement NAME".
    centrifugal
        Axis of rotation: load shape "centrifugal".

    Raises
    ------
    InputError
        For unknown names and what the parts refuse.
    """
    loose = [dof for dof in model.loose_bolts if dof not in keep]
    if loose:
        what = f"has no {', '.join(loose)}: a bolt that is cut would be slack"
        raise InputError(Fault("keep", what, remedy="keep the shortenings of bolts: keep=[*bolts.keep, ...]"))
    patches, loads, on = dict[str, WeightedPoints](), dict[str, Array](), None
    if surface is not None or between is not None or pressure or pairs:
        mesh = model.in_mesh("contacts on a surface")
        if surface is not None:
            on = _surface(surface, mesh)
            patches["c"] = _patches(mesh, on, "contacts", contacts, radius)
        if between is not None:
            patches |= _facing(mesh, between, radius)
        patches |= {pair.points.side: pair for pair in pairs}
        loads = {name: model.restrict(pressure_load(mesh, mesh.surface(at))) for name, at in (pressure or {}).items()}
    sides = {side: replace(part.points, side=side) for side, part in patches.items()}
    if "c" in patches and (films or cold is not None):
        sides["c"] = replace(sides["c"], influence=_influence(model, patches["c"], films or {}, cold, solve))
    if displacement is not None:
        _require_apart(displacement, patches)
    columns = [*(_axes(model, part) for part in patches.values()), *([model.directions(keep)] if keep else [])]
    places = [*(np.repeat(side.positions, 3, axis=0) for side in sides.values()), model.dof_positions(keep)]
    return Retained(
        model=model,
        directions=csc_array(hstack(columns)) if columns else csc_array((model.n_dofs, 0)),
        names=(*(name for side in sides.values() for name in side.dofs), *keep),
        places=np.concatenate(places),
        loads=loads
        | ({} if temperature is None else temperature.loads(model))
        | ({} if displacement is None else dict(displacement.forces))
        | ({} if centrifugal is None else {CENTRIFUGAL: centrifugal_forces(model, centrifugal)})
        | {f"base {axis}": np.asarray(model.M @ model.translation(axis)) for axis in base},
        sides=sides,
        surface=on,
        moved=displacement,
    )


def _require_apart(displacement: MovedSupports, patches: Mapping[str, WeightedPoints]) -> None:
    """Refuse contacts on nodes of supports that move: they are held, and contacts feel what is free."""
    for name, motion in displacement.motions.items():
        moved = motion.reshape(-1, 3).any(axis=1).astype(float)
        for side, part in patches.items():
            touched = np.flatnonzero(abs(part.weights).T @ moved)
            if len(touched):
                what = f"{len(touched)} contacts lie on it, the first of them {side}{touched[0] + 1}"
                remedy = "move a support further away, or let the contact's nodes free"
                raise InputError(Fault(("displacement", name), what, remedy=remedy))


def _surface(wanted: str | Surface | Mapping[str, Any], mesh: Mesh) -> Surface:
    if isinstance(wanted, Surface):
        return wanted
    if isinstance(wanted, str):
        return mesh.surface(wanted)
    if "direction" not in wanted or set(wanted) - {"direction", "angle", "depth"}:
        expected = "a name, or direction with angle and depth"
        raise InputError(Fault("surface", found=shown(dict(wanted)), expected=expected))
    return surface_towards(mesh, **wanted)


def _patches(mesh: Mesh, on: Surface, name: str, contacts: int | Reals, radius: float | None) -> ContactPatches:
    at = _contact_nodes(name, contacts, mesh)
    return contact_patches(mesh, on, spread_nodes(mesh, on, at) if isinstance(at, int) else at, radius)


def _contact_nodes(name: str, wanted: int | Reals, mesh: Mesh) -> Any:
    """A number of nodes, indices of node labels, or positions."""
    expected = "how many, node labels (n,), or positions (n, 3)"
    places = count_or_numbers(name, wanted, expected)
    if isinstance(places, int):
        return places
    if (places.ndim != 1 and places.shape != (len(places), 3)) or not places.size:
        raise wrong(name, wanted, expected)
    if places.ndim == 2:
        return places
    labels = [whole(f"{name}, node label", label) for label in places]
    return node_indices(mesh.labels, np.array(labels), name)


def _axes(model: FiniteElementModel, patches: WeightedPoints) -> csc_array:
    """Columns x, y, z of each point."""
    n = patches.points.count
    axes = [patches.directions(np.tile(axis, (n, 1))) for axis in np.eye(3)]
    order = np.arange(3 * n).reshape(3, n).T.ravel()
    return csc_array(model.restrict(hstack(axes, format="csc")[:, order]))


def _facing(mesh: Mesh, between: Neighbours, radius: float | None) -> dict[str, ContactPatches]:
    """Points on the face towards the next sector, and those opposite on the low one."""
    low, high = mesh.surface(between.low), mesh.surface(between.high)
    patches = _patches(mesh, high, "between_contacts", between.contacts, radius)
    back = turned(between.axis, between.turn.T, patches.points.positions)
    try:
        opposite = contact_patches(mesh, low, back, float(patches.radii.max()) if radius else None)
    except InputError as error:
        raise InputError([fault.inside("between") for fault in error.faults]) from None
    distances = np.linalg.norm(opposite.points.positions - back, axis=1)
    size = np.sqrt(patches.points.areas)
    worst = int(np.argmax(distances / size))
    if distances[worst] > _OPPOSITE * size[worst]:
        statement = f"point {worst + 1} of '{between.high}' lies {distances[worst]:.3g} from '{between.low}'"
        remedy = "give surfaces of shrouds that touch, in the order low, high"
        raise InputError(Fault("between", f"{statement} of the next sector", remedy=remedy))
    return {"h": patches, "l": opposite}


def _influence(
    model: FiniteElementModel,
    patches: WeightedPoints,
    films: Mapping[str, float],
    cold: str | None,
    solve: LinearSolver,
) -> Array:
    mesh = model.in_mesh("heat of contacts")
    if model.dependence is not None or np.any(model.free < 0):
        reason = "some nodes depend on others (glued parts, rigid bodies), and heat is not conducted through those here"
        remedy = "mesh the body in one piece, or give the resistance of the contacts"
        raise InputError(Fault("films", reason, remedy=remedy))
    if model.conduction is None or not model.conduction.diagonal().max() > 0.0:
        what = "convection is given, but no material has a conductivity"
        raise InputError(Fault(statement=what, remedy="give one > 0, W/(m K)"))
    matrix = conductance(mesh, model.conduction, films)
    return influence_matrix(matrix, patches.weights, fixed=None if cold is None else mesh.node_set(cold), solve=solve)


def skin_rows(
    model: FiniteElementModel,
    places: Array | None = None,
    surface: Any = None,
    contacts: int = 0,
    moved: MovedSupports | None = None,
) -> SkinRows:
    """The surface mesh of a body, with its dofs, fine at the contacts on the nodes of a ``surface``.

    ``places`` (n_keep, 3) are those of the retained dofs.
    """
    mesh = model.in_mesh("a skin")
    nodes, triangles = skin_of(mesh, fine=surface, most_fine=min(_NODES_A_CONTACT * contacts, _MOST_AT_CONTACTS))
    held = {} if moved is None else moved.at_nodes(nodes)
    return SkinRows(nodes=mesh.nodes[nodes], triangles=triangles, rows=model.rows_of(nodes), places=places, held=held)


def strain_rows(
    model: FiniteElementModel,
    stress: Any,
    at: str,
    temperature: TemperatureFields | None = None,
    moved: MovedSupports | None = None,
) -> StrainRows:
    """Strains at chosen elements: "all", or their numbers, or names of element sets and surfaces.

    ``at`` is "elements" or "nodes"; see ``slipstick.fem.strains``.
    """
    mesh = model.in_mesh("stress")
    chosen = chosen_elements(mesh, stress)
    places, matrix = strain_matrix(mesh, model.materials, chosen, at)
    free = {} if temperature is None else temperature.free_strains(model, chosen, at)
    held = {} if moved is None else moved.seen(matrix)
    return StrainRows(places=places, rows=model.restrict(matrix), free=free, held=held)
