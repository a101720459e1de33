"""What an import warns of is said in the same words by Python, the import verb, check and run, and by a case."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.command import slipstick
from helpers.faults import raises_fault

from slipstick.case.case import Case
from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.model import elastic_model
from slipstick.importers.import_model import import_model, read_model
from slipstick.importers.roles import ImportOptions
from slipstick.io.model_file import load_model, save_model

STEEL = Material(young=2e11, poisson=0.3, density=7800.0)
SENTENCE = (
    "6 tet4 elements are linear, far too stiff in bending; put nodes in the middle of their edges "
    "(import: --quadratic; case: quadratic = true; Python: quadratic=True, or slipstick.fem.refine.quadratic) "
    "or mesh with quadratic elements"
)
CASE = """
format = 1
harmonics = "0..1"
[structure]
kind = "fe"
file = "{file}"
keep = ["n{tip}x"]
modes = 3
loss_factor = 0.01
{more}
[[load]]
dof = "n{tip}x"
cos = 1.0
[[contact]]
name = "pad"
tangential = "n{tip}x"
kt = 1e5
mu = 0.3
normal_load = 10.0
[response]
from = 100.0
to = 200.0
"""
MESH = 'fixed = ["ROOT"]\nmaterial = { young = 2e11, poisson = 0.3, density = 7800.0 }'


def write_mesh(folder: Path, more: str = "") -> Path:
    """A cube of six linear tetrahedra."""
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "tet4")
    lines = ["*NODE", *(f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in enumerate(mesh.nodes.tolist(), 1))]
    lines.append("*ELEMENT, TYPE=C3D4, ELSET=EALL")
    lines += [f"{i}, " + ", ".join(map(str, row)) for i, row in enumerate((mesh.blocks["tet4"] + 1).tolist(), 1)]
    lines += ["*NSET, NSET=ROOT", *(f"{label}," for label in (mesh.surfaces["x0"].nodes + 1).tolist())]
    path = folder / "cube.inp"
    path.write_text("\n".join(lines) + f"\n{more}")
    return path


def tip() -> int:
    return int(box((1.0, 1.0, 1.0), (1, 1, 1), "tet4").surfaces["x1"].nodes[0]) + 1


def warned(*arguments: object) -> list[str]:
    result = slipstick(*arguments)
    assert result.exit_code == 0, result.output
    return [line.removeprefix("warning: ") for line in result.stderr.splitlines() if line.startswith("warning: ")]


def test_linear_tetrahedra_on_every_road(tmp_path: Path) -> None:
    mesh, said = write_mesh(tmp_path), f"cube.inp: {SENTENCE}"
    options = ImportOptions(material=STEEL, fixed=["ROOT"])
    for road in (
        lambda: read_model(mesh, options),
        lambda: import_model(mesh, output=tmp_path / "model.h5", material=STEEL, fixed="ROOT"),
        lambda: load_model(tmp_path / "model.h5"),
        lambda: read_model(tmp_path / "model.h5"),
    ):
        with pytest.warns(SlipstickWarning) as caught:
            assert road().warnings == (said,)
        assert [str(warning.message) for warning in caught] == [said]
        assert caught[0].filename == __file__
    material = ("--young", "2e11", "--poisson", "0.3", "--density", "7800")
    assert said in warned("import", mesh, "-o", tmp_path / "again.h5", *material, "--fix", "ROOT", "--units", "SI")
    for number, (file, more) in enumerate((("again.h5", ""), ("cube.inp", MESH))):
        path = tmp_path / "case.toml"
        path.write_text(CASE.format(file=file, more=more, tip=tip()))
        assert said in Case.from_file(path).warnings()
        assert said in warned("check", path)
        assert said in warned("run", path, "-o", tmp_path / f"out{number}")


def test_quadratic_ones_are_not_warned_of(tmp_path: Path) -> None:
    mesh = write_mesh(tmp_path)
    assert read_model(mesh, ImportOptions(material=STEEL, fixed=["ROOT"], quadratic=True)).warnings == ()


def test_linear_tetrahedra_from_gmsh_and_in_python(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "tet4")
    cells = [("tetra", mesh.blocks["tet4"]), ("triangle", mesh.surfaces["x0"].faces["tri3"])]
    meshio.Mesh(mesh.nodes, cells).write(tmp_path / "cube.msh", file_format="gmsh22", binary=False)
    with pytest.warns(SlipstickWarning) as caught:
        model = read_model(tmp_path / "cube.msh", ImportOptions(material=STEEL))
    assert [str(warning.message) for warning in caught] == [f"cube.msh: {SENTENCE}"]
    assert any("2 triangle are no solids: they add no stiffness" in note for note in model.notes)
    with pytest.warns(SlipstickWarning) as caught:
        elastic_model(mesh, STEEL, "x0")
    assert [str(warning.message) for warning in caught] == [f"mesh: {SENTENCE}"]


def test_solids_of_higher_order_are_refused(tmp_path: Path) -> None:
    import numpy as np

    meshio = pytest.importorskip("meshio")
    points = np.random.default_rng(0).random((24, 3))
    cells = [("tetra", np.array([[0, 1, 2, 3]])), ("tetra20", np.arange(4, 24)[None, :])]
    meshio.Mesh(points, cells).write(tmp_path / "m.msh", file_format="gmsh22", binary=False)
    with pytest.raises(InputError, match=r"m\.msh: has elements of Gmsh type 29"):
        read_model(tmp_path / "m.msh", ImportOptions(material=STEEL))


def test_a_coupling_ends_every_road_with_the_same_sentence(tmp_path: Path) -> None:
    mesh = write_mesh(tmp_path, "*CONTACT PAIR, INTERACTION=I, TIED\nS1, S2\n")
    options = ImportOptions(material=STEEL, fixed=["ROOT"])
    with pytest.raises(InputError) as caught:
        read_model(mesh, options)
    (said,) = caught.value.sentences
    assert "*CONTACT PAIR glues surfaces together (TIED)" in said
    (tmp_path / "case.toml").write_text(CASE.format(file="cube.inp", more=MESH, tip=tip()))
    for arguments in (
        ["import", mesh, "-o", tmp_path / "m.h5", "--young", "2e11", "--poisson", "0.3", "--density", "7800"],
        ["check", tmp_path / "case.toml"],
        ["run", tmp_path / "case.toml", "-o", tmp_path / "out"],
    ):
        result = slipstick(*arguments)
        assert result.exit_code == 2
        assert said in result.stderr
        assert "Traceback" not in result.output
    assert not (tmp_path / "m.h5").exists()


def test_files_and_options_without_effect_are_refused(tmp_path: Path) -> None:
    mesh = write_mesh(tmp_path)
    save_model(read_model(mesh, ImportOptions(material=STEEL, fixed=["ROOT"]), quiet=True), tmp_path / "model.h5")
    (tmp_path / "other.inp").write_text(mesh.read_text())
    with raises_fault("other.inp", statement="what it is for does not show"):
        read_model([mesh, tmp_path / "other.inp"], ImportOptions(material=STEEL))
    for options in (ImportOptions(material=STEEL), ImportOptions(quadratic=True)):
        with raises_fault("model.h5", statement="holds matrices"):
            read_model(tmp_path / "model.h5", options)
    np.savez(tmp_path / "bare.npz", K=np.eye(2), M=np.eye(2), dof_nodes=[1, 1], dof_components=[1, 2])
    with pytest.raises(InputError, match="conductivity: without a mesh it has no effect"):
        read_model(tmp_path / "bare.npz", ImportOptions(conductivity=40.0))
