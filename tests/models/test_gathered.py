"""Contacts of a pair of surfaces gathered into patches that move as one, beside the joint with all its unknowns."""

from dataclasses import replace

import numpy as np
import pytest

import slipstick as ss
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.mesh import together
from slipstick.fem.model import elastic_model
from slipstick.results.deflection import contact_places

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

STEEL = ss.Material(young=2e11, poisson=0.3, density=7800.0)
SIZE = (0.12, 0.02, 0.01)
AREA = SIZE[0] * SIZE[1]
LAW = ss.PlanarFrictionContact(kt=1e11, kn=4e11, mu=0.1, gap=0.0)
FORCE = 4e3


class Lap:
    """Two bars on each other, held at opposite ends, pressed in the middle."""

    def __init__(self, points: int) -> None:
        lower, upper = box(SIZE, (12, 2, 1), "hex20"), box(SIZE, (9, 2, 1), "hex20", at=(0.0, 0.0, SIZE[2]))
        mesh = together({"lower": lower, "upper": upper})
        model = elastic_model(mesh, STEEL, ["lower.x0", "upper.x1"])
        apart = np.linalg.norm(mesh.nodes - [0.053, 0.01, 2.0 * SIZE[2]], axis=1)
        self.dof = f"n{mesh.labels[np.argmin(apart)]}z"
        self.model = model
        self.fine = ss.surface_pair(model, "lower.z1", "upper.z0", contact=LAW, name="lap", points=points)
        self.body = ss.reduced_body(model, pairs=self.fine, keep=[self.dof], modes=12, loss_factor=1e-3)
        self.step = ss.LoadStep(name="press", loads=ss.Load(dof=self.dof, harmonic=0, cos=-FORCE))
        self.state = self.loaded(self.fine)

    def problem(self, joint: object, structure: object = None) -> ss.Problem:
        return ss.Problem(structure or self.body.structure, contacts=joint, outputs=[self.dof], harmonics=[0, 1])

    def loaded(self, joint: object, structure: object = None) -> object:
        return ss.preload(self.problem(joint, structure), self.step, pairs=joint)

    def damping(self, joint: object, sizes: object, state: object = None, structure: object = None) -> np.ndarray:
        state = self.loaded(joint, structure) if state is None else state
        problem = self.problem(joint, structure).preloaded(state)
        mode = ss.nonlinear_modes(problem, amplitude=(0.5 * sizes[0], 1.1 * sizes[-1]), dof=self.dof, mode=2).dataset
        return np.interp(sizes, mode.modal_amplitude, mode.modal_damping)


@pytest.fixture(scope="module")
def lap() -> Lap:
    return Lap(24)


def test_patches_keep_area_unknowns_and_pressure(lap: Lap) -> None:
    joint = lap.fine.gathered(8, lap.state)
    assert sum(len(pair) for pair in joint) == 24
    assert joint.points.areas.sum() == pytest.approx(AREA, rel=1e-12)
    assert len(lap.problem(joint).port_directions) == 24
    assert joint[0].elements[0] == "lap 1.1"
    assert "8 patches move as one each, of 24 contacts" in joint.notes[-1]
    again = lap.loaded(joint).dataset.isel(step=-1)
    order = [int(np.argmin(np.linalg.norm(lap.fine.points.positions - at, axis=1))) for at in joint.points.positions]
    assert sorted(order) == list(range(24))
    np.testing.assert_allclose(joint.points.areas, lap.fine.points.areas[order], rtol=1e-12)
    before = lap.state.dataset.isel(step=-1)
    assert float(again.normal_resultant[0]) == pytest.approx(float(before.normal_resultant[0]), rel=0.05)
    pressure = before.pressure.values[order]
    np.testing.assert_allclose(again.pressure.values, pressure, atol=0.15 * pressure.max())  # bars bend about patches


def test_contacts_of_patches_have_their_own_places(lap: Lap) -> None:
    joint = lap.fine.gathered(5, lap.state)
    np.testing.assert_allclose(contact_places(lap.problem(joint)), joint.points.positions, atol=1e-9)


def test_one_contact_a_patch_changes_nothing(lap: Lap) -> None:
    joint = lap.fine.gathered(24, lap.state)
    one, other = (lap.loaded(each).dataset.isel(step=-1) for each in (joint, lap.fine))
    for k, at in enumerate(joint.points.positions):
        e = int(np.argmin(np.linalg.norm(lap.fine.points.positions - at, axis=1)))
        assert float(one.normal_force[k]) == pytest.approx(float(other.normal_force[e]), rel=1e-7, abs=1e-7 * FORCE)
        assert float(one.gap[k]) == pytest.approx(float(other.gap[e]), abs=1e-14)


def test_stiffness_grows_with_a_power_of_the_pressure(lap: Lap) -> None:
    joint = lap.fine.gathered(4, lap.state, exponent=1.0 / 3.0)
    kt = np.concatenate([pair.values("kt") for pair in joint])
    kn = np.concatenate([pair.values("kn") for pair in joint])
    before = lap.state.dataset.isel(step=-1)
    order = [int(np.argmin(np.linalg.norm(lap.fine.points.positions - at, axis=1))) for at in joint.points.positions]
    ratio = before.pressure.values[order] / (float(before.normal_resultant[0]) / AREA)
    np.testing.assert_allclose(kt, 1e11 * joint.points.areas * np.maximum(ratio, 1e-4) ** (1.0 / 3.0), rtol=1e-9)
    np.testing.assert_allclose(kn, 4e11 * joint.points.areas, rtol=1e-12)


def test_what_cannot_be_gathered_is_refused(lap: Lap) -> None:
    joint = lap.fine.gathered(4, lap.state)
    with pytest.raises(InputError, match="gathered already"):
        joint.gathered(2, lap.state)
    with pytest.raises(InputError, match="patches: found 25; expected at most 24, the number of contacts"):
        lap.fine.gathered(25, lap.state)
    with pytest.raises(InputError, match="has no contacts 'lap'"):
        joint.replaced_in(replace(lap.problem(lap.fine), contacts=[]))
    with pytest.raises(InputError, match=r"what ss\.preload"):
        lap.fine.gathered(2, lap.state.dataset)
    with pytest.raises(InputError, match="a power >= 0"):
        lap.fine.gathered(2, lap.state, exponent=-1.0)
    other = ss.surface_pair(lap.model, "lower.z1", "upper.z0", contact=LAW, name="other", points=3)
    with pytest.raises(InputError, match="has no contacts 'other 1'"):
        other.gathered(2, lap.state)
    idle = ss.preload(
        lap.problem(lap.fine), ss.LoadStep(name="pull", loads=ss.Load(dof=lap.dof, harmonic=0, cos=FORCE))
    )
    idle = replace(idle, dataset=idle.dataset.assign(normal_force=0.0 * idle.dataset.normal_force))
    with pytest.raises(InputError, match="nothing presses contacts 'lap'"):
        lap.fine.gathered(2, idle)


def test_patches_of_many_contacts_dissipate_as_the_whole_joint(lap: Lap) -> None:
    def power(joint: object, state: object) -> float:
        load = ss.Load(dof=lap.dof, cos=1000.0)
        problem = replace(lap.problem(joint), loads=load).preloaded(state)
        return float(ss.steady_response(problem, omega=3000.0).dataset.dissipated_power.sum())

    patches = lap.fine.gathered(8, lap.state)
    assert power(patches, lap.loaded(patches)) == pytest.approx(power(lap.fine, lap.state), rel=0.2)


@pytest.mark.verify
def test_patches_of_many_contacts_damp_as_the_whole_joint_on_a_finer_one() -> None:
    check(Lap(60), 12, np.geomspace(2e-6, 4e-5, 6))


def check(lap: Lap, patches: int, sizes: np.ndarray) -> None:
    """Damping beside that of all contacts: gathered patches are nearer than patches with one contact each."""
    truth = lap.damping(lap.fine, sizes, lap.state)
    gathered = lap.damping(lap.fine.gathered(patches, lap.state), sizes)
    few = ss.surface_pair(lap.model, "lower.z1", "upper.z0", contact=LAW, name="lap", points=patches)
    body = ss.reduced_body(lap.model, pairs=few, keep=[lap.dof], modes=12, loss_factor=1e-3)
    thinned = lap.damping(few, sizes, structure=body.structure)
    print(truth, gathered, thinned)
    wrong, worse = (np.abs(each / truth - 1.0).max() for each in (gathered, thinned))
    assert wrong < 0.25
    assert wrong < 0.6 * worse
