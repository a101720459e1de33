"""Stiffness, consistent mass and conduction matrices, assembled many elements at once.

The work is one batch of products ``G[a i, b j] = int dN_i/dx_a dN_j/dx_b`` for each chunk of elements; elasticity and
conduction are both linear in it:

    K[a i, b j] = lambda G[a i, b j] + mu (G[b i, a j] + delta_ab sum_c G[c i, c j]),    Kt[i j] = k sum_c G[c i, c j].

Incompatible shape functions are condensed in each element; an element of mean strain gets its hourglass stiffness.

Element values go straight into the places of a pattern found once: nothing of the size of all element matrices is kept.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_array, csr_array

from slipstick.fem.elements import Element
from slipstick.fem.geometry import determinant_and_inverse, require_positive, solid_gradients, tangents
from slipstick.fem.materials import Materials, element_values
from slipstick.fem.mesh import Mesh
from slipstick.typing import Array

_CHUNK_BYTES = 32e6


@dataclass(frozen=True, kw_only=True)
class SolidMatrices:
    """Matrices of a whole mesh, without constraints; degrees of freedom node-major, x y z.

    ``stiffness`` and ``mass`` are (3 n_nodes, 3 n_nodes), ``conduction`` is (n_nodes, n_nodes); all exactly symmetric.
    """

    stiffness: csr_array
    mass: csr_array
    conduction: csr_array


def assemble(mesh: Mesh, materials: Materials) -> SolidMatrices:
    """Stiffness, consistent mass and conduction of a mesh in one pass.

    Raises
    ------
    InputError
        If an element is inside out or has no material.

    Examples
    --------
    >>> from slipstick.fem.box import box
    >>> from slipstick.fem.materials import Material
    >>> solid = Material(young=1.0, poisson=0.3, density=2.0)
    >>> matrices = assemble(box((1.0, 2.0, 3.0), (1, 1, 1), "hex20"), solid)
    >>> round(float(matrices.mass.sum()), 12)  # three directions of 2.0 * 6.0
    36.0
    """
    pattern = pattern_of(mesh)
    blocks, laplacian = _gradient_matrices(mesh, materials, pattern)
    return SolidMatrices(
        stiffness=pattern.vector_matrix(blocks),
        mass=pattern.repeated_matrix(mass_values(mesh, materials, pattern)),
        conduction=pattern.scalar_matrix(laplacian),
    )


def conduction(mesh: Mesh, materials: Materials) -> csr_array:
    """Conduction matrix alone, (n_nodes, n_nodes)."""
    pattern = pattern_of(mesh)
    conductivity = element_values(mesh, materials, lambda m: m.conductivity)
    total = np.zeros(pattern.n_couplings)
    for element, part in chunks(mesh, 9):
        products = _laplacians(mesh, element, part)
        add_values(
            total, pattern.slots[element.name][part].ravel(), conductivity[element.name][part, None, None] * products
        )
    return pattern.scalar_matrix(total)


def _laplacians(mesh: Mesh, element: Element, part: slice) -> Array:
    """Integrals (n_elements, n, n) of the products of gradients, at all points of the rule."""
    gradients, weights = solid_gradients(mesh, element, part.start, mesh.blocks[element.name][part], mean=False)
    count, n_points, n, _ = gradients.shape
    scaled = (gradients * np.sqrt(weights)[:, :, None, None]).transpose(0, 1, 3, 2).reshape(count, 3 * n_points, n)
    products = np.matmul(np.ascontiguousarray(scaled.transpose(0, 2, 1)), scaled)
    return np.asarray((products + products.transpose(0, 2, 1)) / 2.0)


def _gradient_matrices(mesh: Mesh, materials: Materials, pattern: Pattern) -> tuple[Array, Array]:
    lame = element_values(mesh, materials, lambda m: m.lame)
    shear = element_values(mesh, materials, lambda m: m.shear_modulus)
    conductivity = element_values(mesh, materials, lambda m: m.conductivity)
    blocks, laplacian = np.zeros((3, 3, pattern.n_couplings)), np.zeros(pattern.n_couplings)
    for element, part in chunks(mesh, 27):
        products = _gradient_products(mesh, element, part)
        trace = products[:, 0, :, 0] + products[:, 1, :, 1] + products[:, 2, :, 2]
        slots = pattern.slots[element.name][part].ravel()
        lam, mu = lame[element.name][part, None, None], shear[element.name][part, None, None]
        same = not (element.mean_strain or element.incompatible)
        flow = trace if same else _laplacians(mesh, element, part)
        add_values(laplacian, slots, conductivity[element.name][part, None, None] * flow)
        elastic = _elastic(products, trace, lam, mu)
        if element.incompatible:
            elastic = _condensed(elastic, element.n_nodes)
        for a, b, values in elastic:
            add_values(blocks[a, b], slots, values)
        if element.mean_strain:
            values = mu * hourglass(mesh, element, part)
            for a in range(3):
                add_values(blocks[a, a], slots, values)
    return np.ascontiguousarray(blocks.transpose(2, 0, 1)), laplacian


Block = tuple[int, int, Array]
"""Two directions, and the stiffness between motions along them, (n_elements, n, n)."""


def _elastic(products: Array, trace: Array, lam: Array, mu: Array) -> Iterator[Block]:
    for a in range(3):
        for b in range(3):
            values = lam * products[:, a, :, b] + mu * products[:, b, :, a]
            yield a, b, values + mu * trace if a == b else values


def _condensed(elastic: Iterable[Block], n: int) -> Iterator[Block]:
    """The blocks of ``n`` nodes; the functions after them move so that no force acts on them."""
    whole, across, own = _apart(elastic, n)
    count, outer = len(whole), slice(None, n)
    relieved = np.matmul(across, np.linalg.solve(own, across.transpose(0, 2, 1)))
    relieved = ((relieved + relieved.transpose(0, 2, 1)) / 2.0).reshape(count, 3, n, 3, n)
    for a in range(3):
        for b in range(3):
            yield a, b, whole[:, a, outer, b, outer] - relieved[:, a, :, b]


def _apart(elastic: Iterable[Block], n: int) -> tuple[Array, Array, Array]:
    """All blocks (e, 3, m, 3, m), those of ``n`` nodes with the functions after them, and those between these."""
    whole = np.stack([values for _, _, values in elastic], axis=1)  # (e, 9, m, m)
    count, _, m, _ = whole.shape
    whole = whole.reshape(count, 3, 3, m, m).transpose(0, 1, 3, 2, 4)
    outer, inner = slice(None, n), slice(n, None)
    across = whole[:, :, outer, :, inner].reshape(count, 3 * n, -1)
    return whole, across, whole[:, :, inner, :, inner].reshape(count, across.shape[2], -1)


def stress_load(mesh: Mesh, materials: Materials, stress: Mapping[str, Array]) -> Array:
    """Nodal forces (3 n_nodes,) that hold an isotropic stress s, ``int s dN_i/dx_a dV``.

    ``stress`` (n_elements, n_points) by element type, at the points of the rule of its stiffness, of an element of mean
    strain the same at all of them. Incompatible functions move so that no force acts on them.
    """
    lame = element_values(mesh, materials, lambda m: m.lame)
    shear = element_values(mesh, materials, lambda m: m.shear_modulus)
    load = np.zeros((mesh.n_nodes, 3))
    for element, part in chunks(mesh, 27):
        nodes, n = mesh.blocks[element.name][part], element.n_nodes
        gradients, weights = solid_gradients(mesh, element, part.start, nodes, mean=False)
        scaled = weights * stress[element.name][part]
        if element.incompatible:
            gradients = np.concatenate([gradients, _bubbles(mesh, element, part, weights)], axis=2)
        forces = np.einsum("eq,eqna->ean", scaled, gradients)
        if element.incompatible:
            products = _gradient_products(mesh, element, part)
            trace = products[:, 0, :, 0] + products[:, 1, :, 1] + products[:, 2, :, 2]
            lam, mu = lame[element.name][part, None, None], shear[element.name][part, None, None]
            _, across, own = _apart(_elastic(products, trace, lam, mu), n)
            inner = np.linalg.solve(own, forces[:, :, n:].reshape(len(nodes), -1, 1))
            forces = forces[:, :, :n] - np.matmul(across, inner).reshape(len(nodes), 3, n)
        for axis in range(3):
            load[:, axis] += np.bincount(nodes.ravel(), forces[:, axis].ravel(), minlength=mesh.n_nodes)
    return load.ravel()


HOURGLASS = 0.005
"""Hourglass stiffness over the shear modulus: the default of Abaqus/Standard ("total stiffness"; its Analysis User's
Guide, Section controls)."""


def hourglass(mesh: Mesh, element: Element, part: slice) -> Array:
    """Stiffness (n_elements, 8, 8) of hourglass motions along each direction, over the shear modulus.

    ``c V (B : B) sum_h g_h g_h'`` with the mean gradients B and ``g_h = h - B (x . h)`` for the patterns h of +1 and -1
    that are the products of two and three coordinates: a linear motion meets none of it (Flanagan and Belytschko 1981).
    The documents of Abaqus give c, not the scale of the patterns; docs/importing.md has what it was held against.
    """
    nodes = mesh.blocks[element.name][part]
    gradients, volumes = solid_gradients(mesh, element, part.start, nodes)
    mean = gradients[:, 0]
    x, y, z = element.basis.nodes.T
    patterns = np.stack([y * z, z * x, x * y, x * y * z])
    moments = np.einsum("hn,end->ehd", patterns, mesh.nodes[nodes])
    shapes = patterns - np.einsum("end,ehd->ehn", mean, moments)
    scale = HOURGLASS * volumes[:, 0] * np.einsum("end,end->e", mean, mean)
    return np.asarray(scale[:, None, None] * np.matmul(shapes.transpose(0, 2, 1), shapes))


def _gradient_products(mesh: Mesh, element: Element, part: slice) -> Array:
    """``G`` (n_elements, 3, n, 3, n) of a chunk, exactly symmetric."""
    gradients, weights = solid_gradients(mesh, element, part.start, mesh.blocks[element.name][part])
    if element.incompatible:
        gradients = np.concatenate([gradients, _bubbles(mesh, element, part, weights)], axis=2)
    count, n_points, n, _ = gradients.shape
    scaled = (gradients * np.sqrt(weights)[:, :, None, None]).transpose(0, 3, 2, 1).reshape(count, 3 * n, n_points)
    products = np.matmul(scaled, np.ascontiguousarray(scaled.transpose(0, 2, 1)))
    products += products.transpose(0, 2, 1).copy()
    products *= 0.5
    return products.reshape(count, 3, n, 3, n)


def _bubbles(mesh: Mesh, element: Element, part: slice, weights: Array) -> Array:
    """Gradients (n_elements, n_points, 3, 3) of ``1 - xi^2``, ``1 - eta^2``, ``1 - zeta^2``.

    With the Jacobian of the centre, over the determinants: their mean is zero, so that a linear motion needs none of
    them in any element (Taylor, Beresford and Wilson 1976).
    """
    centre, rule = np.zeros((1, 3)), element.rule
    at_centre = tangents(mesh.nodes[mesh.blocks[element.name][part]], element.basis(centre)[1])
    determinant, inverse = determinant_and_inverse(at_centre)
    slopes = -2.0 * rule.points[:, :, None] * np.eye(3)
    scale = determinant * rule.weights / weights
    return np.asarray(scale[:, :, None, None] * np.matmul(slopes, inverse))


def mass_values(mesh: Mesh, materials: Materials, pattern: Pattern) -> Array:
    """Consistent mass of every coupling of nodes, (n_couplings,)."""
    density = element_values(mesh, materials, lambda m: m.density)
    total = np.zeros(pattern.n_couplings)
    for element, part in chunks(mesh, 3):
        values, gradients = element.at_mass_rule
        jacobian = tangents(mesh.nodes[mesh.blocks[element.name][part]], gradients)
        determinant, _ = determinant_and_inverse(jacobian)
        require_positive(mesh, element, part.start, determinant)
        weights = determinant * element.mass_rule.weights * density[element.name][part, None]
        outer = (values[:, :, None] * values[:, None, :]).reshape(len(values), -1)
        add_values(total, pattern.slots[element.name][part].ravel(), weights @ outer)
    return total


def add_values(total: Array, slots: NDArray[np.int32], values: Array) -> None:
    """Add element values to their couplings."""
    total += np.bincount(slots, values.ravel(), minlength=len(total))


def chunks(mesh: Mesh, width: int) -> Iterator[tuple[Element, slice]]:
    """Elements in chunks, each small enough that ``width`` numbers for each pair of nodes take little memory."""
    for element, block in mesh.items():
        step = max(1, int(_CHUNK_BYTES / (8 * width * element.n_nodes**2)))
        for start in range(0, len(block), step):
            yield element, slice(start, min(start + step, len(block)))


@dataclass(frozen=True, kw_only=True)
class Pattern:
    """Compressed rows of the node-to-node couplings.

    ``indptr`` (n_nodes + 1,), ``indices`` (n_couplings,), and for each element type ``slots`` (n_elements, n, n): where
    in ``indices`` the coupling of local node i with local node j lies.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    slots: Mapping[str, NDArray[np.int32]]

    @property
    def n_couplings(self) -> int:
        """Number of coupled (ordered) node pairs."""
        return len(self.indices)

    def scalar_matrix(self, values: Array) -> csr_array:
        """Matrix with one unknown a node from values (n_couplings,)."""
        n = len(self.indptr) - 1
        return csr_array((values, self.indices.copy(), self.indptr.copy()), shape=(n, n))

    def vector_matrix(self, blocks: Array) -> csr_array:
        """Matrix with three unknowns a node (node-major, x y z) from blocks (n_couplings, 3, 3)."""
        n = len(self.indptr) - 1
        return bsr_array((blocks, self.indices, self.indptr), shape=(3 * n, 3 * n)).tocsr()

    def repeated_matrix(self, values: Array) -> csr_array:
        """Matrix with three unknowns a node, the same scalar coupling in x, y and z and none across."""
        n, widths = len(self.indptr) - 1, np.diff(self.indptr)
        order = np.repeat(np.arange(n), widths)
        place = 3 * self.indptr[order] + (np.arange(self.n_couplings) - self.indptr[order])
        indices, data = np.empty(3 * self.n_couplings, dtype=np.int32), np.empty(3 * self.n_couplings)
        for axis in range(3):
            where = place + axis * widths[order]
            indices[where], data[where] = 3 * self.indices + axis, values
        indptr = np.concatenate([[0], np.cumsum(np.repeat(widths, 3))]).astype(np.int32)
        return csr_array((data, indices, indptr), shape=(3 * n, 3 * n))


def pattern_of(mesh: Mesh) -> Pattern:
    """The couplings of a mesh: nodes are coupled when they share an element."""
    n = np.int64(mesh.n_nodes)
    keys = [(block[:, :, None] * n + block[:, None, :]).ravel() for _, block in mesh.items()]
    unique, inverse = np.unique(np.concatenate(keys), return_inverse=True)
    slots: dict[str, NDArray[np.int32]] = {}
    start = 0
    for element, block in mesh.items():
        size = len(block) * element.n_nodes**2
        slots[element.name] = (
            inverse[start : start + size].astype(np.int32).reshape(len(block), element.n_nodes, element.n_nodes)
        )
        start += size
    counts = np.bincount(unique // n, minlength=mesh.n_nodes)
    indptr = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    return Pattern(indptr=indptr, indices=(unique % n).astype(np.int32), slots=slots)
