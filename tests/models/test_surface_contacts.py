"""Contacts at the points of a body: names, directions, loads, values for each point, other laws."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.models.reduced_body import ReducedBody

STEEL = ss.Material(young=2e11, poisson=0.3, density=7800.0)
LAW = ss.FrictionContact(kt=1e5, mu=0.4, kn=2e4, normal_load=6.0)


@pytest.fixture(scope="module")
def body() -> ReducedBody:
    mesh = MeshModel(mesh=box((0.2, 0.02, 0.01), (4, 2, 1), "hex20"))
    model = assemble_mesh(mesh, source="beam", material=STEEL, fixed=["x0"])
    return ss.reduced_body(model, surface="y1", contacts=3, modes=6)


def loads(contacts: list[ss.ContactPair]) -> list[float]:
    return [float(pair.contact.normal_load) for pair in contacts]


def test_names_directions_and_loads(body: ReducedBody) -> None:
    contacts = ss.surface_contacts(body, "pad", contact=LAW, direction=(1.0, 1.0, 0.0), points=[3, 1], normal=True)
    assert [pair.name for pair in contacts] == ["pad 3", "pad 1"]
    assert contacts[0].tangential == pytest.approx({"c3x": 1.0})  # 1, 1, 0 on a surface that looks along y
    assert contacts[0].normal == pytest.approx({"c3y": 1.0})
    assert loads(contacts) == pytest.approx([6.0, 6.0])
    shared = ss.surface_contacts(body, contact=LAW, direction=(1, 0, 0), points=[3, 1], shared=True)
    areas = body.points.areas[[2, 0]]
    np.testing.assert_allclose(loads(shared), 6.0 * areas / areas.sum())
    assert [pair.name for pair in shared] == ["contact 3", "contact 1"]
    assert shared[0].normal is None


def test_values_for_each_point(body: ReducedBody) -> None:
    """In the order in which the points are chosen."""
    law = ss.FrictionContact(kt=[1e5, 2e5], mu=0.3, normal_load=[1.0, 2.0])
    rub = ss.RubbingMotion(velocity=[3.0, 4.0], normal_cos={2: [0.1, 0.2]}, sin={1: 5.0})
    contacts = ss.surface_contacts(body, "a", contact=law, direction=(1, 0, 0), points=[3, 1], rubbing=rub)
    assert [pair.contact.kt for pair in contacts] == [1e5, 2e5]
    assert loads(contacts) == pytest.approx([1.0, 2.0])
    assert [pair.rubbing.velocity for pair in contacts] == [3.0, 4.0]
    assert [pair.rubbing.normal_cos[2] for pair in contacts] == [0.1, 0.2]
    assert [pair.rubbing.sin[1] for pair in contacts] == [5.0, 5.0]
    with pytest.raises(InputError) as raised:
        ss.surface_contacts(body, "a", contact=law, direction=(1, 0, 0), rubbing=rub)
    assert raised.value.sentences[0] == ("kt: found 2 values; expected one, or 3, one for each of the chosen points")
    assert len(raised.value.sentences) == 4


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"points": [1, 4]}, "points: found 4; expected a whole number from 1 to 3"),
        ({"points": [2, 2]}, "give every point once"),
        ({"points": []}, "give every point once"),
        ({"points": "some"}, "points: found 'some'; expected \"all\" or numbers counted from 1"),
        ({"direction": (0, 1, 0)}, "is normal to the surface; give one along it"),
        ({"direction": (0, 0)}, "expected a vector of three finite numbers"),
        ({"contact": ss.FrictionContact(kt=1.0, mu=0.1, gap=1.0), "shared": True}, "expected a FrictionContact with a"),
        ({"contact": ss.FrictionContact(kt=1.0, mu=0.1, gap=[-1.0, -1.0, -1.0]), "shared": True}, "for each contact"),
    ],
)
def test_faults(body: ReducedBody, options: dict[str, object], said: str) -> None:
    with pytest.raises(InputError, match=said.replace("(", r"\(")):
        ss.surface_contacts(body, **{"contact": LAW, "direction": (1, 0, 0), **options})


def test_points_need_a_surface(body: ReducedBody) -> None:
    mesh = MeshModel(mesh=box((0.2, 0.02, 0.01), (4, 2, 1), "hex20"))
    model = assemble_mesh(mesh, source="beam", material=STEEL, fixed=["x0"])
    kept = ss.reduced_body(model, keep=[model.dofs[-1]], modes=4)
    with raises_fault("points", statement="the body has no contact points"):
        ss.surface_contacts(kept, contact=LAW, direction=(1, 0, 0))
    with raises_fault("model", found="'blade.cdb'", expected="what ss.import_model returns"):
        ss.reduced_body("blade.cdb", surface="y1")
    with raises_fault("body", found="ModalStructure(4 modes, 1 dof)", says=r"expected what ss\.reduced_body"):
        ss.surface_contacts(kept.structure, contact=LAW, direction=(1, 0, 0))
    with raises_fault("surface", statement="nothing is kept"):
        ss.reduced_body(model)
    with pytest.raises(InputError) as raised:
        ss.reduced_body(model, keep=[model.dofs[-1]], pressure="z1", radius=1e-3, films={"boundary": 1.0})
    assert [fault.where for fault in raised.value.faults] == [("radius",), ("pressure",), ("films",)]
    with raises_fault("influence", says="no influence matrix"):
        body.points.resistance()


AXIS = {"point": (0.0, -0.3, -0.1), "direction": (1.0, 0.0, 0.0), "zero": (0.0, 1.0, 0.0)}


def test_directions_about_an_axis_are_those_of_each_contact(body: ReducedBody) -> None:
    """The axis runs along x below the beam: at (y, z) from it radial is (y, z) and circumferential (-z, y) over r."""
    found = ss.surface_contacts(
        body, "tip", contact=LAW, direction="circumferential", normal="radial", points=[2, 3], axis=AXIS
    )
    for pair, k in zip(found, (1, 2), strict=True):
        arm = body.points.positions[k][1:] - AXIS["point"][1:]
        radius = np.hypot(*arm)
        assert pair.tangential == pytest.approx({f"c{k + 1}y": -arm[1] / radius, f"c{k + 1}z": arm[0] / radius})
        assert pair.normal == pytest.approx({f"c{k + 1}y": arm[0] / radius, f"c{k + 1}z": arm[1] / radius})
    along = ss.surface_contacts(body, "tip", contact=LAW, direction="axial", axis=AXIS)
    assert along[0].tangential == pytest.approx({"c1x": 1.0})
    inside = {**AXIS, "point": (0.0, 0.5, 0.0)}  # the surface looks at the axis: out of the body is towards it
    (pair, *_) = ss.surface_contacts(body, "tip", contact=LAW, direction="axial", normal="radial", axis=inside)
    assert pair.normal["c1y"] > 0.99


def test_each_contact_rubs_at_its_own_radius_and_angle(body: ReducedBody) -> None:
    profile = {"cos": {2: 3e-4}}
    found = ss.surface_contacts(
        body, "tip", contact=LAW, direction="circumferential", normal=True, axis=AXIS,
        rubbing=lambda radius, angles: ss.casing_motion(profile, radius=radius, angles=angles, lobes=2),
    )  # fmt: skip
    for pair, at in zip(found, body.points.positions, strict=True):
        radius, angle = np.hypot(at[1] + 0.3, at[2] + 0.1), np.arctan2(at[2] + 0.1, at[1] + 0.3)
        assert float(pair.rubbing.speed(1440.0)) == pytest.approx(720.0 * radius)
        assert float(pair.rubbing.normal_cos[1]) == pytest.approx(3e-4 * np.cos(2 * angle))
        assert float(pair.rubbing.normal_sin[1]) == pytest.approx(-3e-4 * np.sin(2 * angle))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"direction": "circumferential"}, "circumferential needs the axis of the rotor; give axis"),
        (
            {"direction": "tangential", "axis": AXIS},
            "found 'tangential'; expected one of radial, circumferential, axial",
        ),
        ({"normal": "radial"}, "radial needs the axis of the rotor"),
        ({"normal": "outward", "axis": AXIS}, "found 'outward'; expected true, false, or with an axis one of"),
        ({"direction": "radial", "normal": "radial", "axis": AXIS}, "radial is normal to the surface"),
        ({"normal": "axial", "axis": AXIS}, "axial runs along the surface at point 1, not across it"),
        ({"axis": {"point": (0, 0, 0)}}, "axis: found"),
        ({"rubbing": lambda r, a: None}, "a function of radius and angle needs an axis"),
        ({"rubbing": lambda r, a: None, "axis": AXIS}, "expected a function that gives an ss.RubbingMotion"),
        ({"rubbing": lambda r: None, "axis": AXIS}, "cannot be called with radius and angles"),
    ],
)
def test_faults_about_an_axis(body: ReducedBody, options: dict[str, object], said: str) -> None:
    with pytest.raises(InputError) as raised:
        ss.surface_contacts(body, **{"contact": LAW, "direction": (1, 0, 0), **options})
    assert said in str(raised.value)


def test_a_law_that_is_none_is_told_with_what_was_expected(body):
    with pytest.raises(InputError) as raised:
        ss.surface_contacts(body, contact=3, direction=(1, 0, 0))
    (fault,) = raised.value.faults
    assert (fault.found, fault.expected) == ("3", "ss.FrictionContact(...), or a law")


def test_points_that_slide_in_two_directions(body: ReducedBody) -> None:
    """The second direction is normal x direction; vectors of rubbing are the same for all points."""
    law = ss.PlanarFrictionContact(kt=1e5, mu=0.4, kn=2e4, normal_load=6.0)
    rub = ss.RubbingMotion(velocity=(3.0, 4.0), sin={1: (0.0, 5.0)})
    contacts = ss.surface_contacts(
        body, "a", contact=law, direction=(1.0, 0.0, 0.0), normal=True, shared=True, rubbing=rub
    )
    assert contacts[1].direction("tangential") == pytest.approx({"c2x": 1.0})
    assert contacts[1].direction("second") == pytest.approx({"c2z": -1.0})  # y x x
    assert [(pair.rubbing.velocity, pair.rubbing.second_velocity) for pair in contacts] == [(3.0, 4.0)] * 3
    assert contacts[0].rubbing.second_sin == {1: 5.0}
    assert sum(loads(contacts)) == pytest.approx(6.0)
    with pytest.raises(InputError, match="those of two points"):
        ss.surface_contacts(body, "a", contact=law, direction=(1, 0, 0), points=[1, 2], rubbing=rub)
