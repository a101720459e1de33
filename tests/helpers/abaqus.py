"""A skewed box as an input file, and CalculiX where it is installed."""

import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.fem.box import box
from slipstick.fem.elements import ALIKE
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.refine import quadratic

CCX = shutil.which("ccx")


needs_ccx = pytest.mark.skipif(CCX is None, reason="CalculiX (Debian: calculix-ccx) is not installed")


TYPES = {"hex8": "C3D8", "hex8r": "C3D8R", "hex8i": "C3D8I", "hex20": "C3D20", "hex20r": "C3D20R"}
TYPES |= {"tet10": "C3D10", "wedge15": "C3D15", "wedge6": "C3D6", "tet4": "C3D4"}


STEEL = Material(young=210000.0, poisson=0.3, density=7.8e-9)


def skewed(kind: str, divisions: tuple[int, int, int] = (3, 2, 1)) -> Mesh:
    """A box of one element type, sheared and twisted so that no entry of its matrices vanishes by symmetry."""
    alike = ALIKE.get(kind, kind)
    linear = {"hex20": "hex8", "tet10": "tet4", "wedge15": "wedge6"}.get(alike, alike)
    mesh = box((40.0, 10.0, 8.0), divisions, linear)
    x, y, z = mesh.nodes.T
    nodes = np.stack([x + 0.1 * y, y + 0.02 * x * z / 8, z + 0.1 * x], axis=1)
    moved = Mesh(nodes=nodes, blocks=mesh.blocks, node_sets={"ROOT": mesh.surface("x0").nodes})
    moved = quadratic(moved) if alike != linear else moved
    return replace(moved, blocks={kind: moved.blocks[alike]})


def write_input(path: Path, mesh: Mesh, *, step: str, label=lambda i: 3 * i + 5) -> None:
    """Labels with gaps, in falling order: nothing may rely on 1, 2, 3."""
    lines = ["** a comment", "*Heading", "text, that is = no keyword", "*NODE, NSET=Nall"]
    lines += [f"{label(i)}, {x:.17g}, {y:.17g}, {z:.17g}" for i, (x, y, z) in reversed(list(enumerate(mesh.nodes)))]
    for kind, block in mesh.blocks.items():
        lines.append(f"*ELEMENT, TYPE={TYPES[kind]}, ELSET=solid")
        for number, row in enumerate(block.tolist(), 1):
            words = [str(number), *(str(label(n)) for n in row)]
            lines += [
                ", ".join(words[at : at + 10]) + ("," if at + 10 < len(words) else "")
                for at in range(0, len(words), 10)
            ]
    lines += ["*NSET, NSET=Root", *(f"{label(n)}," for n in mesh.node_set("ROOT").tolist())]
    lines += ["*NSET, NSET=ends", "Root, Root", "*ELSET, ELSET=first, GENERATE", "1, 2, 1"]
    lines += ["*SURFACE, NAME=face, TYPE=ELEMENT", "first, S1"]
    lines += ["*MATERIAL, NAME=steel", "*ELASTIC", "210000., 0.3", "*DENSITY", "7.8e-9,"]
    lines += ["*SOLID SECTION, ELSET=solid, MATERIAL=steel"]
    lines += ["*BOUNDARY", "Root, 1, 3", f"{label(mesh.n_nodes - 1)}, 2"]
    path.write_text("\n".join([*lines, "*STEP", step, "*END STEP", ""]))


def run(path: Path) -> None:
    subprocess.run(
        [str(CCX), path.stem],
        cwd=path.parent,
        check=True,
        capture_output=True,
        timeout=600,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )


def printed_eigenvalues(path: Path) -> np.ndarray:
    rows = (line.split() for line in path.read_text().splitlines())
    return np.array([float(row[1]) for row in rows if len(row) == 5 and row[0].isdigit()])
