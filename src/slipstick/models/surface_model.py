"""A meshed body with contacts on one of its surfaces, ready for reduction.

All three directions of every contact point are kept, so that rubbing direction and contact law can change without a
new reduction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import Fault, InputError
from slipstick.fem.boundary import skin_of
from slipstick.fem.conduction import LinearSolver, conductance, default_solver, influence_matrix
from slipstick.fem.contact_points import ContactPoints
from slipstick.fem.loads import pressure_load
from slipstick.fem.materials import Materials
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.model import FiniteElementModel, elastic_model
from slipstick.fem.strains import chosen_elements, strain_matrix
from slipstick.fem.surfaces import ContactPatches, contact_patches, spread_nodes
from slipstick.structure.reduction.reduce import SkinRows, StrainRows
from slipstick.typing import Array, IntArray

if TYPE_CHECKING:
    from scipy.sparse import csr_array


@dataclass(frozen=True, kw_only=True)
class ContactModel:
    """Matrices, contact directions, loads and thermal influence of a body with contacts against rigid ground.

    Attributes
    ----------
    model
        Constrained stiffness and mass.
    surface
        Where the contacts lie.
    patches
        Contact points, and where force and heat of each are spread.
    loads
        Full load vectors (n_free,) by name.
    """

    model: FiniteElementModel
    surface: Surface
    patches: ContactPatches
    loads: Mapping[str, Array]

    @property
    def points(self) -> ContactPoints:
        """The contact points; their influence is None when the body has no convection and nothing cold."""
        return self.patches.points

    @cached_property
    def directions(self) -> csr_array:
        """Directions of the kept degrees of freedom, sparse (n_free, 3 n_contacts)."""
        from scipy.sparse import hstack

        n = self.points.count
        axes = [self.patches.directions(np.tile(axis, (n, 1))) for axis in np.eye(3)]
        order = np.arange(3 * n).reshape(3, n).T.ravel()
        return self.model.restrict(hstack(axes, format="csc")[:, order])

    @property
    def request(self) -> dict[str, Any]:
        """Keywords ``keep``, ``names``, ``load_shapes`` and ``skin`` for ``reduce_model``."""
        named = {"names": self.points.dofs, "load_shapes": dict(self.loads)}
        places = np.repeat(self.points.positions, 3, axis=0)
        skin = skin_rows(self.model, places, self.surface.nodes, self.points.count)
        return {"keep": self.directions.tocsc(), **named, "skin": skin}


_NODES_A_CONTACT, _MOST_AT_CONTACTS = 4, 45_000
"""Of the skin on the surface where contacts lie: so many show each where the mesh has them, and so many are there at
most."""


def skin_rows(
    model: FiniteElementModel, places: Array | None = None, surface: IntArray | None = None, contacts: int = 0
) -> SkinRows:
    """The surface of a body, with its dofs: what shows its shape, and the contacts on the nodes of a ``surface``.

    ``places`` (n_keep, 3) are those of what is kept.
    """
    nodes, triangles = skin_of(model.mesh, fine=surface, most_fine=min(_NODES_A_CONTACT * contacts, _MOST_AT_CONTACTS))
    return SkinRows(
        nodes=model.mesh.nodes[nodes], triangles=triangles, rows=model.rows_of(nodes), places=places
    )  # fmt: skip


def strain_rows(model: FiniteElementModel, stress: Any, at: str) -> StrainRows:
    """Strains at chosen elements: "all", or their numbers, or names of element sets and surfaces.

    ``at`` is "elements" or "nodes"; see ``slipstick.fem.strains``.
    """
    places, matrix = strain_matrix(model.mesh, model.materials, chosen_elements(model.mesh, stress), at)
    return StrainRows(places=places, rows=model.restrict(matrix))


def contact_model(
    mesh: Mesh, materials: Materials, *, fixed: str | Sequence[str] | IntArray, surface: str, **options: Any
) -> ContactModel:
    """Assemble a mesh, fix it, and put contacts on a surface: ``elastic_model`` and then ``with_contacts``."""
    return with_contacts(elastic_model(mesh, materials, fixed), surface=surface, **options)


def with_contacts(
    model: FiniteElementModel,
    *,
    surface: str | Surface,
    contacts: int | ArrayLike = 8,
    radius: float | None = None,
    pressures: Mapping[str, str] | None = None,
    films: Mapping[str, float] | None = None,
    cold: str | None = None,
    solve: LinearSolver = default_solver,
) -> ContactModel:
    """Put contacts on a surface of a constrained model.

    Parameters
    ----------
    surface, contacts, radius
        Contacts: how many spread uniformly over the surface, or node indices, or positions (n, 3); see
        ``contact_patches`` for the radius.
    pressures
        Load shapes ``{name: surface}``: unit pressure, positive into the body.
    films
        Convection coefficient by surface, W/(m2 K), or for the "boundary"; with a conductivity it gives the influence
        matrix.
    cold
        Node set or surface whose temperature does not rise.

    Raises
    ------
    InputError
        For unknown names and what the parts refuse.
    """
    mesh = model.mesh
    where = mesh.surface(surface) if isinstance(surface, str) else surface
    loads = {name: pressure_load(mesh, mesh.surface(on)) for name, on in (pressures or {}).items()}
    at = spread_nodes(mesh, where, contacts) if isinstance(contacts, int) else contacts
    patches = contact_patches(mesh, where, at, radius)
    points = replace(patches.points, influence=_influence(model, patches, films or {}, cold, solve))
    return ContactModel(
        model=model,
        surface=where,
        patches=replace(patches, points=points),
        loads={name: model.restrict(load) for name, load in loads.items()},
    )


def _influence(
    model: FiniteElementModel,
    patches: ContactPatches,
    films: Mapping[str, float],
    cold: str | None,
    solve: LinearSolver,
) -> Array | None:
    if not films and cold is None:
        return None
    if model.dependence is not None or np.any(model.free < 0):
        reason = "some nodes depend on others (glued parts, rigid bodies), and heat is not led through that here"
        raise InputError(
            Fault("films", reason, remedy="mesh the body in one piece, or give the resistance of the contacts")
        )
    if model.conduction is None or not model.conduction.diagonal().max() > 0.0:
        raise InputError("convection is given, but no material has a conductivity; give one > 0, W/(m K)")
    matrix = conductance(model.mesh, model.conduction, films)
    fixed = None if cold is None else model.mesh.node_set(cold)
    return influence_matrix(matrix, patches.weights, fixed=fixed, solve=solve)
