"""Ansys files written here, and where a real blade may lie."""

from pathlib import Path

import pytest
from scipy.sparse import csc_array, triu

from slipstick.fem.materials import Material

BEAM = Material(young=16.9e6, poisson=0.31, density=4.1408e-4)
"""Of file.full, in lbf and inch."""


_PLACE = Path("shared") / "data" / "turbine_blade" / "blade.cdb"
BLADE = next((parent / _PLACE for parent in Path(__file__).parents if (parent / _PLACE).is_file()), _PLACE)
"""In the folder "shared" beside the checkout, or beside one of the folders it is in."""
needs_blade = pytest.mark.skipif(not BLADE.is_file(), reason="the turbine blade is not beside this checkout")


def archive_text(rows: list[list[int]], kind: int, points: list[tuple[float, float, float]]) -> str:
    nodes = "".join(f"{i:9d}{0:9d}{0:9d}{x:21.13E}{y:21.13E}{z:21.13E}\n" for i, (x, y, z) in enumerate(points, 1))
    head = "".join(
        f"{1:9d}{1:9d}{1:9d}{1:9d}{0:9d}{0:9d}{0:9d}{0:9d}{len(row):9d}{0:9d}{number:9d}"
        + "".join(f"{n:9d}" + ("\n" if i == 7 else "") for i, n in enumerate(row))
        + "\n"
        for number, row in enumerate(rows, 1)
    ).replace("\n\n", "\n")
    return (
        f"/PREP7\n/UNITS,BIN\nET,1,{kind}\nNBLOCK,6,SOLID,{len(points)},{len(points)}\n(3i9,6e21.13e3)\n{nodes}"
        f"N,R5.3,LOC,       -1,\nEBLOCK,19,SOLID,{len(rows)},{len(rows)}\n(19i9)\n{head}       -1\n"
        "MP,EX,1,3.0E+07\nMP,PRXY,1,0.3\nMP,DENS,1,7.3E-04\nD,1,UX,0.\nD,1,UY,0.\nD,2,ALL,0.\n"
    )


STACK = [(x, y, z) for z in (0.0, 1.0, 1.0, 2.0) for x, y in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]]
"""Two bricks of side 1, one on the other one, with nodes of their own: 5 to 8 and 9 to 12 lie at the same places."""

PULL = (5.0, 5.0, 5.0)
"""Of node 17, which carries the load of a bolt."""


def stack_text(others: list[tuple[int, int, int, int, list[int]]], more: str = "") -> str:
    """Two bricks held at their base, and rows of other elements: material, type, real constants, section, nodes."""
    text = archive_text([list(range(1, 9)), list(range(9, 17))], 185, [*STACK, PULL])
    lines = "".join(
        "".join(f"{n:9d}" for n in (*head, 0, 0, 0, 0, len(nodes), 0, number, *nodes)) + "\n"
        for number, (*head, nodes) in enumerate(others, 3)
    )
    text = text.replace("EBLOCK,19,SOLID,2,2", f"EBLOCK,19,SOLID,{2 + len(others)},{2 + len(others)}")
    text = text.replace("       -1\nMP", lines + "       -1\nMP")
    types = "ET,1,185\nET,2,174\nET,3,170\nET,4,179\nET,5,175\n"
    return text.replace("ET,1,185\n", types) + "D,1,UZ,0.\nD,3,ALL,0.\nD,4,ALL,0.\n" + more


def write_harwell_boeing(path: Path, matrix, *, right_side: bool = False) -> None:
    """RSA: the lower half by columns, in Ansys' one-number lines."""
    lower = csc_array(triu(csc_array(matrix)).T)
    lower.sort_indices()
    n, entries = lower.shape[0], lower.nnz
    counts = (n + 1, entries, entries, n if right_side else 0)
    lines = ["Stiffness matrix from FULL file".ljust(72) + "MATRIX  "]
    lines.append("".join(f"{count:14d}" for count in (sum(counts), *counts)))
    lines.append("RSA".ljust(14) + f"{n:14d}{n:14d}{entries:14d}{0:14d}")
    lines.append("(1I14)          (1I14)          (1D25.15)           (1D25.15)")
    if right_side:
        lines.append(f"F{'':13}{1:14d}{0:14d}")
    lines += [f"{p + 1:14d}" for p in lower.indptr] + [f"{i + 1:14d}" for i in lower.indices]
    lines += [f"{v:25.15E}".replace("E", "D") for v in lower.data]
    lines += [f"{1.0:25.15E}"] * counts[3]
    path.write_text("\n".join(lines) + "\n")


def write_mapping(path: Path, dofs: list[tuple[int, str]]) -> None:
    rows = (f"{row:12d}{node:12d}      {label}" for row, (node, label) in enumerate(dofs, 1))
    path.write_text("  Matrix Eqn        Node      DOF\n" + "\n".join(rows) + "\n")


CUBE = [(x, y, z) for z in (0.0, 1.0) for x, y in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]]


def cube(folder: Path, more: str = "", *, old: str = "", new: str = "") -> Path:
    """One brick with three nodes held, and more commands."""
    text = archive_text([list(range(1, 9))], 185, CUBE) + "D,4,ALL,0.\n" + more
    assert old in text
    (folder / "cube.cdb").write_text(text.replace(old, new, 1) if old else text)
    return folder / "cube.cdb"
