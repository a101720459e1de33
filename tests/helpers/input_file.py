"""One quadratic tetrahedron as an input file."""

from pathlib import Path

CUBE = """\
*NODE, NSET=NALL
1, 0., 0., 0.
2, 1., 0., 0.
3, 0., 1., 0.
4, 0., 0., 1.
5, .5, 0., 0.
6, .5, .5, 0.
7, 0., .5, 0.
8, 0., 0., .5
9, .5, 0., .5
10, 0., .5, .5
*ELEMENT, TYPE=C3D10, ELSET=EALL
1, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10
*NSET, NSET=ROOT
1, 3, 4, 7, 8, 10
*MATERIAL, NAME=STEEL
*ELASTIC
2.1e5, 0.3
*DENSITY
7.8e-9
*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL
"""
"""One quadratic tetrahedron, held nowhere."""


HELD = "*BOUNDARY\nROOT, 1, 3\n"


def write(folder: Path, text: str) -> Path:
    path = folder / "m.inp"
    path.write_text(text)
    return path
