"""Matrices against CalculiX, which writes its own in the test (`*FREQUENCY, SOLVER=MATRIXSTORAGE`)."""

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array

from slipstick.fem.assembly import assemble
from slipstick.fem.blade import blade, blade_shape
from slipstick.fem.boundary import boundary
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS, LINEAR_TO_QUADRATIC
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.refine import quadratic

pytestmark = [pytest.mark.verify, pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not here")]

NAMES = {"hex8": "C3D8", "hex20": "C3D20", "tet4": "C3D4", "tet10": "C3D10", "wedge6": "C3D6", "wedge15": "C3D15"}
SOLID = Material(young=2.0, poisson=0.3, density=3.0)


def calculix(mesh: Mesh, material: Material, folder: Path) -> dict[str, coo_array]:
    """Its stiffness ("sti") and mass ("mas") in our order of degrees of freedom."""
    lines = ["*NODE,NSET=ALL"]
    lines += [f"{i},{','.join(f'{v:.12e}' for v in x)}" for i, x in enumerate(mesh.nodes, start=1)]
    for kind, block in mesh.blocks.items():
        lines.append(f"*ELEMENT,TYPE={NAMES[kind]},ELSET=E")
        for number, nodes in enumerate(block + 1, start=1):
            words = [str(number), *map(str, nodes)]
            lines += [",".join(words[:11]) + ("," if words[11:] else "")] + (
                [",".join(words[11:])] if words[11:] else []
            )
    lines += [
        "*MATERIAL,NAME=M",
        "*ELASTIC",
        f"{material.young!r},{material.poisson!r}",
        "*DENSITY",
        repr(material.density),
    ]
    lines += ["*SOLID SECTION,ELSET=E,MATERIAL=M", "*STEP", "*FREQUENCY,SOLVER=MATRIXSTORAGE", "1", "*END STEP"]
    (folder / "m.inp").write_text("\n".join(lines) + "\n")
    subprocess.run(["ccx", "-i", "m"], cwd=folder, capture_output=True, check=False)
    names = [line.strip().split(".") for line in (folder / "m.dof").read_text().split()]
    dof = np.array([3 * (int(node) - 1) + int(axis) - 1 for node, axis in names])
    result = {}
    for part in ("sti", "mas"):
        row, column, value = np.loadtxt(folder / f"m.{part}").T
        i, j = dof[row.astype(int) - 1], dof[column.astype(int) - 1]
        off = i != j
        entries = np.concatenate([value, value[off]]), (np.concatenate([i, j[off]]), np.concatenate([j, i[off]]))
        result[part] = coo_array(entries, shape=(3 * mesh.n_nodes,) * 2).tocsr()
    return result


def moved(kind: str) -> Mesh:
    linear = {q: name for name, q in LINEAR_TO_QUADRATIC.items()}.get(kind, kind)
    mesh = box((1.0, 1.2, 0.9), (2, 2, 2), linear)
    nodes, inside = mesh.nodes.copy(), np.setdiff1d(np.arange(mesh.n_nodes), boundary(mesh).nodes)
    nodes[inside] += np.random.default_rng(5).uniform(-0.1, 0.1, (len(inside), 3))
    mesh = Mesh(nodes=nodes, blocks=mesh.blocks)
    return rounded(quadratic(mesh) if kind != linear else mesh)


def rounded(mesh: Mesh) -> Mesh:
    """Coordinates as CalculiX reads them: twenty characters."""
    return Mesh(nodes=np.vectorize(lambda v: float(f"{v:.12e}"))(mesh.nodes), blocks=mesh.blocks)


@pytest.mark.parametrize("kind", ["hex8", "hex20", "tet4", "tet10", "wedge15"])
def test_stiffness(kind, tmp_path):
    mesh = moved(kind)
    theirs = calculix(mesh, SOLID, tmp_path)["sti"]
    ours = assemble(mesh, SOLID).stiffness
    assert abs(ours - theirs).max() < 1e-12 * abs(theirs).max()


@pytest.mark.parametrize("kind", ["hex8", "hex20"])
def test_mass(kind, tmp_path):
    mesh = moved(kind)
    theirs = calculix(mesh, SOLID, tmp_path)["mas"]
    ours = assemble(mesh, SOLID).mass
    assert abs(ours - theirs).max() < 1e-12 * abs(theirs).max()


@pytest.mark.parametrize("kind", ["tet10", "wedge15"])
def test_mass_with_their_fewer_points(kind, tmp_path, monkeypatch):
    """CalculiX takes the few points of the stiffness for these; ours is exact where edges are straight."""
    mesh = moved(kind)
    theirs = calculix(mesh, SOLID, tmp_path)["mas"]
    monkeypatch.setitem(ELEMENTS, kind, replace(ELEMENTS[kind], mass_rule=ELEMENTS[kind].rule))
    assert abs(assemble(mesh, SOLID).mass - theirs).max() < 1e-12 * abs(theirs).max()


def test_blade(tmp_path):
    mesh = rounded(blade(blade_shape("small")))
    steel = Material(young=200e9, poisson=0.3, density=7850.0)
    theirs = calculix(mesh, steel, tmp_path)
    ours = assemble(mesh, steel)
    assert abs(ours.stiffness - theirs["sti"]).max() < 1e-12 * abs(theirs["sti"]).max()
    assert abs(ours.mass - theirs["mas"]).max() < 1e-12 * abs(theirs["mas"]).max()
