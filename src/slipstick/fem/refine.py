"""From linear to quadratic elements: a node in the middle of every edge; who needs it is warned."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace

import numpy as np

from slipstick.fem.elements import ELEMENTS, FACES, LINEAR_TO_QUADRATIC, LOCKING
from slipstick.fem.mesh import Mesh, Surface
from slipstick.typing import IntArray

_QUADRATIC_FACE = {"tri3": "tri6", "quad4": "quad8"}


def linear_warnings(mesh: Mesh, source: str, kinds: Collection[str] = LOCKING) -> Iterator[str]:
    """A sentence where a mesh has linear elements of these kinds."""
    blocks = [f"{len(block)} {kind}" for kind, block in mesh.blocks.items() if kind in kinds and len(block)]
    if blocks:
        yield (
            f"{source}: {', '.join(blocks)} elements are linear, far too stiff in bending; put nodes in the middle of "
            "their edges (import: --quadratic; case: quadratic = true; Python: quadratic=True, or "
            "slipstick.fem.refine.quadratic) or mesh with quadratic elements"
        )


def quadratic(mesh: Mesh) -> Mesh:
    """The same mesh with straight quadratic elements in place of the linear ones.

    Node sets gain the middle of every edge whose two ends are in the set; surfaces become quadratic. New nodes come
    last and are labelled after the highest label.
    """
    edges = [
        block[:, pair] for e, block in mesh.items() if e.name in LINEAR_TO_QUADRATIC for pair in map(list, e.edges)
    ]
    if not edges:
        return mesh
    n = np.int64(mesh.n_nodes)
    keys = np.unique(_keys(np.concatenate(edges), n))
    ends = np.stack([keys // n, keys % n], axis=1)
    labels = None
    if mesh.node_labels is not None:
        labels = np.concatenate([mesh.node_labels, mesh.labels.max() + 1 + np.arange(len(keys))])
    first: dict[str, int] = {}  # of each kind, in its new block
    blocks: dict[str, list[IntArray]] = {}
    for kind, block in mesh.blocks.items():
        parts = blocks.setdefault(LINEAR_TO_QUADRATIC.get(kind, kind), [])
        first[kind] = sum(map(len, parts))
        parts.append(_extended(block, ELEMENTS[kind].edges, kind, keys, n))
    return replace(
        mesh,
        nodes=np.vstack([mesh.nodes, mesh.nodes[ends].mean(axis=1)]),
        blocks={kind: np.concatenate(parts) for kind, parts in blocks.items()},
        node_sets={name: _extended_set(nodes, ends, n) for name, nodes in mesh.node_sets.items()},
        element_sets={
            name: _joined({kind: members + first[kind] for kind, members in by_kind.items()})
            for name, by_kind in mesh.element_sets.items()
        },
        surfaces={name: _extended_surface(surface, keys, n) for name, surface in mesh.surfaces.items()},
        node_labels=labels,
        element_labels=mesh.element_labels and _joined({kind: mesh.element_labels[kind] for kind in mesh.blocks}),
    )


def _joined(by_kind: Mapping[str, IntArray]) -> dict[str, IntArray]:
    """Numbers by the quadratic kind; several kinds may become the same one."""
    parts: dict[str, list[IntArray]] = {}
    for kind, numbers in by_kind.items():
        parts.setdefault(LINEAR_TO_QUADRATIC.get(kind, kind), []).append(numbers)
    return {kind: np.concatenate(numbers) for kind, numbers in parts.items()}


def _keys(pairs: IntArray, n: np.int64) -> IntArray:
    return pairs.min(axis=-1) * n + pairs.max(axis=-1)


def _extended(block: IntArray, edges: tuple[tuple[int, ...], ...], kind: str, keys: IntArray, n: np.int64) -> IntArray:
    if kind not in LINEAR_TO_QUADRATIC and kind not in _QUADRATIC_FACE:
        return block
    middles = [n + np.searchsorted(keys, _keys(block[:, list(pair)], n)) for pair in edges]
    return np.column_stack([block, *middles])


def _extended_set(nodes: IntArray, ends: IntArray, n: np.int64) -> IntArray:
    inside = np.zeros(int(n), dtype=bool)
    inside[nodes] = True
    return np.concatenate([nodes, n + np.flatnonzero(inside[ends].all(axis=1))])


def _extended_surface(surface: Surface, keys: IntArray, n: np.int64) -> Surface:
    return Surface(
        faces={_QUADRATIC_FACE.get(k, k): _extended(f, FACES[k].edges, k, keys, n) for k, f in surface.faces.items()}
    )
