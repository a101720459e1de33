"""Points between surfaces whose meshes do not match: areas, patch tests, resultants, rigid motions, invariance."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import diags_array
from scipy.sparse.linalg import spsolve
from scipy.spatial import ConvexHull, HalfspaceIntersection

from slipstick.fem.assembly import assemble
from slipstick.fem.box import box
from slipstick.fem.loads import area, pressure_load
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, Surface, together
from slipstick.fem.surface_pairs import facing_nodes, facing_points, thinned

KINDS = [("hex8", "tet4"), ("hex20", "tet10"), ("hex20", "hex8"), ("tet10", "tet10"), ("wedge15", "pyramid13")]
"""Elements of the lower and the upper block."""


def blocks(kinds=("hex20", "tet10"), gap=0.0, fine=1, height=0.5):
    """Two blocks one above the other, with surfaces A (top of the lower) and B (bottom of the upper one)."""
    lower = box((1.0, 1.0, height), (4 * fine, 5 * fine, fine), kinds[0])
    upper = box((1.0, 1.0, height), (3 * fine, 7 * fine, fine), kinds[1], at=(0.0, 0.0, height + gap))
    mesh = together({"A": lower, "B": upper})
    return replace(mesh, surfaces={**mesh.surfaces, "A": mesh.surfaces["A.z1"], "B": mesh.surfaces["B.z0"]})


def turned(mesh, seed=1):
    rotation = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    return replace(mesh, nodes=mesh.nodes @ rotation.T + [3.0, -2.0, 1.0])


def facing(mesh, within=0.3, find=facing_points):
    return find(mesh, mesh.surface("A"), mesh.surface("B"), within)


@pytest.mark.parametrize("kinds", KINDS)
def test_area_and_constant_pressure_of_flat_meshes_that_do_not_match(kinds):
    mesh = turned(blocks(kinds))
    found = facing(mesh)
    assert found.points.areas.sum() == pytest.approx(1.0, rel=1e-12)
    assert found.covered == pytest.approx((1.0, 1.0), rel=1e-12)
    assert np.abs(found.gaps).max() < 1e-13
    forces = found.weights @ (-found.points.areas[:, None] * found.points.normals)
    for name in "AB":  # on both, the pressure that pushes into the body
        nodes = mesh.surface(name).nodes
        pressed = pressure_load(mesh, mesh.surface(name)).reshape(-1, 3)
        np.testing.assert_allclose(forces[nodes], pressed[nodes], atol=1e-13)


def test_surfaces_that_overlap_in_part_meet_there():
    mesh = blocks()
    upper = np.isin(np.arange(mesh.n_nodes), mesh.blocks["tet10"])
    moved = replace(mesh, nodes=mesh.nodes + np.outer(upper, [0.37, -0.22, 0.0]))
    found = facing(moved)
    assert found.points.areas.sum() == pytest.approx(0.63 * 0.78, rel=1e-12)
    half = replace(mesh, nodes=mesh.nodes + np.outer(upper, [2.0, 0.0, 0.0]))
    assert facing(half) is None


@pytest.mark.parametrize("kinds", [("hex8", "tet4"), ("hex20", "wedge6")])
def test_squares_turned_against_each_other_meet_in_their_intersection(kinds):
    """Any place and angle, against the polygon in which two half-plane systems agree."""
    rng = np.random.default_rng(5)
    mesh = blocks(kinds)
    upper = np.isin(np.arange(mesh.n_nodes), upper_nodes(mesh))[:, None]
    sides = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    for _ in range(8):
        angle, shift = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-0.3, 0.3, size=2)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        flat = mesh.nodes.copy()
        flat[:, :2] = np.where(upper, (flat[:, :2] - 0.5) @ turn.T + 0.5 + shift, flat[:, :2])
        found = facing(replace(mesh, nodes=flat))
        own = np.hstack([sides, -0.5 - sides @ [[0.5], [0.5]]])
        other = np.hstack([sides @ turn.T, -0.5 - (sides @ turn.T) @ (0.5 + shift)[:, None]])
        corners = HalfspaceIntersection(np.vstack([own, other]), 0.5 + shift / 2.0).intersections
        assert found.points.areas.sum() == pytest.approx(ConvexHull(corners).volume, rel=1e-11)
        assert np.abs(found.weights.T @ np.where(upper, [1.0, 2.0, 3.0], [1.0, 2.0, 3.0])).max() < 1e-12
        assert found.points.areas.min() > 0.0


def test_a_tilted_surface_has_the_mean_of_both_areas_and_a_gap_that_is_linear():
    mesh = blocks(("hex8", "hex8"))
    upper = mesh.nodes[:, 2] > 0.5
    upper[mesh.surface("B").nodes] = True
    slope = 0.1
    tilted = replace(mesh, nodes=mesh.nodes + np.outer(upper * mesh.nodes[:, 0] * slope, [0.0, 0.0, 1.0]))
    found = facing(tilted)
    assert found.covered[1] == pytest.approx(np.hypot(1.0, slope) * found.covered[0], rel=1e-2)
    assert found.points.areas.sum() == pytest.approx(sum(found.covered) / 2.0, rel=1e-12)
    angle = np.arctan(slope) / 2.0  # along the bisector, from z = 0.5 to z = 0.5 + slope x
    along = np.array([-np.sin(angle), 0.0, np.cos(angle)])
    np.testing.assert_allclose(found.points.normals, [along] * len(found.gaps), atol=1e-12)
    x = found.points.positions[:, 0]
    z = found.points.positions[:, 2] - 0.5
    low = x + np.tan(angle) * z  # foot on the lower plane
    np.testing.assert_allclose(found.gaps, slope * low / (np.cos(angle) + slope * np.sin(angle)), atol=1e-12)


def solved(mesh, found, kn, young):
    """Displacements of the two blocks under a unit pressure from above, held by rollers on three sides."""
    K = assemble(mesh, Material(young=young, poisson=0.3, density=1.0)).stiffness
    D = found.directions(found.points.normals)
    spring = diags_array(kn * found.points.areas)
    total = (K + D @ spring @ D.T).tocsc()
    held = np.zeros((mesh.n_nodes, 3), dtype=bool)
    held[mesh.surfaces["A.z0"].nodes, 2] = True
    for axis, side in ((0, "x0"), (1, "y0")):
        for body in "AB":
            held[mesh.surfaces[f"{body}.{side}"].nodes, axis] = True
    free = np.flatnonzero(~held.ravel() & np.repeat(np.isin(np.arange(mesh.n_nodes), mesh.used_nodes), 3))
    motion = np.zeros(3 * mesh.n_nodes)
    load = pressure_load(mesh, mesh.surfaces["B.z1"])
    motion[free] = spsolve(total[free][:, free], load[free])
    return motion, kn * (D.T @ motion)


@pytest.mark.parametrize("kinds", KINDS[:4])
def test_a_constant_pressure_passes_through_unchanged(kinds):
    mesh = blocks(kinds)
    found, kn, young = facing(mesh), 500.0, 10.0
    motion, pressure = solved(mesh, found, kn, young)
    np.testing.assert_allclose(pressure, 1.0, rtol=1e-10)
    shorter = mesh.nodes[:, 2] + np.isin(np.arange(mesh.n_nodes), upper_nodes(mesh)) * young / kn
    np.testing.assert_allclose(motion.reshape(-1, 3)[:, 2], -shorter / young, atol=1e-11)


def upper_nodes(mesh: Mesh) -> np.ndarray:
    (block,) = (mesh.blocks[kind][at] for kind, at in mesh.element_sets["B"].items() if len(at))
    return np.unique(block)


def test_nodes_to_a_surface_transmit_a_constant_pressure_approximately():
    errors = []
    for fine in (1, 2):
        mesh = blocks(("hex8", "hex8"), fine=fine)
        found = facing(mesh, find=facing_nodes)
        assert found.points.areas.sum() == pytest.approx(1.0, rel=1e-12)
        _, pressure = solved(mesh, found, 5.0, 10.0)
        errors.append(np.sqrt(np.average((pressure - 1.0) ** 2, weights=found.points.areas)))
    assert errors[0] < 0.2
    assert errors[1] < 0.7 * errors[0]


def test_a_linear_stress_is_carried_by_quadratic_elements_to_rounding():
    """Bending (Poisson's ratio 0): the exact motion leaves no force at any node that is free."""
    mesh = blocks(("hex20", "tet10"))
    found, kn, young, slope = facing(mesh), 50.0, 10.0, 3.0
    K = assemble(mesh, Material(young=young, poisson=0.0, density=1.0)).stiffness
    D = found.directions(found.points.normals)
    x, _, z = mesh.nodes.T
    above = np.isin(np.arange(mesh.n_nodes), upper_nodes(mesh))
    motion = np.zeros((mesh.n_nodes, 3))
    motion[:, 2] = slope * x * z / young + above * slope * x / kn
    motion[:, 0] = -slope * z**2 / (2.0 * young) - above * slope / kn * (z - 0.5)
    pressed = kn * found.points.areas * (D.T @ motion.ravel())
    np.testing.assert_allclose(pressed, -slope * found.points.positions[:, 0] * found.points.areas, atol=1e-13)
    left = (K @ motion.ravel() + D @ pressed).reshape(-1, 3)
    ends = [*mesh.surfaces["A.z0"].nodes, *mesh.surfaces["B.z1"].nodes]
    size = np.abs(left[ends]).max()
    left[ends] = 0.0
    assert np.abs(left).max() < 1e-12 * size


@pytest.mark.parametrize("find", [facing_points, facing_nodes])
def test_forces_on_both_sides_are_opposite_and_a_gap_is_the_arm_of_friction(find):
    rng = np.random.default_rng(0)
    for gap in (0.0, 0.04, -0.02):
        mesh = turned(blocks(gap=gap))
        found = facing(mesh, find=find)
        forces = rng.normal(size=(len(found.gaps), 3))
        at_nodes = found.weights @ forces
        size = np.abs(forces).sum()
        assert np.abs(at_nodes.sum(axis=0)).max() < 1e-13 * size
        moment = np.cross(mesh.nodes - [1.0, 2.0, 3.0], at_nodes).sum(axis=0)
        arms = -found.gaps[:, None] * found.points.normals
        np.testing.assert_allclose(moment, np.cross(arms, forces).sum(axis=0), atol=1e-12 * size)
        np.testing.assert_allclose(found.gaps, gap, atol=1e-13)


@pytest.mark.parametrize("find", [facing_points, facing_nodes])
@pytest.mark.parametrize("kinds", KINDS)
def test_rigid_motions_of_touching_surfaces_move_nothing(kinds, find):
    mesh = turned(blocks(kinds))
    found = facing(mesh, find=find)
    for motion in (np.ones_like(mesh.nodes) * [1.0, 2.0, 3.0], np.cross([1.0, -2.0, 0.5], mesh.nodes)):
        assert np.abs(found.weights.T @ motion).max() < 1e-12


def test_meshes_of_files_with_six_digits_are_as_good_as_their_digits():
    exact = turned(blocks())
    digits = np.array([[float(f"{x:.5e}") for x in place] for place in exact.nodes])
    one, other = facing(exact), facing(replace(exact, nodes=digits))
    assert len(other.gaps) < 2 * len(one.gaps)  # edges are still straight
    assert other.points.areas.sum() == pytest.approx(1.0, rel=3e-5)
    assert np.abs(other.gaps).max() < 3e-5


def ordered(found):
    return np.lexsort(found.points.positions.round(9).T)


def test_swapped_surfaces_change_signs_and_nothing_else():
    mesh = blocks(gap=0.01)
    one, other = facing(mesh), facing_points(mesh, mesh.surface("B"), mesh.surface("A"), 0.3)
    a, b = ordered(one), ordered(other)
    np.testing.assert_allclose(one.points.positions[a], other.points.positions[b], atol=1e-12)
    np.testing.assert_allclose(one.points.normals[a], -other.points.normals[b], atol=1e-12)
    np.testing.assert_allclose(one.points.areas[a], other.points.areas[b], rtol=1e-9)
    np.testing.assert_allclose(one.gaps[a], other.gaps[b], atol=1e-13)
    np.testing.assert_allclose(one.weights.toarray()[:, a], -other.weights.toarray()[:, b], atol=1e-11)


def test_units_and_the_order_of_nodes_do_not_matter():
    mesh = blocks(("hex20", "hex8"), gap=0.01)
    one = facing(mesh)
    larger = facing(replace(mesh, nodes=1e3 * mesh.nodes), within=300.0)
    np.testing.assert_allclose(larger.points.areas, 1e6 * one.points.areas, rtol=1e-9)
    np.testing.assert_allclose(larger.gaps, 1e3 * one.gaps, rtol=1e-9)
    np.testing.assert_allclose(larger.weights.toarray(), one.weights.toarray(), atol=1e-11)
    new = np.random.default_rng(2).permutation(mesh.n_nodes)  # the new number of each node
    nodes = np.empty_like(mesh.nodes)
    nodes[new] = mesh.nodes
    starts = {"quad8": (2, 3, 0, 1, 6, 7, 4, 5), "quad4": (3, 0, 1, 2)}
    again = {
        name: Surface(faces={k: new[f][::-1][:, starts[k]] for k, f in mesh.surface(name).faces.items() if len(f)})
        for name in "AB"
    }
    other = replace(mesh, nodes=nodes, blocks={k: new[b] for k, b in mesh.blocks.items()}, surfaces=again)
    found = facing(other)
    a, b = ordered(one), ordered(found)
    np.testing.assert_allclose(found.weights.toarray()[new][:, b], one.weights.toarray()[:, a], atol=1e-11)
    np.testing.assert_allclose(found.points.areas[b], one.points.areas[a], rtol=1e-9)


def rings(fine, clearance=0.0, kinds=("hex20", "tet10")):
    """A quarter of a tube within another one: A is the outside of the inner one, of radius 1."""

    def bent(mesh, inner):
        x, y, z = mesh.nodes.T
        angle, radius = x * np.pi / 2.0, inner + z
        return replace(mesh, nodes=np.stack([radius * np.sin(angle), y, radius * np.cos(angle)], axis=1))

    inner = bent(box((1.0, 1.0, 0.2), (3 * fine, 2 * fine, 1), kinds[0]), 0.8)
    outer = bent(box((1.0, 1.0, 0.2), (4 * fine, 3 * fine, 1), kinds[1]), 1.0 + clearance)
    mesh = together({"A": inner, "B": outer})
    return replace(mesh, surfaces={"A": mesh.surfaces["A.z1"], "B": mesh.surfaces["B.z0"]})


@pytest.mark.parametrize(("kinds", "order"), [(("hex20", "tet10"), 2.9), (("hex8", "tet4"), 0.9)])
def test_curved_surfaces_converge_to_the_cylinder(kinds, order):
    """Gaps one order faster than the normals, whose order is that of the elements."""
    errors = []
    for fine in (1, 2):
        found = facing(rings(fine, 0.02, kinds), within=0.1)
        x, _, z = found.points.positions.T
        radial = np.stack([x, 0.0 * x, z], axis=1) / np.hypot(x, z)[:, None]
        errors.append((np.abs(found.points.normals - radial).max(), np.abs(found.gaps - 0.02).max()))
        assert 1.0 < found.points.areas.sum() / (np.pi / 2.0) < 1.02  # that of the inner, and of the outer one
    normals, gaps = np.log2(np.array(errors)[0] / np.array(errors)[1])
    assert normals > order
    assert gaps > order + 0.9


def test_area_of_curved_surfaces_that_touch():
    errors = [abs(facing(rings(fine), within=0.1).points.areas.sum() / (np.pi / 2.0) - 1.0) for fine in (1, 2)]
    assert errors[0] < 3e-3
    assert errors[1] < errors[0] / 3.5


def test_curved_surfaces_are_the_same_swapped_and_rigid_motions_strain_only_what_is_apart():
    mesh = turned(rings(2))
    one, other = facing(mesh), facing_points(mesh, mesh.surface("B"), mesh.surface("A"), 0.3)
    a, b = ordered(one), ordered(other)
    np.testing.assert_allclose(one.points.areas[a], other.points.areas[b], rtol=1e-8)
    np.testing.assert_allclose(one.points.normals[a], -other.points.normals[b], atol=1e-10)
    motion = np.cross([1.0, -2.0, 0.5], mesh.nodes)
    arms = -one.gaps[:, None] * one.points.normals
    np.testing.assert_allclose(one.weights.T @ motion, np.cross([1.0, -2.0, 0.5], arms), atol=1e-12)
    assert np.abs(one.gaps).max() < 1e-3
    assert one.covered[0] == pytest.approx(area(mesh, mesh.surface("A")), rel=1e-2)


def test_patches_keep_areas_and_first_moments_and_lose_the_second_ones():
    found = facing(turned(blocks(gap=0.01)))
    few, softer, uneven = thinned(found, 4)
    assert few.points.count == 4
    assert uneven < 1e-12
    areas, places = few.points.areas, few.points.positions
    assert areas.sum() == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(areas @ places, found.points.areas @ found.points.positions, atol=1e-12)
    np.testing.assert_allclose(few.gaps, 0.01, atol=1e-12)
    np.testing.assert_allclose(few.weights @ areas, found.weights @ found.points.areas, atol=1e-12)
    assert softer == pytest.approx(0.25, abs=0.05)  # a square in four: 1/4 of the second moment
    assert thinned(found, 100)[1] < 0.02
    assert thinned(found, 1)[1] == pytest.approx(1.0)


@pytest.mark.parametrize(("kt", "kn"), [(1.0, 0.0), (0.0, 1.0), (3.0, 1.0)])
def test_what_patches_lose_is_the_energy_of_a_rigid_rotation_of_one_side(kt, kn):
    mesh = turned(blocks(("hex8", "hex8")))
    found = facing(mesh)
    few, softer, _ = thinned(found, 6, kt, kn)
    middle = found.points.areas @ found.points.positions
    above = np.isin(np.arange(mesh.n_nodes), mesh.surface("B").nodes)

    def energies(part):
        moved = [part.weights.T @ (above[:, None] * np.cross(axis, mesh.nodes - middle)) for axis in axes]
        across = [np.einsum("na,na->n", motion, part.points.normals) for motion in moved]
        along = [np.einsum("na,na->n", motion, motion) - y**2 for motion, y in zip(moved, across, strict=True)]
        return np.array([part.points.areas @ (kt * t + kn * y**2) for t, y in zip(along, across, strict=True)])

    axes = np.random.default_rng(3).normal(size=(4000, 3))
    lost = 1.0 - energies(few) / energies(found)
    assert lost.max() <= softer * (1.0 + 1e-6)
    assert lost.max() > 0.98 * softer


def test_many_points_are_thinned_by_the_cells_of_a_grid():
    found = facing(blocks(("hex8", "hex8"), fine=3))
    few, softer, _ = thinned(found, 4)
    assert len(found.gaps) > 400
    assert few.points.areas.sum() == pytest.approx(1.0, rel=1e-12)
    assert softer == pytest.approx(0.25, abs=0.05)
