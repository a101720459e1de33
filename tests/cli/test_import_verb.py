"""The import verb: a mesh written here becomes a model; faults are sentences and nothing is overwritten."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.command import slipstick

from slipstick.fem.box import box
from slipstick.io.model_file import load_model

SIZE, DIVISIONS = (0.2, 0.02, 0.01), (4, 2, 1)
MATERIAL = ("--young", "2e11", "--poisson", "0.3", "--density", "7800")


def write_beam(folder: Path) -> Path:
    """A beam of hex20 elements with the sets ROOT (x = 0) and TIP (y = top) and one as Abaqus makes; no material."""
    mesh = box(SIZE, DIVISIONS, "hex20")
    lines = ["*NODE", *(f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in enumerate(mesh.nodes.tolist(), 1))]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=EALL")
    for number, element in enumerate((mesh.blocks["hex20"] + 1).tolist(), 1):
        lines += [f"{number}, " + ", ".join(map(str, element[:12])) + ",", ", ".join(map(str, element[12:]))]
    for name, side in (("ROOT", "x0"), ("TIP", "y1"), ("BACK", "z0"), ("_PickedSet4", "x0")):
        labels = (mesh.surfaces[side].nodes + 1).tolist()
        lines += [f"*NSET, NSET={name}", *(f"{label}," for label in labels)]
    path = folder / "beam.inp"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_mesh_becomes_a_model(tmp_path: Path) -> None:
    """Free dofs: 3 for each node off the root; its sets and units are in the file, nothing half written is left."""
    mesh, out = box(SIZE, DIVISIONS, "hex20"), tmp_path / "model.h5"
    result = slipstick("import", write_beam(tmp_path), "-o", out, *MATERIAL, "--fix", "ROOT", "--units", "SI")
    assert result.exit_code == 0, result.output
    model = load_model(out)
    assert model.n_dofs == 3 * (mesh.n_nodes - len(mesh.surfaces["x0"].nodes))
    assert "units: SI" in result.stdout
    assert f"{model.n_dofs} dofs" in result.stdout
    assert "ROOT" in result.stdout
    assert {*model.node_sets} >= {"ROOT", "TIP"}
    assert [path.name for path in tmp_path.iterdir() if path.suffix in (".part", ".tmp")] == []


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "is a mesh without material; give young, poisson and density"),
        (("--young", "2e11"), "--poisson is missing"),
        (
            (*MATERIAL, "--fix", "ROOTS"),
            "node set 'ROOTS' is not in the mesh; it has: BACK, ROOT, TIP; did you mean 'ROOT'?\n",
        ),
        ((*MATERIAL, "--name", "KGG"), "expected K=NAME"),
        ((*MATERIAL, "--map", "nowhere.txt"), "nowhere.txt: there is no such file"),
        (("--young", "-1", "--poisson", "0.3", "--density", "1"), "young: found -1.0; expected a modulus > 0"),
    ],
)
def test_faults_are_sentences(tmp_path: Path, arguments: tuple[str, ...], said: str) -> None:
    result = slipstick("import", write_beam(tmp_path), "-o", tmp_path / "model.h5", *arguments)
    assert result.exit_code == 2
    assert said in result.output
    assert "Traceback" not in result.output
    assert not (tmp_path / "model.h5").exists()


def test_an_earlier_model_stays(tmp_path: Path) -> None:
    """Without --force it is refused; with --force a failing import leaves it as it was, a good one replaces it.

    What is no such file is not replaced at all.
    """
    out, mesh = tmp_path / "model.h5", write_beam(tmp_path)
    earlier = b"\x89HDF\r\n\x1a\n earlier"
    out.write_bytes(earlier)
    refused = slipstick("import", mesh, "-o", out, *MATERIAL, "--fix", "ROOT")
    assert refused.exit_code == 2
    assert "is there already" in refused.output
    failed = slipstick("import", mesh, "-o", out, "--force")
    assert failed.exit_code == 2
    assert out.read_bytes() == earlier
    out.write_text("of the user")
    other = slipstick("import", mesh, "-o", out, *MATERIAL, "--fix", "ROOT", "--force")
    assert (other.exit_code, "there is a file that is no netCDF or HDF5 file" in other.output) == (2, True)
    assert out.read_text() == "of the user"
    out.write_bytes(earlier)
    assert slipstick("import", mesh, "-o", out, *MATERIAL, "--fix", "ROOT", "--force").exit_code == 0
    assert np.all(load_model(out).K.diagonal() > 0.0)


@pytest.mark.parametrize(("output", "said"), [("model.nc", "ends in .h5"), ("nowhere/model.h5", "make it first")])
def test_the_output_is_a_model_in_a_folder(tmp_path: Path, output: str, said: str) -> None:
    result = slipstick("import", write_beam(tmp_path), "-o", tmp_path / output, *MATERIAL)
    assert result.exit_code == 2
    assert said in result.output


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    result = slipstick("import", tmp_path / "no.cdb", "-o", tmp_path / "model.h5")
    assert result.exit_code == 2
    assert "there is no such file" in result.output
