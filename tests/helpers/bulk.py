"""Boxes as Nastran bulk data."""

from pathlib import Path

import numpy as np

from slipstick.fem.mesh import Mesh

ORDER = {"hex20": (*range(12), *range(16, 20), *range(12, 16)), "wedge15": (*range(9), 12, 13, 14, 9, 10, 11)}
CARDS = {
    "hex8": "CHEXA",
    "hex20": "CHEXA",
    "wedge6": "CPENTA",
    "wedge15": "CPENTA",
    "tet4": "CTETRA",
    "tet10": "CTETRA",
}
MATERIAL = "PSOLID,7,3\nMAT1,3,2.1+5,,.3,7.8-9\n"


def card(*words: object) -> str:
    """A card in free fields, as many lines as it needs."""
    texts = [str(word) for word in words]
    lines = [texts[:9]] + [["", *texts[at : at + 8]] for at in range(9, len(texts), 8)]
    return "\n".join(",".join(line) for line in lines) + "\n"


def lines_of(mesh: Mesh, start: int = 0) -> str:
    """Points and elements of a mesh, and what it is made of."""
    text = "".join(card("GRID", start + i, "", *(f"{v:.12e}" for v in x)) for i, x in enumerate(mesh.nodes, 1))
    for kind, block in mesh.blocks.items():
        for number, row in enumerate(block.tolist(), 1):
            nodes = [row[at] + 1 + start for at in np.argsort(ORDER.get(kind, range(len(row))))]
            text += card(CARDS[kind], number, 7, *nodes)
    return text + MATERIAL


def write(folder: Path, text: str, head: str = "SOL 103\nCEND\n") -> Path:
    path = folder / "m.bdf"
    path.write_text(f"{head}BEGIN BULK\n{text}ENDDATA\n")
    return path
