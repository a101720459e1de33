"""A script and a case file of the same finite element model give the same numbers, on every road."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.cases import BLOCKS

import slipstick as ss
from slipstick.case.case import Case, load_case
from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.io.model_file import save_model
from slipstick.models.blade_mesh import blade_shape

STEEL = ss.Material(young=2e11, poisson=0.3, density=7800.0)
HZ = 2 * np.pi
MU = [[20, 0.4], [200, 0.2]]

CASE = """format = 1
harmonics = "0..3"
[structure]
kind = "fe"
{structure}
loss_factor = 0.01
[[load]]
shape = "push"
cos = 500.0
{contacts}
[response]
from = "150 Hz"
to = "350 Hz"
{more}
"""


def model_file(folder: Path) -> Path:
    mesh = MeshModel(mesh=box((0.2, 0.02, 0.01), (4, 2, 1), "hex20"))
    return save_model(assemble_mesh(mesh, source="beam", material=STEEL, fixed=["x0"]), folder / "model.h5")


def case_problem(folder: Path, text: str) -> ss.Problem:
    (folder / "case.toml").write_text(text)
    return load_case(folder / "case.toml")


def same(case: ss.Problem, script: ss.Problem, omega: tuple[float, float], dof: str) -> None:
    assert [pair.name for pair in case.contacts] == [pair.name for pair in script.contacts]
    ours, theirs = (ss.forced_response(problem, omega=omega).dataset for problem in (script, case))
    np.testing.assert_allclose(ours.omega, theirs.omega, rtol=1e-12)
    np.testing.assert_allclose(
        ours.amplitude.sel(dof=dof), theirs.amplitude.sel(dof=dof), rtol=1e-9
    )  # the same objects, so the same steps
    np.testing.assert_allclose(ours.temperature, theirs.temperature, rtol=1e-9)
    np.testing.assert_allclose(ours.dissipated_power, theirs.dissipated_power, rtol=1e-9, atol=1e-15)


def test_two_laws_on_one_surface_with_heat(tmp_path: Path) -> None:
    """Everything a block can say: chosen points, normals, a shared load, conduction, own resistance, mu(T)."""
    path = model_file(tmp_path)
    structure = (
        'file = "model.h5"\nmaterial = { conductivity = 40.0 }\nsurface = "y1"\ncontacts = 3\nradius = 1.2e-2\n'
        'pressure = { push = "z1" }\nfilms = { boundary = 100.0 }\ncold = "x0"\nmodes = 6'
    )
    heat = '[thermal]\ninfluence = "structure"\nbackground = 20.0\n'
    case = case_problem(tmp_path, CASE.format(structure=structure, contacts=BLOCKS, more=heat))

    model = ss.import_model(path, conductivity=40.0)
    body = ss.reduced_body(
        model,
        surface="y1",
        contacts=3,
        radius=1.2e-2,
        pressure={"push": "z1"},
        films={"boundary": 100.0},
        cold="x0",
        modes=6,
        loss_factor=0.01,
    )
    pads = ss.surface_contacts(
        body,
        "pad",
        points=[2, 1],
        contact=ss.FrictionContact(kt=1e5, kn=2e4, mu=0.4, normal_load=1.0),
        direction=[0.0, 1.0, 1.0],
        normal=True,
        shared=True,
        rubbing=ss.RubbingMotion(velocity=0.005),
    )
    curve = ss.surface_contacts(
        body,
        "curve",
        points=[3],
        contact=ss.FrictionContact(kt=2e5, mu=0.3, normal_load=0.7),
        direction=[1.0, 0.0, 0.0],
    )
    problem = ss.Problem(
        body.structure,
        contacts=[*pads, *curve],
        loads=[ss.Load(shape="push", cos=500.0)],
        harmonics=ss.Harmonics(range(4)),
        thermal=ss.ThermalModel(
            curve={"pad 2": ss.FrictionCurve(mu=MU), "pad 1": ss.FrictionCurve(mu=MU)},
            background=20.0,
            resistance=body.points.resistance([2, 1, 3], own=[2.0, 2.0, 0.0]),
        ),
    )
    same(case, problem, (150 * HZ, 350 * HZ), "c1z")


def test_kept_dofs_and_an_accuracy(tmp_path: Path) -> None:
    path = model_file(tmp_path)
    model = ss.import_model(path)
    free = model.dofs[-1]
    structure = (
        f'file = "model.h5"\nsurface = {{ direction = [0, 1, 0], depth = 0.2 }}\ncontacts = 2\nkeep = ["{free}"]\n'
        'pressure = { push = "z1" }\naccuracy = 1e-6\nup_to = "2 kHz"\ndamping_ratio = 0.001'
    )
    contact = f'[[contact]]\nname = "a"\ntangential = "{free}"\nkt = 1e4\nmu = 0.3\nnormal_load = 1.0\n'
    case = case_problem(tmp_path, CASE.format(structure=structure, contacts=contact, more=""))
    body = ss.reduced_body(
        model,
        surface={"direction": [0.0, 1.0, 0.0], "depth": 0.2},
        contacts=2,
        keep=[free],
        pressure={"push": "z1"},
        accuracy=1e-6,
        up_to=2000.0 * HZ,
        damping_ratio=0.001,
        loss_factor=0.01,
    )
    assert body.structure.dofs == case.structure.dofs
    contact = ss.FrictionContact(kt=1e4, mu=0.3, normal_load=1.0)
    problem = ss.Problem(
        body.structure,
        contacts=[ss.ContactPair(name="a", contact=contact, tangential=free)],
        loads=[ss.Load(shape="push", cos=500.0)],
        harmonics=ss.Harmonics(range(4)),
    )
    same(case, problem, (150 * HZ, 350 * HZ), free)


def test_blade(tmp_path: Path) -> None:
    text = """format = 1
harmonics = "0..3"
[structure]
kind = "blade"
height = 0.2
contacts = 3
modes = 12
loss_factor = 0.001
[[load]]
shape = "pressure"
cos = 300.0
[[contact]]
name = "shroud"
points = "all"
direction = [0.0, 1.0, 0.0]
kt = 12e3
mu = 0.5
normal_load_total = 0.5
[response]
from = "200 Hz"
to = "300 Hz"
"""
    case = case_problem(tmp_path, text)
    shape = blade_shape("small", height=0.2)
    blade = ss.reduced_blade(shape, contacts=3, modes=12, loss_factor=0.001, cache=tmp_path / "slipstick-cache")
    assert blade.reused
    contacts = ss.surface_contacts(
        blade,
        "shroud",
        contact=ss.FrictionContact(kt=12e3, mu=0.5, normal_load=0.5),
        direction=[0.0, 1.0, 0.0],
        shared=True,
    )
    problem = ss.Problem(
        blade.structure,
        contacts=contacts,
        loads=[ss.Load(shape="pressure", cos=300.0)],
        harmonics=ss.Harmonics(range(4)),
    )
    same(case, problem, (200 * HZ, 300 * HZ), "c1y")


def test_faults_of_a_script_are_those_of_the_case_file(tmp_path: Path) -> None:
    """In the same words, all at once."""
    path = model_file(tmp_path)
    structure = 'file = "model.h5"\nsurface = "y11"\npressure = { push = "top" }\ncold = "x9"\nkeep = ["q"]'
    (tmp_path / "case.toml").write_text(CASE.format(structure=structure, contacts=BLOCKS, more=""))
    with pytest.raises(InputError) as told:
        load_case(tmp_path / "case.toml")
    with pytest.raises(InputError) as raised:
        ss.reduced_body(ss.import_model(path), surface="y11", pressure={"push": "top"}, cold="x9", keep=["q"])
    assert told.value.faults == tuple(fault.inside("structure") for fault in raised.value.faults)
    assert len(raised.value.faults) == 4


def test_load_case_warns_of_the_model(tmp_path: Path) -> None:
    mesh = MeshModel(mesh=box((0.2, 0.02, 0.01), (4, 2, 1), "hex20"))
    model = assemble_mesh(mesh, source="beam", material=STEEL, fixed=["x0"])
    damped = model.__class__(**{**vars(model), "C": model.K})
    save_model(damped, tmp_path / "model.h5")
    structure = 'file = "model.h5"\nsurface = "y1"\ncontacts = 3\npressure = { push = "z1" }\nmodes = 6'
    contact = BLOCKS[BLOCKS.index('[[contact]]\nname = "curve"') :]
    (tmp_path / "case.toml").write_text(CASE.format(structure=structure, contacts=contact, more=""))
    with pytest.warns(SlipstickWarning, match="holds a damping matrix") as caught:
        problem = load_case(tmp_path / "case.toml")
    assert len(caught) == 1
    with pytest.warns(SlipstickWarning, match="holds a damping matrix"):
        ss.reduced_body(damped, surface="y1", modes=6)
    assert problem.harmonics.orders == (0, 1, 2, 3)
    case = Case.from_file(tmp_path / "case.toml")
    assert case.span == pytest.approx((150 * HZ, 350 * HZ))
