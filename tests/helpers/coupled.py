"""Decks with couplings, written here, and their frequencies by CalculiX."""

from pathlib import Path

import numpy as np
from scipy.linalg import eigh

from helpers.abaqus import printed_eigenvalues, run
from slipstick.fem.box import box
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import ImportedModel

STEEL = "*MATERIAL, NAME=STEEL\n*ELASTIC\n210000., 0.3\n*DENSITY\n7.8e-9\n"


def lines_of(mesh: Mesh, name: str, start: int = 0, shift: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> str:
    """A hex20 body: nodes and elements from ``start``, a node set and an element set for each of its faces."""
    text = [f"*NODE, NSET=N{name}"]
    nodes = mesh.nodes + np.array(shift)
    text += [f"{start + i}, {x:.12e}, {y:.12e}, {z:.12e}" for i, (x, y, z) in enumerate(nodes, 1)]
    text.append(f"*ELEMENT, TYPE=C3D20, ELSET={name}")
    for number, row in enumerate((mesh.blocks["hex20"] + 1 + start).tolist(), start + 1):
        text += [f"{number}, " + ", ".join(map(str, row[:10])) + ",", ", ".join(map(str, row[10:]))]
    for face, surface in mesh.surfaces.items():
        text += [f"*NSET, NSET={name}{face}", *(f"{n + 1 + start}," for n in surface.nodes.tolist())]
        text += [f"*SURFACE, NAME=S{name}{face}", *_faces(mesh, face, start)]
    text.append(f"*SOLID SECTION, ELSET={name}, MATERIAL=STEEL")
    return "\n".join(text) + "\n"


def _faces(mesh: Mesh, face: str, start: int) -> list[str]:
    from slipstick.fem.elements import ELEMENTS

    wanted = {tuple(sorted(corners)) for corners in mesh.surfaces[face].faces["quad8"].tolist()}
    return [
        f"{number}, S{k}"
        for k, (_, local) in enumerate(ELEMENTS["hex20"].faces, 1)
        for number, nodes in enumerate(mesh.blocks["hex20"][:, list(local)].tolist(), start + 1)
        if tuple(sorted(nodes)) in wanted
    ]


def beam(cells: tuple[int, int, int] = (4, 2, 1), size: tuple[float, float, float] = (40.0, 10.0, 8.0)) -> Mesh:
    """Sheared, so that nothing vanishes by symmetry."""
    mesh = box(size, cells, "hex20")
    x, y, z = mesh.nodes.T
    moved = np.stack([x, y + 0.05 * x, z + 0.02 * x], axis=1)
    return Mesh(nodes=moved, blocks=mesh.blocks, surfaces=mesh.surfaces)


def frequencies(model: ImportedModel, count: int) -> np.ndarray:
    """Squares of the first natural frequencies."""
    return eigh(model.K.toarray(), model.M.toarray(), eigvals_only=True)[:count]


def calculix(path: Path, count: int) -> np.ndarray:
    """The same as CalculiX prints them for the deck with a frequency step added."""
    job = path.with_name("job.inp")
    job.write_text(path.read_text() + f"*STEP\n*FREQUENCY\n{count}\n*END STEP\n")
    run(job)
    return printed_eigenvalues(job.with_suffix(".dat"))[:count]
