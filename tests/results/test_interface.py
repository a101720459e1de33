"""The map of the contacts between two surfaces: pressures, states and energies are those of the contacts."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers import blocks
from helpers.joint import SIZE, shaken_joint

import slipstick as ss
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.mesh import together
from slipstick.fem.model import elastic_model
from slipstick.report.content import content_of
from slipstick.report.writing import write_report
from slipstick.results.interface import QUANTITIES, STATES, interfaces_of


def test_places_areas_and_what_the_contacts_do() -> None:
    made = shaken_joint()
    (joint,) = interfaces_of(made)
    data = made.dataset
    assert (joint.name, joint.axes, joint.contacts.tolist()) == ("joint", ("x", "y"), list(range(12)))
    assert joint.areas.sum() == pytest.approx(SIZE[0] * SIZE[1], rel=1e-9)
    assert (joint.areas @ joint.flat.T / joint.areas.sum()) == pytest.approx([SIZE[0] / 2, SIZE[1] / 2], rel=1e-6)
    pressure, energy = (joint.values(made.table, key) for key in ("pressure", "dissipated_energy"))
    assert pressure is not None
    assert energy is not None
    assert pressure @ joint.areas == pytest.approx(data.normal_force.values[..., 0].sum(axis=1))
    assert np.all(pressure @ joint.areas > 0.8e6 * SIZE[0] * SIZE[1])  # the clamps press through it
    power = data.dissipated_power.values.sum(axis=1)
    assert (energy @ joint.areas) * data.omega.values / (2.0 * np.pi) == pytest.approx(power)
    state = joint.values(made.table, "state")
    assert state is not None
    for at in range(len(made)):
        for number, (name, spans) in zip(state[at], made.states(at).items(), strict=True):
            kinds = {kind.rstrip("+-") for _, _, kind in spans}
            expected = "open" if kinds == {"separation"} else "opens" if "separation" in kinds else "slips"
            assert STATES[int(number)] == ("sticks" if kinds == {"stick"} else expected), name
    assert {"slips", "sticks"} <= {STATES[int(number)] for number in state.ravel()}


def test_contacts_without_areas_are_no_interface() -> None:
    assert interfaces_of(blocks.branch(4)) == []
    with pytest.raises(InputError, match="no contact lies between two surfaces"):
        blocks.branch(4).plot.interface(0)


def test_areas_are_checked_and_stored(tmp_path: Path) -> None:
    law = ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0)
    for wrong in (-1.0, 0.0, "large", [1.0, -2.0]):
        with pytest.raises(InputError, match="area"):
            ss.ContactPair(name="a", tangential="x", contact=law, area=wrong)
    many = ss.ContactPair(name="a", tangential=["x", "y"], contact=law, area=[1.0, 2.0])
    assert len(many) == 2
    assert "area" in repr(many)
    made = shaken_joint()
    again = ss.load(made.save(tmp_path / "joint.nc"))
    assert interfaces_of(again)[0].areas == pytest.approx(interfaces_of(made)[0].areas)


def test_the_figure_has_a_map_for_each_quantity() -> None:
    made = shaken_joint()
    (joint,) = interfaces_of(made)
    axes = made.plot.interface(1)
    assert [ax.get_title() for ax in axes] == [said.capitalize() for said, _ in QUANTITIES.values()]
    pressure = joint.values(made.table, "pressure")
    assert pressure is not None
    assert np.asarray(axes[0].collections[0].get_array()) == pytest.approx(pressure[1])
    assert np.asarray(axes[0].collections[0].get_offsets()) == pytest.approx(joint.flat.T)
    sizes = axes[0].collections[0].get_sizes()
    assert sizes / sizes.max() == pytest.approx(joint.areas / joint.areas.max())
    assert axes[0].get_xlabel() == "x [mm]"
    with pytest.raises(InputError, match=r"found 'seam'.*expected one of joint"):
        made.plot.interface(1, "seam")


def test_the_page_and_paraview_have_the_same(tmp_path: Path) -> None:
    made = shaken_joint()
    (shown,) = content_of(made, "joint", contacts=12, dofs=12)["interfaces"]
    assert [own["key"] for own in shown["of"]] == list(QUANTITIES)
    pressure = interfaces_of(made)[0].values(made.table, "pressure")
    assert pressure is not None
    assert shown["of"][0]["most"] == pytest.approx(pressure.max())
    assert shown["of"][0]["after"] == " N/m^2"
    assert shown["names"][0] == "joint 1"
    assert 'id="interface"' in write_report(made, tmp_path / "page.html").read_text()
    text = made.save_shape(tmp_path / "shape.xdmf", 1, frames=2).read_text()
    assert text.count('Name="pressure"') == text.count('Name="dissipated_energy"') == 2


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_bolts_stand_on_the_map_as_rings() -> None:
    size, at = (0.06, 0.03, 0.004), (0.0, 0.0, 0.004)
    mesh = together({"low": box(size, (4, 2, 1)), "high": box(size, (3, 2, 1), at=at)})
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    x, y, z = mesh.nodes.T
    here = np.hypot(x - 0.03, y - 0.015) < 0.011
    washers = {"head": np.flatnonzero(here & (z > 0.0079)), "nut": np.flatnonzero(here & (z < 1e-6))}
    model = elastic_model(replace(mesh, node_sets={**mesh.node_sets, **washers}), steel, ["low.x0", "high.x1"])
    law = ss.PlanarFrictionContact(kt=1e11, kn=1e12, mu=0.3, normal_load=1e5)
    joint = ss.surface_pair(model, "low.z1", "high.z0", contact=law, points=8)
    bolts = [
        ss.bolt(name="bolt", elongation={"head z": 1.0, "nut z": -1.0}, stiffness=1e7),
        ss.bolt(name="anchor", elongation={"head z": 1.0}, stiffness=1e7),
    ]
    body = ss.reduced_body(model, pairs=joint, keep=["head z", "nut z"], modes=8, loss_factor=0.01)
    problem = ss.Problem(
        body.structure, contacts=[*joint, *bolts], loads=ss.Load(dof="head z", cos=1.0), harmonics=3, outputs="head z"
    )
    made = ss.steady_response(problem, omega=500.0)
    (found,) = interfaces_of(made)
    numbers, places = found.bolts
    assert [str(made.dataset.contact.values[k]) for k in numbers] == ["bolt"]
    middle = np.mean([mesh.nodes[nodes, :2].mean(axis=0) for nodes in washers.values()], axis=0)
    assert places[:, 0] == pytest.approx(middle)
    (drawn,) = content_of(made, "made", contacts=9, dofs=3)["interfaces"]
    assert [ring["name"] for ring in drawn["bolts"]] == ["bolt"]
    assert "bolt" in [rings.get_label() for rings in made.plot.interface(0)[0].collections]
