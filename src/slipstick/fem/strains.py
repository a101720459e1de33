"""Strain at chosen elements from the motion of all nodes: at their centroids, or at their nodes.

The strains at the points of the stiffness rule are fitted in each element by a field that is linear in it (trilinear in
hexahedra), weighted as the rule, and taken from that field: a linear strain is exact, and where the shape functions
have strains of higher degree those of the best points (Barlow, Int. J. Numer. Meth. Eng. 10 (1976) 243) count. At a
node it is the mean over the chosen elements of one material that meet there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from slipstick.errors import Fault, InputError
from slipstick.faults import shown, suggestion, whole
from slipstick.fem.assembly import chunks
from slipstick.fem.elements import ALIKE, ELEMENTS, FACES, LINEAR, Element
from slipstick.fem.geometry import solid_gradients
from slipstick.fem.materials import Materials, element_values
from slipstick.fem.mesh import Mesh, user_names
from slipstick.structure.strains import COMPONENTS, MOST_NUMBER, NODES, StrainPlaces
from slipstick.structure.strains import ELEMENTS as AT_ELEMENTS
from slipstick.typing import Array, IntArray

EVERY = "all"
"""In place of numbers and names."""

_WANTED = "numbers of elements, or names of element sets or surfaces"

_DERIVATIVES = ((0, 0, 0), (1, 1, 1), (2, 2, 2), (3, 0, 1), (3, 1, 0), (4, 1, 2), (4, 2, 1), (5, 2, 0), (5, 0, 2))
"""Component of the strain, of the motion, and along which it is derived."""


def chosen_elements(mesh: Mesh, wanted: str | int | Iterable[str | int]) -> dict[str, IntArray]:
    """Elements by type, ascending: "all", or numbers, names of element sets and of surfaces they have a face on.

    Raises
    ------
    InputError
        For numbers and names that are not there, one sentence each, and a number of several elements.
    """
    items: list[str | int] = [wanted] if isinstance(wanted, str | int | np.integer) else list(wanted)
    faults: list[Fault] = []
    parts: dict[str, list[IntArray]] = {kind: [] for kind in mesh.blocks}
    for name in (item for item in items if isinstance(item, str)):
        if name == EVERY and name not in mesh.element_sets:
            found = {kind: np.arange(len(block)) for kind, block in mesh.blocks.items()}
        elif name in mesh.element_sets:
            found = {kind: np.asarray(members) for kind, members in mesh.element_sets[name].items()}
        elif name in mesh.surfaces:
            found = _on_surface(mesh, name)
        else:
            known = user_names({*mesh.element_sets, *mesh.surfaces, EVERY})
            what = f"there is no element set or surface '{name}' in the model"
            faults.append(Fault("stress", what, remedy=suggestion(name, known)))
            continue
        for kind, members in found.items():
            parts[kind].append(members.astype(np.int64))
    given = [item for item in items if not isinstance(item, str)]
    numbers = np.array([whole("stress, element number", item, 0, MOST_NUMBER) for item in given], dtype=np.int64)
    faults += _take_numbers(mesh, np.unique(numbers), parts)
    if faults:
        raise InputError(faults)
    chosen = {kind: np.unique(np.concatenate(found)) for kind, found in parts.items() if found}
    chosen = {kind: members for kind, members in chosen.items() if len(members)}
    if not chosen:
        raise InputError(Fault("stress", found=shown(wanted), expected=_WANTED))
    return chosen


def _take_numbers(mesh: Mesh, numbers: IntArray, parts: dict[str, list[IntArray]]) -> Iterator[Fault]:
    times = np.zeros(len(numbers), dtype=int)
    ends = []
    for kind, block in mesh.blocks.items():
        labels = _labels(mesh, kind, np.arange(len(block)))
        found = np.isin(labels, numbers)
        parts[kind].append(np.flatnonzero(found))
        times += np.isin(numbers, labels)
        ends += [int(labels.min()), int(labels.max())] if len(labels) else []
    if not np.all(times):
        missing = numbers[times == 0]
        what = f"there is no element {missing[0]} in the mesh"
        if len(missing) > 1:
            what = f"{len(missing)} of the elements asked for are not in the mesh, the first of them {missing[0]}"
        yield Fault("stress", what, remedy=f"its elements have numbers from {min(ends)} to {max(ends)}")
    if np.any(times > 1):
        what = f"there are {times.max()} elements {numbers[np.argmax(times)]}, of different types"
        yield Fault("stress", what, remedy="name an element set or a surface")


def _labels(mesh: Mesh, kind: str, members: IntArray) -> IntArray:
    """Numbers of elements, as ``Mesh.element_label``."""
    return members + 1 if mesh.element_labels is None else np.asarray(mesh.element_labels[kind])[members]


def _on_surface(mesh: Mesh, name: str) -> dict[str, IntArray]:
    """Elements with a face on a surface."""
    found: dict[str, IntArray] = {}
    wanted = {
        kind: np.unique(np.sort(faces[:, : FACES[kind].n_corners], axis=1), axis=0)
        for kind, faces in mesh.surface(name).faces.items()
    }
    for element, block in mesh.items():
        touches = np.zeros(len(block), dtype=bool)
        for kind, local in element.faces:
            if kind in wanted and len(wanted[kind]):
                corners = np.sort(block[:, list(local[: FACES[kind].n_corners])], axis=1)
                touches |= _rows_in(corners, wanted[kind])
        found[element.name] = np.flatnonzero(touches)
    return found


def _rows_in(rows: IntArray, known: IntArray) -> NDArray[np.bool_]:
    """Whether each row (n, k) is one of the known ones (m, k), no two of which are alike."""
    _, inverse = np.unique(np.concatenate([known, rows]), axis=0, return_inverse=True)
    return np.asarray(np.isin(inverse.ravel()[len(known) :], inverse.ravel()[: len(known)]))


def strain_matrix(
    mesh: Mesh, materials: Materials, chosen: dict[str, IntArray], at: str = AT_ELEMENTS
) -> tuple[StrainPlaces, csc_array]:
    """Places, and what takes the strain there out of the motion of all nodes, sparse (3 n_nodes, 6 n_places).

    Raises
    ------
    InputError
        If an element is inside out or has no material.
    """
    part = _part(mesh, chosen)
    places, shares = _placed(mesh, materials, chosen, part, at)
    gradients, nodes, place = [], [], []
    for share in shares:
        block = part.blocks[share.element.name][share.rows]
        values = _gradients(part, share.element, share.rows, share.fit) / share.among[:, :, None, None]
        gradients.append(values.reshape(-1, 3))
        nodes.append(np.repeat(block, len(share.fit), axis=0).ravel())
        place.append(np.repeat(share.place.ravel(), share.element.n_nodes))
    return places, _strains(gradients, nodes, place, shape=(mesh.n_nodes, len(places.labels)))


def strain_values(
    mesh: Mesh, materials: Materials, chosen: dict[str, IntArray], at: str, strain: Mapping[str, Array]
) -> Array:
    """At the same places strains (6 n_places,) that are alike along all directions, from those at the points of the
    stiffness rule, (n_elements, n_points) by element type.
    """
    part = _part(mesh, chosen)
    places, shares = _placed(mesh, materials, chosen, part, at)
    found = np.zeros(len(places.labels))
    for share in shares:
        kind = share.element.name
        values = strain[kind][chosen[kind][share.rows]][:, : share.fit.shape[1]]
        np.add.at(found, share.place, values @ share.fit.T / share.among)
    return np.outer(found, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]).ravel()


class _Share(NamedTuple):
    """What some elements give to the places of strain."""

    element: Element
    rows: slice
    fit: Array
    """From the points of the rule to places of the element, (n_places, n_points)."""
    place: IntArray
    """Which these are, (n_elements, n_places)."""
    among: Array
    """Elements that share each of them, (n_elements, n_places)."""


def _part(mesh: Mesh, chosen: dict[str, IntArray]) -> Mesh:
    """The chosen elements, types of the same corners one after the other."""
    chosen = dict(sorted(chosen.items(), key=lambda item: (_linear(item[0]), item[0])))
    return Mesh(
        nodes=mesh.nodes,
        blocks={kind: mesh.blocks[kind][members] for kind, members in chosen.items()},
        element_labels={kind: _labels(mesh, kind, members) for kind, members in chosen.items()},
    )


def _placed(
    mesh: Mesh, materials: Materials, chosen: dict[str, IntArray], part: Mesh, at: str
) -> tuple[StrainPlaces, list[_Share]]:
    """Places of strain in a part, and what each chunk of its elements gives to them."""

    def of_elements(whole: Mesh, value: Callable[[Any], Any]) -> Array:
        every = element_values(whole, materials, value)
        return np.concatenate([every[kind][chosen[kind]] for kind in part.blocks])

    E, nu = of_elements(mesh, lambda m: m.young), of_elements(mesh, lambda m: m.poisson)
    if at == NODES:
        nominal = replace(mesh, temperature=None)
        alike = np.stack([of_elements(nominal, lambda m: m.young), of_elements(nominal, lambda m: m.poisson)])
        return _at_nodes(mesh, part, E, nu, np.unique(alike, axis=1, return_inverse=True)[1].ravel())
    shares, first, centres = [], 0, []
    for element, rows in chunks(part, 27):
        block = part.blocks[element.name][rows]
        own = (first + np.arange(len(block)))[:, None]
        shares.append(_Share(element, rows, _fit(element)[1], own, np.ones(own.shape)))
        centres.append(np.einsum("n,end->ed", _centre(element)[1], mesh.nodes[block]))
        first += len(block)
    corners = {kind: block[:, : ELEMENTS[kind].n_corners] for kind, block in part.blocks.items()}
    used = np.unique(np.concatenate([block.ravel() for block in corners.values()]))
    places = StrainPlaces(
        at=at, labels=np.concatenate([*(part.element_labels or {}).values()]), positions=np.concatenate(centres),
        young=E, poisson=nu, nodes=mesh.nodes[used],
        cells=_cells({kind: np.searchsorted(used, block) for kind, block in corners.items()}),
    )  # fmt: skip
    return places, shares


def _at_nodes(mesh: Mesh, part: Mesh, E: Array, nu: Array, material: IntArray) -> tuple[StrainPlaces, list[_Share]]:
    """The mean over elements of one material at each node."""
    pairs, first, n_materials = {}, 0, int(material.max()) + 1
    for kind, block in part.blocks.items():
        of_elements = material[first : first + len(block)]
        pairs[kind] = block * np.int64(n_materials) + of_elements[:, None]
        first += len(block)
    keys, counts = np.unique(np.concatenate([pair.ravel() for pair in pairs.values()]), return_counts=True)
    shares, places_of = [], {kind: np.searchsorted(keys, pair) for kind, pair in pairs.items()}
    for element, rows in chunks(part, 27):
        own = places_of[element.name][rows]
        shares.append(_Share(element, rows, _fit(element)[0], own, counts[own].astype(float)))
    of_node, of_material = keys // n_materials, keys % n_materials
    if mesh.temperature is None:
        some = np.unique(material, return_index=True)[1][of_material]
        E, nu = E[some], nu[some]
    else:
        every = np.concatenate([own.ravel() for own in places_of.values()])
        width = np.concatenate([np.full(len(own), own.shape[1]) for own in places_of.values()])
        E, nu = (np.bincount(every, np.repeat(value, width)) / counts for value in (E, nu))
    places = StrainPlaces(
        at=NODES, labels=mesh.labels[of_node], positions=mesh.nodes[of_node], young=E, poisson=nu,
        nodes=mesh.nodes[of_node],
        cells=_cells({kind: own[:, : ELEMENTS[kind].n_corners] for kind, own in places_of.items()}),
    )  # fmt: skip
    return places, shares


def _cells(blocks: dict[str, IntArray]) -> dict[str, IntArray]:
    """Corners by the linear element; types that have the same one come one after the other."""
    cells: dict[str, list[IntArray]] = {}
    for kind, block in blocks.items():
        cells.setdefault(_linear(kind), []).append(block)
    return {kind: np.concatenate(parts) for kind, parts in cells.items()}


def _linear(kind: str) -> str:
    alike = ALIKE.get(kind, kind)
    return LINEAR.get(alike, alike)


def _fit(element: Element) -> tuple[Array, Array]:
    """Values at the nodes (n_nodes, n_points) and at the centre (1, n_points) from those at the points of the rule.

    The mean strain holds everywhere. Where shape functions are incompatible the strain of the nodes' motion is whole at
    the centre alone, where theirs is zero: it counts for the element.
    """
    if element.mean_strain:
        return np.ones((element.n_nodes, 1)), np.ones((1, 1))
    basis = ELEMENTS[_linear(element.name)].basis
    weight = np.sqrt(element.rule.weights)
    fitted = np.linalg.pinv(weight[:, None] * basis(element.rule.points)[0]) * weight
    middle = basis(_centre(element)[0])[0] @ fitted
    at_nodes = np.tile(middle, (element.n_nodes, 1)) if element.incompatible else basis(element.basis.nodes)[0] @ fitted
    return at_nodes, middle


def _centre(element: Element) -> tuple[Array, Array]:
    """The centre of the reference element (1, 3), and the shape functions there (n_nodes,)."""
    rule = element.rule
    middle = (rule.weights @ rule.points / rule.weights.sum())[None, :]
    return middle, element.basis(middle)[0][0]


def _gradients(mesh: Mesh, element: Element, rows: slice, fit: Array) -> Array:
    """Fitted gradients of the shape functions (n_elements, n_places, n_nodes, 3)."""
    at_rule, _ = solid_gradients(mesh, element, rows.start, mesh.blocks[element.name][rows])
    count, n_points, n, _ = at_rule.shape
    return np.asarray(fit @ at_rule.reshape(count, n_points, 3 * n)).reshape(count, -1, n, 3)


def _strains(
    gradients: list[Array], nodes: list[IntArray], place: list[IntArray], *, shape: tuple[int, int]
) -> csc_array:
    """Columns of strains by gradients (k, 3) of the shape functions of ``nodes`` (k,) at places (k,), in parts.

    ``shape`` has the numbers of both.
    """
    component, motion, along = np.array(_DERIVATIVES).T
    values = np.concatenate(gradients)[:, along]
    row = 3 * np.concatenate(nodes)[:, None] + motion
    column = len(COMPONENTS) * np.concatenate(place)[:, None] + component
    size = (3 * shape[0], len(COMPONENTS) * shape[1])
    return csc_array((values.ravel(), (row.ravel(), column.ravel())), shape=size)
