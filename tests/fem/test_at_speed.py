"""Models at speed: arguments, notes, matrices between speeds."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.imported import STEEL

import slipstick as ss
from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.at_speed import at_speed
from slipstick.fem.box import box
from slipstick.fem.imported import ImportedModel
from slipstick.importers.mesh_model import MeshModel, assemble_mesh

ABOUT = {"direction": (0, 0, 1)}


@pytest.fixture(scope="module")
def blade() -> ImportedModel:
    mesh = box((0.3, 0.03, 0.01), (3, 1, 1), "hex20")
    return assemble_mesh(MeshModel(mesh=mesh), source="blade", material=STEEL, fixed=["x0"])


def test_the_note_says_what_was_done(blade):
    found = at_speed(blade, 500.0, axis={"point": (-0.1, 0, 0), "direction": [0, 0, 2]})
    assert found.speed == 500.0
    assert "at 500 rad/s about (0, 0, 1) through (-0.1, 0, 0): largest static displacement" in found.notes[-1]
    assert "Coriolis forces are left out" in found.notes[-1]
    assert blade.speed == 0.0
    with pytest.raises(InputError, match="blade is a model at 500 rad/s already"):
        at_speed(found, 600.0, axis=ABOUT)


def test_speeds_survive_a_model_file(blade, tmp_path):
    from slipstick.io.model_file import load_model, save_model

    save_model(at_speed(blade, 500.0, axis=ABOUT), tmp_path / "m.h5")
    assert load_model(tmp_path / "m.h5").speed == 500.0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"speed": 1.0}, "axis.*found None.*expected a table"),
        ({"speed": 1.0, "axis": {"direction": (0, 0, 1)}, "others": {1.0: None}}, "axis.*together with others"),
        ({"speed": -1.0}, "speed.*found -1.0.*expected a speed >= 0"),
        ({"speed": "fast"}, "speed.*found 'fast'"),
        ({"speed": 1.0, "axis": {"direction": (0, 0)}}, "axis, direction"),
        ({"speed": 1.0, "axis": {"direction": (0, 0, 0)}}, "axis, direction"),
        ({"speed": 1.0, "axis": {"direction": (0, 0, 1), "point": "here"}}, "axis, point"),
        ({"speed": 1.0, "others": {}}, "others.*expected"),
        ({"speed": 1.0, "others": {"a": 1}}, "others.*expected"),
        ({"speed": 1.0, "others": {0.0: None}}, "others.*expected"),
    ],
)
def test_wrong_arguments(blade, arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        at_speed(blade, **arguments)


def test_matrices_between_speeds(blade):
    """Linear in the square of the speed; rows in another order are found by name."""
    at = {speed: replace(blade, K=(1.0 + speed**2 / 1e4) * blade.K) for speed in (50.0, 100.0)}
    turned = np.arange(blade.n_dofs)[::-1]
    other = at[100.0]
    at[100.0] = replace(
        other,
        K=other.K[turned][:, turned],
        M=other.M[turned][:, turned],
        dof_nodes=other.dof_nodes[turned],
        dof_components=other.dof_components[turned],
    )
    for speed in (0.0, 20.0, 50.0, 80.0, 100.0):
        found = at_speed(blade, speed, others=at)
        assert abs(found.K - (1.0 + speed**2 / 1e4) * blade.K).max() < 1e-12 * abs(blade.K).max()
    with pytest.raises(InputError, match="expected at most 100, the highest speed with matrices"):
        at_speed(blade, 101.0, others=at)
    with pytest.raises(InputError, match="have different mass; matrices at speeds are of one model"):
        at_speed(blade, 10.0, others={100.0: replace(blade, M=2.0 * blade.M)})
    with pytest.raises(InputError, match="have different dofs"):
        at_speed(blade, 10.0, others={100.0: replace(blade, dof_nodes=blade.dof_nodes + 1)})


def test_what_looks_wrong_is_warned_of(blade):
    with pytest.warns(SlipstickWarning, match=r"the strain at speed is 0\.\d+, beyond what metals bear"):
        at_speed(blade, 9000.0, axis=ABOUT)
    heavy = replace(blade, M=1.5 * blade.M)
    with pytest.warns(SlipstickWarning, match="centrifugal forces are those of the mesh"):
        at_speed(heavy, 100.0, axis=ABOUT)


def test_a_blade_at_speed_is_a_structure(blade):
    """Stiffer in bending out of the plane of rotation, in a reduction too."""
    tip = next(name for name in blade.dofs[::-1] if name.endswith("z"))
    first = [
        ss.reduced_body(model, keep=[tip], modes=4).structure.natural_frequencies[0]
        for model in (blade, at_speed(blade, 1000.0, axis=ABOUT))
    ]
    assert first[1] > 1.1 * first[0]
