"""Contacts between two surfaces of a model: what is kept of them, the curves they give, and what is refused."""

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

import slipstick as ss
from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.box import box
from slipstick.fem.interfaces import SurfacePair
from slipstick.fem.mesh import together
from slipstick.fem.model import elastic_model
from slipstick.io.model_file import load_model, save_model

STEEL = ss.Material(young=2e11, poisson=0.3, density=7800.0)
LAW = ss.PlanarFrictionContact(kt=1e11, kn=1e12, mu=0.3, gap=0.0)


SIZE = (0.06, 0.04, 0.004)
AREA = 0.06 * 0.04


def leaves(kinds=("hex20", "tet10"), divisions=((4, 2, 1), (3, 3, 1)), gap=0.0):
    """Two leaves one on the other, both held at one end."""
    lower = box(SIZE, divisions[0], kinds[0])
    upper = box(SIZE, divisions[1], kinds[1], at=(0.0, 0.0, SIZE[2] + gap))
    return elastic_model(together({"lower": lower, "upper": upper}), STEEL, ["lower.x0", "upper.x0"])


@pytest.fixture(scope="module")
def model():
    return leaves()


def pair(model, first="lower.z1", second="upper.z0", **options):
    return ss.surface_pair(model, first, second, **{"contact": LAW, **options})


def test_contacts_carry_their_share_of_the_area(model):
    joint = pair(model, "lower.z1", "upper.z0", name="leaf")
    assert [contact.name for contact in joint[:2]] == ["leaf 1", "leaf 2"]
    assert sum(contact.contact.kt for contact in joint) == pytest.approx(1e11 * AREA, rel=1e-12)
    assert sum(contact.contact.kn for contact in joint) == pytest.approx(1e12 * AREA, rel=1e-12)
    assert {contact.contact.mu for contact in joint} == {0.3}
    assert joint[0].normal == {"leaf_1z": 1.0}
    assert joint[0].direction("tangential") == {"leaf_1x": 1.0}
    assert joint[0].direction("second") == {"leaf_1y": 1.0}
    assert "100 % of surface 'lower.z1' and 100 % of surface 'upper.z0'" in joint.notes[0]
    loaded = pair(model, contact=ss.PlanarFrictionContact(kt=1e11, kn=1e12, mu=0.3, normal_load=1e6), points=10)
    assert sum(contact.contact.normal_load for contact in loaded) == pytest.approx(1e6 * AREA, rel=1e-12)
    assert "patches stand for" in loaded.notes[-1]
    assert 0.0 < loaded.softer < 0.5


def test_only_relative_motion_is_kept(model):
    joint = pair(model, points=6)
    body = ss.reduced_body(model, pairs=joint, pressure={"push": "upper.z1"}, modes=20)
    assert body.structure.dofs == joint.points.dofs
    D = model.restrict(np.hstack([joint.facing.directions(np.tile(axis, (6, 1))).toarray() for axis in np.eye(3)]))
    D = D[:, np.arange(18).reshape(3, 6).T.ravel()]
    exact = D.T @ np.linalg.solve(model.K.toarray(), D)
    found = body.structure.project(np.eye(18), np.eye(18), ()).static
    np.testing.assert_allclose(found, exact, atol=1e-8 * np.abs(exact).max())
    assert set(joint.notes) <= set(body.notes)
    assert list(body.full().sides) == ["joint_"]


def test_gaps_of_the_geometry_and_surfaces_that_are_made_to_touch():
    apart = leaves(gap=2e-4)
    joint = pair(apart, contact=LAW.changed(gap=1e-4))
    np.testing.assert_allclose([one.contact.gap for one in joint], 3e-4, rtol=1e-9)
    assert "gaps up to 0.0002 are kept" in joint.notes[1]
    closed = pair(apart, gap="touching")
    assert {one.contact.gap for one in closed} == {0.0}
    assert "gaps up to 0.0002 are set to zero; the friction forces of the two sides act" in closed.notes[1]
    with pytest.warns(ss.SlipstickWarning, match=r"overlap by up to 0\.0001, which presses"):
        pressed = pair(leaves(gap=-1e-4))
    np.testing.assert_allclose([one.contact.gap for one in pressed], -1e-4, rtol=1e-9)
    assert pressed.warnings


def test_the_order_of_the_surfaces_does_not_matter(model):
    one, other = pair(model, points=6), pair(model, "upper.z0", "lower.z1", points=6)
    np.testing.assert_allclose(stuck_frequencies(model, one), stuck_frequencies(model, other), rtol=1e-7)


def stuck_frequencies(model, joint):
    """Natural frequencies of the full model with the springs of the contacts, all closed and stuck."""
    K = model.K.toarray()
    names, points = {dof: k for k, dof in enumerate(joint.points.dofs)}, joint.points
    columns = np.stack(
        [model.restrict(joint.facing.directions(np.tile(axis, (points.count, 1)))).toarray() for axis in np.eye(3)],
        axis=2,
    )
    columns = columns.reshape(len(K), -1)
    for contact in joint:
        for port, name in (("tangential", "kt"), ("second", "kt"), ("normal", "kn")):
            along = sum(cosine * columns[:, names[dof]] for dof, cosine in contact.direction(port).items())
            K += getattr(contact.contact, name) * np.outer(along, along)
    return np.sqrt(eigh(K, model.M.toarray(), eigvals_only=True)[:6])


def test_leaves_that_are_bonded_are_one_body():
    """Contacts much stiffer than the material, on equal meshes: the frequencies of the mesh in one piece."""
    two = leaves(("hex20", "hex20"), ((3, 2, 1), (3, 2, 1)))
    one = elastic_model(box((*SIZE[:2], 2.0 * SIZE[2]), (3, 2, 2), "hex20"), STEEL, "x0")
    whole = np.sqrt(eigh(one.K.toarray(), one.M.toarray(), eigvals_only=True)[:6])
    stiff = 1e17
    found = stuck_frequencies(two, pair(two, contact=LAW.changed(kt=stiff, kn=stiff)))
    np.testing.assert_allclose(found, whole, rtol=1e-4)


def problem(body, contacts):
    """Leaves pressed together and shaken across."""
    pressing = [ss.Load(shape=name, harmonic=0, cos=1e6) for name in ("below", "above")]
    loads = [*pressing, ss.Load(base="z", motion="acceleration", cos=2e4)]
    return ss.Problem(body.structure, contacts=contacts, loads=loads, harmonics=ss.Harmonics(range(3)))


OPTIONS = {"base": "z", "modes": 24, "loss_factor": 0.01, "pressure": {"below": "lower.z0", "above": "upper.z1"}}


def steady(body, contacts, omega=(1.3e4,)):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # two harmonics are few
        return ss.steady_response(problem(body, contacts), omega=list(omega))


def test_nodes_of_matching_meshes_are_contacts_between_nodes():
    """Node to surface on equal meshes against pairs of nodes by name: the same motion, with slip."""
    same = leaves(("hex8", "hex8"), ((3, 2, 1), (3, 2, 1)))
    joint = pair(same, method="nodes")
    assert len(joint) == 9
    assert "3 points lie between nodes that are held" in joint.notes[1]
    mesh, by_name = same.mesh, []
    for contact, place in zip(joint, joint.points.positions, strict=True):
        sides = [mesh.surface(name).nodes for name in ("lower.z1", "upper.z0")]
        first, second = (mesh.labels[on[np.linalg.norm(mesh.nodes[on] - place, axis=1).argmin()]] for on in sides)
        x, y, z = ({f"n{first}{axis}": 1.0, f"n{second}{axis}": -1.0} for axis in "xyz")
        by_name.append(ss.ContactPair(name=contact.name, contact=contact.contact, tangential=(x, y), normal=z))
    keep = [dof for one in by_name for port in ("tangential", "second", "normal") for dof in one.direction(port)]
    other = ss.reduced_body(same, surface="upper.z1", contacts=1, keep=keep, **OPTIONS)
    a = steady(ss.reduced_body(same, pairs=joint, **OPTIONS), joint)
    b = steady(other, by_name)
    assert a.dataset["slip_fraction"].max() > 0.1
    last = by_name[-1].direction("tangential")
    relative = sum(cosine * b.dataset["displacement"].sel(dof=dof).to_numpy() for dof, cosine in last.items())
    own = a.dataset["displacement"].sel(dof="joint_9x").to_numpy()
    np.testing.assert_allclose(own, relative, atol=1e-5 * np.abs(own).max())


def grounded(fine):
    """A plate held at one end on a block that is held everywhere, their meshes as fine as wanted, but not alike."""
    ground = box(SIZE, (3 * fine, 2, 1), "hex8")
    mesh = together({"ground": ground, "plate": box(SIZE, (2 * fine, fine, 1), at=(0.0, 0.0, SIZE[2]))})
    held = np.concatenate([mesh.surface("plate.x0").nodes, np.arange(ground.n_nodes)])
    return elastic_model(mesh, STEEL, held)


def test_the_curve_is_that_of_contacts_to_ground_as_points_and_meshes_are_refined():
    """Against ``surface_contacts``, whose patches stand for the same springs: the curves close up on each other."""
    law = ss.FrictionContact(kt=2e11, kn=2e11, mu=0.3, gap=0.0)
    differences = []
    for fine, points in ((2, 8), (4, 32)):
        model = grounded(fine)
        options = {"pressure": {"above": "plate.z1"}, "base": "x", "modes": 24, "loss_factor": 0.02}
        joint = ss.surface_pair(model, "plate.z0", "ground.z1", contact=law, direction=(1, 0, 0), points=points)
        body = ss.reduced_body(model, surface="plate.z0", contacts=points, **options)
        areas = body.points.areas
        contacts = ss.surface_contacts(
            body, "joint", contact=law.changed(kt=2e11 * areas, kn=2e11 * areas, gap=0.0 * areas), direction=(1, 0, 0),
            normal=True,
        )  # fmt: skip
        moved = []
        for structure, own in (
            (ss.reduced_body(model, pairs=joint, **options).structure, joint),
            (body.structure, contacts),
        ):
            loads = [ss.Load(shape="above", harmonic=0, cos=1e6), ss.Load(base="x", motion="acceleration", cos=2e5)]
            whole = ss.Problem(structure, contacts=own, loads=loads, harmonics=ss.Harmonics(range(4)))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                branch = ss.steady_response(whole, omega=[3e4, 4e4, 5e4])
            assert branch.dataset["slip_fraction"].max() > 0.1
            share = joint.points.areas if own is joint else areas
            x = [f"{'joint_' if own is joint else 'c'}{k + 1}x" for k in range(points)]
            moved.append(np.einsum("pdc,d->pc", branch.dataset["displacement"].sel(dof=x).to_numpy(), share) / AREA)
        differences.append(np.linalg.norm(moved[0] - moved[1]) / np.linalg.norm(moved[0]))
    assert differences[0] < 0.1
    assert differences[1] < 0.6 * differences[0]


@pytest.mark.parametrize(
    ("names", "options", "said"),
    [
        (("lower.z1", "upper.z9"), {}, "second: surface 'upper.z9' is not in the mesh"),
        (("lower.z1", "lower.z1"), {}, "second has .* nodes of the first surface"),
        (("lower.z1", "lower.x1"), {}, "second has .* nodes of the first surface"),
        (("lower.z1", "upper.z1"), {}, "do not face each other: their outward normals are 0 degrees apart"),
        (
            ("lower.z0", "upper.z1"),
            {"within": 1e-3},
            "'lower.z0' and surface 'upper.z1' overlap by 0.008 to 0.008, more than 0.001",
        ),
        (("lower.z1", "upper.z0"), {"contact": ss.models.DahlContact(kt=1.0, limit=1.0)}, "contact: found"),
        (
            ("lower.z1", "upper.z0"),
            {"contact": ss.FrictionContact(kt=1.0, kn=1.0, mu=0.1, gap=0.0)},
            "direction is missing: a FrictionContact slides along one direction",
        ),
        (
            ("lower.z1", "upper.z0"),
            {"contact": ss.PlanarFrictionContact(kt=1.0, mu=0.1, normal_load=1.0)},
            "contact 'kn' is missing",
        ),
        (("lower.z1", "upper.z0"), {"contact": LAW.changed(kt=[1.0, 2.0])}, "contact 'kt': found 2 values"),
        (("lower.z1", "upper.z0"), {"gap": "closed", "method": "mortar", "points": 0}, "gap: found 'closed'"),
        (("lower.z1", 3), {}, "second: found 3"),
    ],
)
def test_surfaces_and_laws_that_make_no_pair(model, names, options, said):
    with pytest.raises(InputError, match=said):
        ss.surface_pair(model, *names, **{"contact": LAW, **options})


def test_surfaces_that_are_apart_or_held():
    apart = leaves(gap=0.05)
    with pytest.raises(InputError, match=r"are apart by 0\.05 to 0\.05, more than 0\.0191"):
        pair(apart)
    assert len(pair(apart, within=0.06, points=10)) == 10
    held = leaves().fix("lower.z1").fix("upper.z0")
    with pytest.raises(InputError, match="where they meet is held"):
        pair(held)


def test_surfaces_that_meet_in_part_are_reported():
    mesh = leaves().mesh
    upper = np.unique(mesh.blocks["tet10"])
    moved = mesh.nodes.copy()
    moved[upper, :2] += [0.03, 0.01]
    there = elastic_model(replace(mesh, nodes=moved), STEEL, ["lower.x0", "upper.x1"])
    with pytest.warns(
        ss.SlipstickWarning, match=r"62\.5 % of surface 'lower.z1' and 62\.5 % of surface 'upper.z0' have noth"
    ):
        joint = pair(there)
    assert joint.points.areas.sum() == pytest.approx(0.375 * AREA, rel=1e-12)


def test_patches_that_lose_the_resistance_to_a_rotation_are_reported(model):
    with pytest.warns(ss.SlipstickWarning, match="1 patch for both surfaces: .* falls by up to 100 %"):
        pair(model, points=1)


def test_too_many_points_are_refused(monkeypatch, model):
    monkeypatch.setattr("slipstick.models.surface_pair.MOST_CONTACTS", 100)
    with pytest.raises(InputError, match=r"points: found \d+ points, and each keeps three dofs; expected at most 100"):
        pair(model)
    assert len(pair(model, points=20)) == 20


def test_surfaces_of_the_mesh_are_taken_without_a_name(model):
    lower, upper = (model.mesh.surface(name) for name in ("lower.z1", "upper.z0"))
    joint = pair(model, lower, upper, points=6)
    assert "100 % of the first surface and 100 % of the second surface" in joint.notes[0]
    with pytest.raises(
        InputError, match=r"the first surface and the second surface lie 0\.004 to 0\.0603 apart, but do not"
    ):
        pair(model, model.mesh.surface("lower.z0"), model.mesh.surface("upper.x0"), within=1.0)


def test_gaps_that_differ_within_a_patch_are_reported():
    flat = leaves()
    nodes = flat.mesh.nodes.copy()
    upper = np.unique(flat.mesh.blocks["tet10"])
    nodes[upper, 2] += 1e-3 * nodes[upper, 0] / SIZE[0]
    wedge = elastic_model(replace(flat.mesh, nodes=nodes), STEEL, ["lower.x0", "upper.x0"])
    joint = pair(wedge, points=6)
    assert "gaps of points differ from those of their patches by up to 0.000" in joint.notes[-1]
    assert np.average(joint.gaps, weights=joint.points.areas) == pytest.approx(5e-4, rel=1e-3)


def test_pairs_of_other_models_and_names_that_are_given_twice(model):
    joint = pair(model, points=6)
    other = leaves(divisions=((4, 2, 1), (4, 3, 1)))
    with pytest.raises(InputError, match="'joint' was made of another model, with"):
        ss.reduced_body(other, pairs=joint)
    with pytest.raises(InputError, match="two are called 'joint'"):
        ss.reduced_body(model, pairs=[joint, joint])
    with pytest.raises(InputError, match=r"expected what ss\.surface_pair returns"):
        ss.reduced_body(model, pairs=[joint[0]])
    kept = ss.reduced_body(model, pairs=[joint, pair(model, name="b", points=6)], modes=8)
    assert kept.structure.dofs[18:20] == ("b_1x", "b_1y")


def test_a_stop_without_friction(model):
    joint = pair(model, contact=ss.FrictionContact(kn=1e12, gap=1e-4), points=6)
    assert joint[0].direction("tangential") is None
    assert joint[0].contact.gap == pytest.approx(1e-4)


def test_a_pair_inside_a_sector():
    """A tile on the rim of a sixth of a disc: the reduced phases against the full sector."""

    def bent(mesh, inner, start, angle):
        x, y, z = mesh.nodes.T
        at, radius = start + x * angle, inner + z
        return replace(mesh, nodes=np.stack([radius * np.cos(at), radius * np.sin(at), y], axis=1))

    disc = bent(box((1.0, 0.1, 0.2), (4, 1, 1), "hex20"), 0.8, 0.0, np.pi / 3.0)
    tile = bent(box((1.0, 0.1, 0.1), (3, 2, 1), "hex20"), 1.0, np.pi / 12.0, np.pi / 6.0)
    model = elastic_model(together({"disc": disc, "tile": tile}), STEEL, ["disc.z0", "tile.z1"])
    joint = ss.surface_pair(model, "disc.z1", "tile.z0", contact=LAW, points=12, gap="touching")
    assert joint.points.areas.sum() == pytest.approx(np.pi / 6.0 * 0.1, rel=1e-2)
    sector = ss.reduced_sector(
        model, sectors=6, low="disc.x0", high="disc.x1", pairs=joint, pressure={"push": "disc.y1"}, modes=20
    )
    assert sector.dofs[:3] == ("joint_1x", "joint_1y", "joint_1z")
    assert set(joint.notes) <= set(sector.notes)
    omega = 0.7 * sector.natural_frequencies(1)[0]
    assert sector.receptance_error(1, omega) < 1e-4
    wave = ss.Problem(
        sector.travelling_wave(1),
        contacts=joint,
        loads=[ss.Load(shape="push", cos=1e3)],
        harmonics=ss.Harmonics([0, 1]),
    )
    assert len(wave.elements) == 12


@pytest.mark.parametrize(("size", "apart"), [(1000.0, 0.0), (25.4, 0.0), (1000.0, 3000.0)])
def test_bodies_in_different_units_are_suspected(size, apart):
    low, high = box((1.0, 1.0, 0.2), (2, 2, 1)), box((size, size, size), (2, 2, 1), at=(0.0, 0.0, 0.2 + apart))
    model = elastic_model(together({"low": low, "high": high}), STEEL, ["low.x0", "high.x0"])
    said = rf"they span 1 and {size:.3g}: is one in mm, one in".replace("+", r"\+")
    if apart:
        with pytest.raises(InputError, match=said):
            ss.surface_pair(model, "low.z1", "high.z0", contact=LAW)
    else:
        with pytest.warns(SlipstickWarning, match=said):
            ss.surface_pair(model, "low.z1", "high.z0", contact=LAW)


def test_the_coefficient_of_the_file_is_the_default(model, tmp_path):
    """Of surfaces in either order; one of its own overrides it, and both are told."""
    stated = SurfacePair(dependent="upper.z0", independent="lower.z1", mu=0.15, interaction="DRY", card="*FRICTION")
    named = replace(model, contact_pairs={"upper.z0/lower.z1": stated})
    again = load_model(save_model(named, tmp_path / "m.h5"), quiet=True)
    bare = ss.PlanarFrictionContact(kt=1e11, kn=1e12, gap=0.0)
    assert repr(bare.changed(kt=1.0, kn=2.0)) == "PlanarFrictionContact(kt=1.0, kn=2.0, gap=0.0)"
    for one in (named, again):
        joint = pair(one, contact=bare, points=4)
        assert [contact.contact.mu for contact in joint] == [0.15] * 4
        assert joint.friction == "mu = 0.15 of the deck's *FRICTION (DRY)"
        assert f"contacts 'joint': {joint.friction}" in joint.notes
    own = pair(named, "upper.z0", "lower.z1", points=4)
    assert [contact.contact.mu for contact in own] == [0.3] * 4
    assert own.friction == "mu = 0.3 is used, not mu = 0.15 of the deck's *FRICTION (DRY)"
    assert pair(named, contact=LAW.changed(mu=0.15), points=4).friction == ""
    stop = pair(named, contact=ss.FrictionContact(kn=1e12, gap=0.0), points=4)
    assert (stop.friction, stop[0].contact.mu) == ("", 0.0)


@pytest.mark.parametrize("pairs", [{}, {"p": SurfacePair(dependent="lower.z1", independent="upper.z0")}])
def test_a_coefficient_that_nobody_gives_is_missing(model, pairs):
    bare = ss.PlanarFrictionContact(kt=1e11, kn=1e12, gap=0.0)
    with pytest.raises(InputError, match="mu' is missing; give the friction coefficient: the model has none"):
        pair(replace(model, contact_pairs=pairs), contact=bare)
