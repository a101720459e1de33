"""Matrices against CalculiX, which writes its own in the test (`*FREQUENCY, SOLVER=MATRIXSTORAGE`)."""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array, csr_array

from slipstick.fem import assembly
from slipstick.fem.assembly import assemble, conduction
from slipstick.fem.boundary import boundary
from slipstick.fem.box import box
from slipstick.fem.conduction import conductance, steady_temperature
from slipstick.fem.elements import ELEMENTS, LINEAR
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.refine import quadratic
from slipstick.models.blade_mesh import WETTED, blade_mesh, blade_shape

pytestmark = [pytest.mark.verify, pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not here")]

NAMES = {"hex8": "C3D8", "hex8i": "C3D8I", "hex8r": "C3D8R"}
NAMES |= {"hex20": "C3D20", "tet4": "C3D4", "tet10": "C3D10", "wedge6": "C3D6", "wedge15": "C3D15"}
SOLID = Material(young=2.0, poisson=0.3, density=3.0)


def model_lines(mesh: Mesh) -> list[str]:
    """Nodes and elements; element numbers run through the blocks."""
    lines = ["*NODE,NSET=ALL"]
    lines += [f"{i},{','.join(f'{v:.12e}' for v in x)}" for i, x in enumerate(mesh.nodes, start=1)]
    for kind, block in mesh.blocks.items():
        lines.append(f"*ELEMENT,TYPE={NAMES[kind]},ELSET=E")
        for number, nodes in enumerate(block + 1, start=1):
            words = [str(number), *map(str, nodes)]
            lines += [",".join(words[:11]) + ("," if words[11:] else "")] + (
                [",".join(words[11:])] if words[11:] else []
            )
    return lines


def run(lines: list[str], folder: Path) -> None:
    (folder / "m.inp").write_text("\n".join(lines) + "\n")
    subprocess.run(["ccx", "-i", "m"], cwd=folder, capture_output=True, check=False)


def calculix(mesh: Mesh, material: Material, folder: Path) -> dict[str, coo_array]:
    """Its stiffness ("sti") and mass ("mas") in our order of degrees of freedom."""
    lines = model_lines(mesh)
    lines += [
        "*MATERIAL,NAME=M",
        "*ELASTIC",
        f"{material.young!r},{material.poisson!r}",
        "*DENSITY",
        repr(material.density),
    ]
    lines += ["*SOLID SECTION,ELSET=E,MATERIAL=M", "*STEP", "*FREQUENCY,SOLVER=MATRIXSTORAGE", "1", "*END STEP"]
    run(lines, folder)
    names = [line.strip().split(".") for line in (folder / "m.dof").read_text().split()]
    dof = np.array([3 * (int(node) - 1) + int(axis) - 1 for node, axis in names])
    result = {}
    for part in ("sti", "mas"):
        row, column, value = np.loadtxt(folder / f"m.{part}").T
        i, j = dof[row.astype(int) - 1], dof[column.astype(int) - 1]
        off = i != j
        entries = np.concatenate([value, value[off]]), (np.concatenate([i, j[off]]), np.concatenate([j, i[off]]))
        n, size = 3 * mesh.n_nodes, dof.max() + 1
        whole = coo_array(entries, shape=(size, size)).tocsr()
        inner = np.setdiff1d(dof, np.arange(n))  # of incompatible modes, in nodes of its own
        own, across = whole[inner][:, inner].toarray(), whole[:n][:, inner].toarray()
        result[part] = whole[:n, :n] - csr_array(across @ np.linalg.pinv(own) @ across.T) if len(inner) else whole
    return result


def moved(kind: str) -> Mesh:
    linear = LINEAR.get(kind, kind)
    mesh = box((1.0, 1.2, 0.9), (2, 2, 2), linear)
    nodes, inside = mesh.nodes.copy(), np.setdiff1d(np.arange(mesh.n_nodes), boundary(mesh).nodes)
    nodes[inside] += np.random.default_rng(5).uniform(-0.1, 0.1, (len(inside), 3))
    mesh = Mesh(nodes=nodes, blocks=mesh.blocks)
    return rounded(quadratic(mesh) if kind != linear else mesh)


def rounded(mesh: Mesh) -> Mesh:
    """Coordinates as CalculiX reads them: twenty characters."""
    return Mesh(nodes=np.vectorize(lambda v: float(f"{v:.12e}"))(mesh.nodes), blocks=mesh.blocks)


@pytest.mark.parametrize(
    "kind, file, name",
    [
        *((kind, "sti", "stiffness") for kind in ("hex8", "hex20", "tet4", "tet10", "wedge15")),
        *((kind, "mas", "mass") for kind in ("hex8", "hex20")),
    ],
)
def test_matrices(kind, file, name, tmp_path):
    mesh = moved(kind)
    theirs, ours = calculix(mesh, SOLID, tmp_path)[file], getattr(assemble(mesh, SOLID), name)
    assert abs(ours - theirs).max() < 1e-12 * abs(theirs).max()


@pytest.mark.parametrize("kind", ["hex8r", "hex8i"])
def test_bricks_that_do_not_lock(kind, tmp_path, monkeypatch):
    """With 0.0005 E for hourglass patterns, as CalculiX has.

    Elements are parallelepipeds: of others CalculiX takes one linear part of three out of the patterns, and makes
    incompatible modes otherwise.
    """
    made = box((1.0, 1.2, 0.9), (2, 2, 2), kind)
    mesh = rounded(replace(made, nodes=made.nodes @ np.array([[1.0, 0.1, 0.0], [0.2, 1.0, -0.1], [0.0, 0.3, 1.0]])))
    theirs = calculix(mesh, SOLID, tmp_path)["sti"]
    factor = 0.0005 * SOLID.young / SOLID.shear_modulus
    monkeypatch.setattr(assembly, "HOURGLASS", factor)
    assert abs(assemble(mesh, SOLID).stiffness - theirs).max() < 1e-12 * abs(theirs).max()


@pytest.mark.parametrize("kind", ["tet10", "wedge15"])
def test_mass_with_their_fewer_points(kind, tmp_path, monkeypatch):
    """CalculiX takes the few points of the stiffness for these; ours is exact where edges are straight."""
    mesh = moved(kind)
    theirs = calculix(mesh, SOLID, tmp_path)["mas"]
    monkeypatch.setitem(ELEMENTS, kind, replace(ELEMENTS[kind], mass_rule=ELEMENTS[kind].rule))
    assert abs(assemble(mesh, SOLID).mass - theirs).max() < 1e-12 * abs(theirs).max()


def test_blade(tmp_path):
    mesh = rounded(blade_mesh(blade_shape("small")))
    steel = Material(young=200e9, poisson=0.3, density=7850.0)
    theirs = calculix(mesh, steel, tmp_path)
    ours = assemble(mesh, steel)
    assert abs(ours.stiffness - theirs["sti"]).max() < 1e-12 * abs(theirs["sti"]).max()
    assert abs(ours.mass - theirs["mas"]).max() < 1e-12 * abs(theirs["mas"]).max()


def faces_of(mesh: Mesh, surface: Surface) -> list[tuple[int, int]]:
    """Element and face number of each face of a surface, from 1, as CalculiX counts (F1, F2, ...)."""
    wanted = {tuple(sorted(face)) for face in surface.faces["quad8"].tolist()}
    block = mesh.blocks["hex20"]
    return [
        (number, k)
        for k, (_, local) in enumerate(ELEMENTS["hex20"].faces, start=1)
        for number, face in enumerate(np.sort(block[:, list(local)], axis=1).tolist(), start=1)
        if tuple(face) in wanted
    ]


def test_heat_of_the_blade(tmp_path):
    """Temperatures under convection, a fixed root and a source at one node of the shroud, to the digits printed."""
    made = blade_mesh(blade_shape("small"))
    mesh = replace(rounded(made), surfaces=made.surfaces)
    source, root = int(mesh.surface("shroud_top").nodes[5]), mesh.surface("root").nodes
    lines = [*model_lines(mesh), "*NSET,NSET=ROOT", *(f"{n}," for n in root + 1)]
    lines += ["*MATERIAL,NAME=M", "*CONDUCTIVITY", "25.", "*SOLID SECTION,ELSET=E,MATERIAL=M"]
    lines += ["*INITIAL CONDITIONS,TYPE=TEMPERATURE", "ALL,0.", "*STEP", "*HEAT TRANSFER,STEADY STATE"]
    lines += ["*BOUNDARY", "ROOT,11,11,0.", "*CFLUX", f"{source + 1},11,3.", "*FILM"]
    lines += [f"{e},F{k},0.,200." for name in WETTED for e, k in faces_of(mesh, mesh.surface(name))]
    lines += ["*NODE PRINT,NSET=ALL", "NT", "*END STEP"]
    run(lines, tmp_path)
    rows = [line.split() for line in (tmp_path / "m.dat").read_text().splitlines() if len(line.split()) == 2]
    theirs = np.array([float(value) for _, value in rows])
    assert len(theirs) == mesh.n_nodes
    metal = Material(young=1.0, poisson=0.3, conductivity=25.0)
    heat = np.zeros(mesh.n_nodes)
    heat[source] = 3.0
    ours = steady_temperature(
        conductance(mesh, conduction(mesh, metal), dict.fromkeys(WETTED, 200.0)), heat, fixed=root
    )
    np.testing.assert_allclose(ours, theirs, rtol=2e-6, atol=1e-6 * theirs.max())
