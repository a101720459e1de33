"""Frequencies of structures that turn: against CalculiX (non-linear static solution, then perturbation), and a beam."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.abaqus import TYPES, needs_ccx, run
from scipy.sparse.linalg import eigsh

from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import ImportedModel
from slipstick.fem.refine import quadratic
from slipstick.fem.rotation import at_speed
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.models.blade_mesh import BladeShape, blade_mesh

STEEL = Material(young=2.1e11, poisson=0.3, density=7800.0)


def frequencies(model: ImportedModel, count: int) -> np.ndarray:
    values = eigsh(model.K, k=count, M=model.M, sigma=0.0, return_eigenvectors=False)
    return np.sqrt(np.sort(values))


def held(mesh: Mesh, root: str) -> ImportedModel:
    return assemble_mesh(MeshModel(mesh=mesh), source="blade", material=STEEL, fixed=[root])


def calculix(mesh: Mesh, root: str, folder: Path, speed: float, axis, origin, count: int) -> np.ndarray:
    """*STATIC with NLGEOM and CENTRIF, then *FREQUENCY with PERTURBATION."""
    lines = ["*NODE, NSET=ALL"] + [f"{i},{','.join(f'{v:.12e}' for v in x)}" for i, x in enumerate(mesh.nodes, 1)]
    number = 0
    for kind, block in mesh.blocks.items():
        lines.append(f"*ELEMENT, TYPE={TYPES[kind]}, ELSET=E")
        for nodes in block + 1:
            words = [str(number := number + 1), *map(str, nodes)]
            lines += [",".join(words[:11]) + ("," if words[11:] else "")] + (
                [",".join(words[11:])] if words[11:] else []
            )
    lines += ["*NSET, NSET=ROOT", *(f"{i + 1}," for i in mesh.node_set(root)), "*BOUNDARY", "ROOT, 1, 3"]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{STEEL.young!r}, {STEEL.poisson!r}", "*DENSITY", repr(STEEL.density)]
    lines += ["*SOLID SECTION, ELSET=E, MATERIAL=M"]
    if speed:
        load = f"E, CENTRIF, {speed**2!r}, {', '.join(f'{v:.12e}' for v in (*origin, *axis))}"
        lines += [
            "*STEP, NLGEOM",
            "*CONTROLS, PARAMETERS=FIELD",
            "1e-7, 1e-7, , , , , , 1e-6",
            "*STATIC",
            "*DLOAD",
            load,
            "*END STEP",
        ]
    lines += ["*STEP, PERTURBATION" if speed else "*STEP", "*FREQUENCY", str(count), "*END STEP"]
    (folder / "m.inp").write_text("\n".join(lines) + "\n")
    run(folder / "m.inp")
    rows = (line.split() for line in (folder / "m.dat").read_text().splitlines())
    return np.array([float(row[2]) for row in rows if len(row) == 5 and row[0].isdigit()])


def twisted(kind: str) -> Mesh:
    """A bar from radius 0.15 to 0.45, twisted by 0.5 rad."""
    linear = {"hex20": "hex8", "tet10": "tet4", "wedge15": "wedge6"}.get(kind, kind)
    mesh = box((0.3, 0.04, 0.01), (8, 2, 1), linear)
    x, y, z = mesh.nodes.T - np.array([[0.0], [0.02], [0.005]])
    c, s = np.cos(0.5 * x / 0.3), np.sin(0.5 * x / 0.3)
    mesh = replace(mesh, nodes=np.stack([x + 0.15, y * c - z * s, y * s + z * c], axis=1))
    return quadratic(mesh) if kind != linear else mesh


@needs_ccx
@pytest.mark.parametrize("kind", ["hex8", "hex20", "tet4", "tet10", "wedge15"])
def test_every_element_at_speed_is_that_of_calculix(kind, tmp_path):
    """The line rises as theirs does: 6 frequencies, their own at rest taken off (their mass rules are other ones)."""
    mesh, axis, origin = twisted(kind), (0.0, 0.6, 0.8), (0.01, 0.0, 0.02)
    model = held(mesh, "x0")
    at_rest = frequencies(model, 6) / calculix(mesh, "x0", tmp_path, 0.0, axis, origin, 6)
    ours = frequencies(at_speed(model, 700.0, axis={"point": origin, "direction": axis}), 6)
    theirs = calculix(mesh, "x0", tmp_path, 700.0, axis, origin, 6)
    np.testing.assert_allclose(ours / at_rest, theirs, rtol=1e-4)


@needs_ccx
def test_campbell_lines_of_a_blade_are_those_of_calculix(tmp_path):
    """The parametric blade about an axis below its root, to 15 000 rpm and 0.5 % strain: every frequency to 1e-5."""
    mesh = blade_mesh(BladeShape(element_size=0.05, stretch=4.0))
    model = held(mesh, "root")
    axis, origin = (1.0, 0.0, 0.0), (0.0, 0.0, -0.3)
    rises = []
    for rpm in (0.0, 5000.0, 15000.0):
        speed = rpm * np.pi / 30.0
        ours = frequencies(at_speed(model, speed, axis={"point": origin, "direction": axis}), 8)
        theirs = calculix(mesh, "root", tmp_path, speed, axis, origin, 8)
        np.testing.assert_allclose(ours, theirs, rtol=1e-5)
        rises.append(ours[0])
    assert rises[-1] > 1.02 * rises[0]


FLAP = {0.0: 3.5160, 2.0: 4.1373, 4.0: 5.5850, 6.0: 7.3604, 10.0: 11.2023}
"""First frequencies of a uniform cantilever that turns, over its speed, both times sqrt(rho A L^4 / E I); no hub.
Wright, Smith, Thresher, Wang, Vibration modes of centrifugally stiffened beams, J. Applied Mechanics 49 (1982), 197."""


def test_a_beam_that_turns_has_the_frequencies_of_the_literature():
    """Out of the plane of rotation; within it the square of the frequency is less by that of the speed."""
    side, length = 0.02, 1.0
    mesh = box((length, side, side), (16, 1, 1), "hex20")
    mesh = replace(mesh, nodes=mesh.nodes - np.array([0.0, side / 2, side / 2]))
    steel = Material(young=2e11, poisson=0.0, density=8000.0)
    model = assemble_mesh(MeshModel(mesh=mesh), source="beam", material=steel, fixed=["x0"])
    scale = np.sqrt(steel.density * side**2 * length**4 / (steel.young * side**4 / 12.0))
    for speed, exact in FLAP.items():
        at = at_speed(model, speed / scale, axis={"direction": (0, 0, 2)})
        lag, flap = frequencies(at, 2) * scale
        assert flap == pytest.approx(exact, rel=1e-3)
        assert lag**2 + speed**2 == pytest.approx(exact**2, rel=2e-3)
