"""Finite element models in case files: the curve is that of the objects; contacts on a surface; faults as sentences."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.ansys import BLADE, needs_blade
from helpers.command import slipstick
from typer.testing import CliRunner

import slipstick as ss
from slipstick.case.case import Case
from slipstick.case.script import python_script
from slipstick.case.structure import CACHE
from slipstick.cli.main import app
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import ImportedModel, elastic_model
from slipstick.fem.retained import retain
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.io.model_file import save_model
from slipstick.structure.reduction.reduce import reduce_model

STEEL = Material(young=2e11, poisson=0.3, density=7800.0, conductivity=40.0)
EXAMPLE = Path(__file__).parents[2] / "examples" / "blade" / "blade.toml"

STRUCTURE = """
[structure]
kind = "fe"
file = "model.h5"
surface = "y1"
contacts = 3
pressure = { pressure = "z1" }
modes = 6
loss_factor = 0.01
"""
CONTACT = """
[[contact]]
name = "pad"
points = "all"
direction = [1.0, 1.0, 0.0]
kt = 1e5
mu = 0.4
normal_load_total = 6.0
rubbing = { velocity = 0.1 }
"""
HEAD = 'format = 1\nharmonics = "0..3"\n'
LOAD = '[[load]]\nshape = "pressure"\ncos = 50.0\n'
RESPONSE = '[response]\nfrom = "150 Hz"\nto = "350 Hz"\n'


def beam() -> Mesh:
    return box((0.2, 0.02, 0.01), (4, 2, 1), "hex20")


def model_file(folder: Path, *, material: Material = STEEL, fixed: tuple[str, ...] = ("x0",)) -> Path:
    model: ImportedModel = assemble_mesh(MeshModel(mesh=beam()), source="beam", material=material, fixed=fixed)
    return save_model(model, folder / "model.h5")


def read(folder: Path, structure: str = STRUCTURE, contact: str = CONTACT, extra: str = "", load: str = LOAD) -> Case:
    return Case.from_text("\n".join([HEAD, structure, load, contact, RESPONSE, extra]), folder / "case.toml")


def faults(folder: Path, *args: str, **parts: str) -> tuple[str, ...]:
    with pytest.raises(InputError) as caught:
        read(folder, *args, **parts)
    return caught.value.sentences


def by_hand(**films: Any) -> Any:
    """The same contact model from the mesh, without import or case file."""
    return retain(elastic_model(beam(), STEEL, "x0"), surface="y1", contacts=3, pressure={"pressure": "z1"}, **films)


def test_curve_is_that_of_the_objects(tmp_path: Path) -> None:
    """To 1e-8 of its peak, in partial slip: the same matrices summed in another order, the same continuation."""
    model_file(tmp_path)
    contact = CONTACT.replace("[1.0, 1.0, 0.0]", "[0.0, 1.0, 1.0]").replace("= 0.1 ", "= 0.005 ").replace("6.0", "1.0")
    branch = read(tmp_path, contact=contact, load=LOAD.replace("50.0", "500.0")).run()
    whole = by_hand()
    structure = reduce_model(whole.model.K, whole.model.M, modes=6, loss_factor=0.01, **whole.request).structure
    loads = whole.points.areas / whole.points.areas.sum()
    pairs = [
        ss.ContactPair(
            name=name,
            contact=ss.FrictionContact(kt=1e5, mu=0.4, gap=-load),
            tangential=along,
            rubbing=ss.RubbingMotion(velocity=0.005),
        )
        for name, along, load in zip(whole.points.names, whole.points.tangential([0.0, 1.0, 1.0]), loads, strict=True)
    ]
    problem = ss.Problem(
        structure, contacts=pairs, loads=[ss.Load(shape="pressure", cos=500.0)], harmonics=ss.Harmonics(range(4))
    )
    hand = ss.forced_response(problem, omega=(2 * np.pi * 150.0, 2 * np.pi * 350.0))
    assert branch.outcome.ok
    mine, theirs = (float(b.dataset.amplitude.sel(dof="c1z").max()) for b in (branch, hand))
    assert mine == pytest.approx(theirs, rel=1e-8)
    assert 0.1 < float(branch.dataset.stick_fraction.max()) < 1.0
    assert list(branch.dataset.contact.values) == ["pad 1", "pad 2", "pad 3"]


def test_reduction_is_kept_beside_the_case(tmp_path: Path) -> None:
    model_file(tmp_path)
    first, second = read(tmp_path), read(tmp_path)
    assert first.body.reduced is not None
    assert second.body.reduced is not None
    assert (first.body.reduced.reused, second.body.reduced.reused) == (False, True)
    assert list((tmp_path / CACHE).glob("reduction-*.npz"))
    np.testing.assert_array_equal(first.structure.natural_frequencies, second.structure.natural_frequencies)


def test_normals_and_chosen_points(tmp_path: Path) -> None:
    """Two blocks share the points; the normal of y1 is +y, and 1, 1, 0 on it becomes x."""
    model_file(tmp_path)
    one = CONTACT.replace('points = "all"', 'points = [2]\nnormal = "surface"\nkn = 1e4')
    other = CONTACT.replace('"pad"', '"skid"').replace('points = "all"', "points = [3, 1]")
    contacts = {pair.name: pair for pair in read(tmp_path, contact=one + other).problem().contacts}
    assert list(contacts) == ["pad 2", "skid 3", "skid 1"]
    assert contacts["pad 2"].normal == pytest.approx({"c2y": 1.0})
    assert contacts["pad 2"].tangential == pytest.approx({"c2x": 1.0})
    assert float(np.asarray(contacts["pad 2"].contact.normal_load)) == pytest.approx(6.0)
    shared = [float(np.asarray(contacts[f"skid {k}"].contact.normal_load)) for k in (1, 3)]
    assert sum(shared) == pytest.approx(6.0)


def test_influence_of_the_structure(tmp_path: Path) -> None:
    """The matrix of the conduction model, with each contact's own resistance on the diagonal."""
    model_file(tmp_path)
    structure = STRUCTURE + 'films = { boundary = 100.0 }\ncold = "x0"\n'
    contact = CONTACT + "thermal = { resistance = 2.0 }\n"
    case = read(tmp_path, structure, contact, extra='[thermal]\ninfluence = "structure"\nbackground = 20.0\n')
    expected = by_hand(films={"boundary": 100.0}, cold="x0").points.influence + 2.0 * np.eye(3)
    np.testing.assert_allclose(case.problem().thermal.resistance, expected, rtol=1e-9)


def test_conductivity_may_come_from_the_case(tmp_path: Path) -> None:
    model_file(tmp_path, material=Material(young=2e11, poisson=0.3, density=7800.0))
    structure = STRUCTURE + "material = { conductivity = 40.0 }\nfilms = { boundary = 100.0 }\n"
    case = read(tmp_path, structure)
    assert case.body.reduced is not None
    expected = by_hand(films={"boundary": 100.0}).points.influence
    np.testing.assert_allclose(case.body.reduced.points.influence, expected, rtol=1e-9)


def test_kept_dofs_without_a_surface(tmp_path: Path) -> None:
    """Compliance of a kept dof is the one of the full model, and accuracy chooses the number of modes."""
    model_file(tmp_path)
    structure = '[structure]\nkind = "fe"\nfile = "model.h5"\nkeep = ["n5x", "n5z"]\naccuracy = 1e-5\nup_to = "1 kHz"\n'
    with pytest.raises(InputError, match="n5x"):
        read(tmp_path, structure, load="")  # node 5 lies on the fixed end
    mesh = beam()
    free = int(mesh.labels[np.flatnonzero(mesh.nodes[:, 0] > 0.19)[0]])
    contact = f'[[contact]]\nname = "a"\ntangential = "n{free}z"\nkt = 1e4\nmu = 0.3\nnormal_load = 1.0\n'
    load = f'[[load]]\ndof = "n{free}z"\ncos = 1.0\n'
    case = read(tmp_path, structure.replace("n5", f"n{free}"), contact, load=load)
    assert case.structure.dofs == (f"n{free}x", f"n{free}z")
    assert case.body.reduced is not None
    assert case.body.reduced.points is None
    assert len(case.body.reduced.structure.omega) < 40
    ((_, error),) = case.body.reduced.receptance_errors(2 * np.pi * 1000.0)
    assert error < 1e-5


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('surface = "y1"', 'surface = "y11"', "surface: there is no surface 'y11' in the model; did you mean 'y1'?"),
        ('= "z1"', '= "top"', "pressure.pressure: there is no surface 'top' in the model; there are x0"),
        ('"model.h5"', '"../model.h5"', "the path leaves the folder of the case"),
        ('"model.h5"', '"other.h5"', "there is no such file"),
        ("contacts = 3", "contacts = 50000", "expected at most 20000 contacts"),
        ("contacts = 3", "contacts = 500", "contacts: 500 nodes asked on a surface of"),
        ("contacts = 3", "contacts = []", "expected a number of contacts such as 8"),
        ("contacts = 3", "contacts = [1, 999999]", "999999"),
        ("modes = 6", "modes = 6\naccuracy = 1e-5", "modes is given together with accuracy"),
        ("modes = 6", 'fixed = ["x1", "rot"]', "fixed: there is no node set 'rot' in the model"),
        ("modes = 6", "modes = 6\nmaterial = { young = 1e11 }", "holds matrices with a material already"),
        ("modes = 6", 'modes = 6\ncold = "x9"', "cold: there is no node set 'x9'"),
        ("modes = 6", 'modes = 6\nfilms = { "y9" = 3.0 }', "films: there is no surface 'y9'"),
        ("modes = 6", "modes = 6\nquadratic = true", "give --quadratic to 'slipstick import'"),
        ("modes = 6", 'modes = 6\nkeep = ["q"]', "keep: there is no free dof 'q'"),
        ('surface = "y1"\ncontacts = 3\n', "", "nothing is kept"),
        ('surface = "y1"', "surface = { direction = [0, 0, 0] }", "not all 0"),
        ('surface = "y1"\ncontacts = 3\n', 'keep = ["n5z"]\n', "pressure is given without surface"),
    ],
)
def test_faults_of_the_structure(tmp_path: Path, old: str, new: str, said: str) -> None:
    model_file(tmp_path)
    found = faults(tmp_path, STRUCTURE.replace(old, new))
    assert any(said in fault for fault in found), found
    assert all(fault.count("\n") == 0 for fault in found)


def test_a_conductivity_is_needed(tmp_path: Path) -> None:
    model_file(tmp_path, material=Material(young=2e11, poisson=0.3, density=7800.0))
    (found,) = faults(tmp_path, STRUCTURE + "films = { boundary = 1.0 }\n")
    assert "no material has a conductivity" in found


def test_a_model_that_is_not_held(tmp_path: Path) -> None:
    model_file(tmp_path, fixed=())
    found = faults(tmp_path)
    assert len(found) == 1
    assert "singular" in found[0] or "constrain it" in found[0]


MESH = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
5, 0, 0, 1
6, 1, 0, 1
7, 1, 1, 1
8, 0, 1, 1
*ELEMENT, TYPE=C3D8, ELSET=EALL
1, 1, 2, 3, 4, 5, 6, 7, 8
*NSET, NSET=ROOT
1, 2, 3, 4
*NSET, NSET=TIP
5, 6, 7, 8
"""


AXIS = "axis = { point = [-0.1, 0, 0], direction = [0, 1, 0] }"
ROTATION = f'rotation = {{ speed = "6000 rpm", {AXIS} }}\n'


def test_a_model_at_speed(tmp_path: Path) -> None:
    """Computed from the mesh, or between matrices by speed; a reduction or the matrices themselves."""
    speed = 200.0 * np.pi
    model_file(tmp_path)
    model = ss.at_speed(
        ss.import_model(tmp_path / "model.h5"), speed, axis={"point": (-0.1, 0, 0), "direction": (0, 1, 0)}
    )
    save_model(model, tmp_path / "fast.h5")
    hand = ss.reduced_body(model, surface="y1", contacts=3, modes=6).structure.natural_frequencies
    case = read(tmp_path, structure=STRUCTURE + ROTATION)
    np.testing.assert_allclose(case.body.structure.natural_frequencies, hand, rtol=1e-9)
    assert hand[0] > 1.02 * read(tmp_path).body.structure.natural_frequencies[0]
    given = 'rotation = { speed = "6000 rpm", models = { "6000 rpm" = "fast.h5", "9000 rpm" = "fast.h5" } }\n'
    between = read(tmp_path, structure=STRUCTURE + given)
    np.testing.assert_allclose(between.body.structure.natural_frequencies, hand, rtol=1e-9)
    matrices = '[structure]\nkind = "matrices"\nfile = "model.h5"\n' + ROTATION
    load = LOAD.replace('shape = "pressure"', f'dof = "{model.dofs[-1]}"')
    contact = f'[[contact]]\nname = "pad"\ntangential = "{model.dofs[-1]}"\nkt = 1e3\nmu = 0.3\nnormal_load = 1.0\n'
    whole = read(tmp_path, structure=matrices, load=load, contact=contact).body.structure
    np.testing.assert_allclose(whole.natural_frequencies[0], hand[0], rtol=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"6000 rpm"', '"fast"', "[structure] rotation.speed"),
        ('"6000 rpm"', "0", "[structure] rotation.speed: found 0; expected a frequency > 0"),
        ("[0, 1, 0]", "[0, 0, 0]", "[structure] rotation.axis.direction"),
        ("[-0.1, 0, 0]", "[0, 0]", "[structure] rotation.axis.point: found [0, 0]; expected three numbers"),
        ("axis =", 'models = { "10 rpm" = "model.h5" }, axis =', "rotation.axis is given together with models"),
        (AXIS, 'models = { "10 rpm" = "model.h5" }', "the highest speed with"),
        (AXIS, "models = {}", "expected a table of model files by speed"),
        (AXIS, 'models = { "-1" = "m.h5" }', "rotation.models"),
        (f", {AXIS}", "", "rotation.axis is missing"),
        ("axis", "axes", "unknown key 'axes'"),
    ],
)
def test_faults_of_a_rotation(tmp_path: Path, old: str, new: str, said: str) -> None:
    model_file(tmp_path)
    assert ROTATION.replace(old, new) != ROTATION
    assert said in " ".join(faults(tmp_path, structure=STRUCTURE + ROTATION.replace(old, new)))


def test_a_mesh_may_be_named_in_the_case(tmp_path: Path) -> None:
    """It is assembled there and needs its material."""
    (tmp_path / "cube.inp").write_text(MESH)
    structure = (
        '[structure]\nkind = "fe"\nfile = "cube.inp"\nfixed = ["ROOT"]\nsurface = "TIP"\ncontacts = 1\nmodes = 12\n'
    )
    contact = CONTACT.replace("[1.0, 1.0, 0.0]", "[1.0, 0.0, 0.0]")
    (found,) = faults(tmp_path, structure, contact, load="")
    assert "is a mesh without material" in found
    (found,) = faults(tmp_path, structure + "material = { young = 1.0 , poisson = 0.3 }\n", contact, load="")
    assert "material.density is missing" in found
    material = "quadratic = true\nmaterial = { young = 2e11, poisson = 0.3, density = 7800.0 }\n"
    case = read(tmp_path, structure + material, contact, load='[[load]]\ndof = "c1x"\ncos = 1.0\n')
    assert case.body.reduced is not None
    assert case.body.reduced.n_dofs == 3 * 12


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('points = "all"', "points = [1, 4]", "points: found 4; expected a whole number from 1 to 3"),
        ('points = "all"', "points = [2, 2]", "give every point once"),
        ("[1.0, 1.0, 0.0]", "[0.0, 1.0, 0.0]", "is normal to the surface; give one along it"),
        ("normal_load_total", "normal_load = 1.0\nnormal_load_total", "keep one"),
        ("mu = 0.4", 'mu = 0.4\ntangential = "c1x"', "tangential is given together with points"),
        ("mu = 0.4", 'mu = 0.4\nnormal = "c1y"\nkn = 1.0', 'expected "surface"'),
        ("normal_load_total = 6.0", "", "the normal load is missing"),
        ("direction", "directoin", "unknown key 'directoin'"),
    ],
)
def test_faults_of_contacts_on_a_surface(tmp_path: Path, old: str, new: str, said: str) -> None:
    model_file(tmp_path)
    found = faults(tmp_path, contact=CONTACT.replace(old, new, 1))
    assert any(said in fault for fault in found), found
    assert len(found) == 1, found


def test_points_need_a_surface(tmp_path: Path) -> None:
    structure = '[structure]\nkind = "matrices"\ndofs = ["x"]\nmass = [[1.0]]\nstiffness = [[40.0]]\n'
    (found,) = faults(tmp_path, structure, load="")
    assert "the structure has no contact surface" in found


def test_heat_of_contacts_that_are_not_known(tmp_path: Path) -> None:
    """A fault elsewhere brings no second one about heat; a name that is no contact there is told."""
    model_file(tmp_path)
    thermal = '[thermal]\ninfluence = "structure"\nbackground = 20.0\n'
    contact = CONTACT + "thermal = { resistance = 2.0 }\n"
    assert len(faults(tmp_path, STRUCTURE.replace('"y1"', '"y7"'), contact, extra=thermal)) == 1
    hot = STRUCTURE + "films = { boundary = 100.0 }\n"
    (found,) = faults(tmp_path, hot, contact, extra=thermal + 'contacts = ["pad 4"]\n')
    assert "'pad 4' does not lie on the surface of the structure; did you mean 'pad" in found


def test_influence_needs_conduction(tmp_path: Path) -> None:
    model_file(tmp_path)
    (found,) = faults(tmp_path, extra='[thermal]\ninfluence = "structure"\nbackground = 20.0\n')
    assert "no influence matrix" in found


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('size = "small"', 'size = "smal"', "did you mean 'small'?"),
        ("modes = 32", "modes = 32\ncontacts = 900", "contacts: 900 nodes asked"),
        ("conductivity = 16.2", "conductivity = -1.0", "material.conductivity: found -1.0; expected a number >= 0"),
        ("young = 208e9, ", "", "material.young is missing"),
    ],
)
def test_faults_of_the_blade(tmp_path: Path, old: str, new: str, said: str) -> None:
    text = EXAMPLE.read_text(encoding="utf-8")
    assert old in text
    with pytest.raises(InputError) as caught:
        Case.from_text(text.replace(old, new), tmp_path / "blade.toml")
    assert any(said in sentence for sentence in caught.value.sentences), caught.value.sentences


def test_blade_example(tmp_path: Path) -> None:
    """Its reduction, its hot contacts and its peak: 3.86 mm at 209.6 Hz, where friction with 1 m/s only brakes."""
    case = Case.from_text(EXAMPLE.read_text(encoding="utf-8"), tmp_path / "blade.toml")
    assert case.body.reduced is not None
    assert 5000 < case.body.reduced.n_dofs < 5500
    assert case.structure.natural_frequencies[0] / (2 * np.pi) == pytest.approx(209.6, rel=2e-3)
    branch = case.run()
    assert branch.outcome.ok
    amplitude = branch.dataset.amplitude.sel(dof="c1y")
    at = int(np.argmax(amplitude.values))
    assert float(amplitude[at]) == pytest.approx(3.858e-3, rel=5e-3)
    assert float(branch.dataset.omega[at]) / (2 * np.pi) == pytest.approx(209.64, rel=1e-3)
    assert float(branch.dataset.temperature.max()) > 25.0 + 50.0


def test_check_tells_of_the_full_model(tmp_path: Path) -> None:
    model_file(tmp_path)
    path = tmp_path / "case.toml"
    path.write_text("\n".join([HEAD, STRUCTURE, LOAD, CONTACT, RESPONSE]))
    result = slipstick("check", path)
    assert result.exit_code == 0, result.output
    for part in (
        "full model: ",
        "6 modes, solver",
        "relative error of the receptance",
        "3 contact points",
        "(0, 1, 0)",
    ):
        assert part in result.stdout
    assert "contact 'pad 3': slides along c3x" in result.stdout


@pytest.mark.verify
@needs_blade
def test_turbine_blade_through_the_command_line(tmp_path: Path) -> None:
    """Import with the fir tree fixed, four contacts on the tip, pressure: the first resonance as by the objects."""
    pytest.importorskip("mapdl_archive")
    from slipstick.io.loading import load_dataset

    fixed = [word for k in range(1, 5) for word in ("--fix", f"FIRTREE{k}")]
    imported = CliRunner().invoke(
        app, ["import", str(BLADE), "-o", str(tmp_path / "model.h5"), *fixed, "--units", "inch, lbf, s"]
    )
    assert imported.exit_code == 0, imported.output
    assert "PRESSURE_SURF" in imported.stdout
    structure = (
        STRUCTURE.replace('"y1"', "{ direction = [0, 1, 0], depth = 0.02 }")
        .replace("contacts = 3", "contacts = 4")
        .replace('"z1"', '"PRESSURE_SURF"')
        .replace("modes = 6", "modes = 8")
    )
    contact = CONTACT.replace("[1.0, 1.0, 0.0]", "[1.0, 0.0, 0.0]").replace("0.1", "100.0").replace("1e5", "2e5")
    response = RESPONSE.replace("150", "2000").replace("350", "3300")
    path = tmp_path / "case.toml"
    path.write_text("\n".join([HEAD, structure, LOAD.replace("50.0", "0.1"), contact, response]))
    result = slipstick("run", path, "-o", tmp_path / "out", "--no-figures", "-q")
    assert result.exit_code == 0, result.output
    data = load_dataset(tmp_path / "out" / "results.nc")
    at = int(np.argmax(data.amplitude.sel(dof="c1x").values))
    assert float(data.omega[at]) / (2 * np.pi) == pytest.approx(2650.0, rel=0.01)
    assert float(data.dissipated_power.min()) >= 0.0


def test_stress_is_kept_with_the_results(tmp_path: Path) -> None:
    """The structure of a case has the strains that the same words give in Python."""
    model_file(tmp_path)
    words = 'stress = ["x0", 6]\nstress_at = "nodes"\n'
    strains = read(tmp_path, structure=STRUCTURE + words).problem().structure.strains  # type: ignore[attr-defined]
    body = ss.reduced_body(
        ss.import_model(str(tmp_path / "model.h5")), surface="y1", contacts=3, modes=6, stress=["x0", 6],
        stress_at="nodes", pressure={"pressure": "z1"},
    )  # fmt: skip
    known = body.structure.strains
    assert known is not None
    assert strains.places.labels.tolist() == known.places.labels.tolist()
    np.testing.assert_allclose(strains.static, known.static, rtol=1e-5, atol=1e-6 * np.abs(known.static).max())
    text = "\n".join([HEAD, STRUCTURE + words, LOAD, CONTACT, RESPONSE])
    assert 'stress=["x0", 6]' in python_script(text, "case.toml", tmp_path)
    with pytest.raises(InputError, match="stress_at is given without stress"):
        read(tmp_path, structure=STRUCTURE + 'stress_at = "nodes"')
    with pytest.raises(InputError, match=r"stress: found \[\]; expected elements"):
        read(tmp_path, structure=STRUCTURE + "stress = []")
