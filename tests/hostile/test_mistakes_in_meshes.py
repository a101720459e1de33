"""Meshes and matrices as they should not be: refused, or warned of, in words that name the file and what is wrong."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.gmsh import beam, write_inp, write_msh
from samples import STEEL, write_models

from slipstick import Material, import_model
from slipstick.errors import InputError

Change = Callable[[bytes], bytes]


def cut(share: float) -> Change:
    return lambda content: content[: int(share * len(content))]


def swap(old: str, new: str) -> Change:
    def changed(content: bytes) -> bytes:
        assert old.encode() in content
        return content.replace(old.encode(), new.encode(), 1)

    return changed


def until(mark: str, more: int = 0) -> Change:
    return lambda content: content[: content.index(mark.encode()) + more]


def always(content: bytes) -> Change:
    return lambda _: content


def apart(content: bytes) -> bytes:
    """The first element on nodes of its own, where the next one begins."""
    more = b"101, 1., 0., 0.\n102, 1., 0., 1.\n103, 1., 1., 0.\n104, 1., 1., 1.\n"
    content = content.replace(b"******* E", more + b"******* E")
    return content.replace(b"4, 1, 5, 7, 3, 2, 6, 8, 4", b"4, 1, 101, 103, 3, 2, 102, 104, 4")


def flat(content: bytes) -> bytes:
    """Without its solids."""
    begin = content.index(b"3 4 5 4\n")
    return content[:begin].replace(b"4 7 1 7\n", b"3 3 1 3\n") + b"$EndElements\n"


MSH, INP, STEELY, BULK = ("g.msh",), ("g.inp",), ("beam.inp",), ("beam.bdf",)
MTX, PUNCH = ("K.mtx", "M.mtx", "map.txt"), ("job.pch", "job.bdf")
OF = {"material": STEEL}
SMALL = {"material": Material(young=210.0, poisson=0.3, density=7800.0)}
PICTURE = always(b"\x89PNG\r\n\x1a\n" + bytes(300))

# name: (files, which is changed, how, options, fragments of what is said)
REFUSED: dict[str, tuple[tuple[str, ...], str, Change, dict[str, Any], tuple[str, ...]]] = {
    "cut in its nodes": (MSH, "g.msh", cut(0.6), OF, ("g.msh: is damaged or truncated: $Nodes",)),
    "cut in an element": (INP, "g.inp", until("5, 5, 9", 7), OF, ("g.inp, line", "*ELEMENT", "elements of 8 nodes")),
    "cut before its elements": (INP, "g.inp", cut(0.3), OF, ("g.inp: has no solid element", "C3D10")),
    "bulk data cut": (BULK, "beam.bdf", cut(0.5), {}, ("beam.bdf: has no solid element", "CTETRA")),
    "an archive cut": (("beam.cdb",), "beam.cdb", cut(0.5), {}, ("beam.cdb: its NBLOCK claims 12 entries",)),
    "a model cut": (("model.h5",), "model.h5", cut(0.5), {}, ("model.h5: is damaged or not a slipstick model",)),
    "an empty file": (MSH, "g.msh", always(b""), OF, ("g.msh: the file is empty",)),
    "a picture as .msh": (MSH, "g.msh", PICTURE, OF, ("g.msh: is no mesh: found a binary file",)),
    "a picture as .inp": (INP, "g.inp", PICTURE, OF, ("g.inp: is no mesh: found a binary file",)),
    "a mesh of Fluent": (MSH, "g.msh", always(b'(0 "x")\n'), OF, ("g.msh: is a mesh of Ansys Fluent",)),
    "an old format of Gmsh": (MSH, "g.msh", swap("4.1 0 8", "4 0 8"), OF, ("found format '4'", "expected 4.1 or 2.2")),
    "text in UTF-16": (INP, "g.inp", lambda b: b.decode().encode("utf-16"), OF, ("g.inp: is text in UTF-16; save it",)),
    "faces alone, .msh": (
        MSH,
        "g.msh",
        flat,
        OF,
        ("g.msh: has no solid element; it has 1 line, 2 quad; mesh the vol",),
    ),
    "faces alone, .inp": (INP, "g.inp", until("*ELEMENT, type=C3D8"), OF, ("has no solid element", "2 of type CPS4")),
    "a type that is not known": (INP, "g.inp", swap("C3D8", "C3D9"), OF, ("g.inp: has no solid", "4 of type C3D9")),
    "third order": (
        MSH,
        "g.msh",
        swap("3 4 5 4\n", "3 4 92 4\n"),
        OF,
        ("g.msh: has elements of Gmsh type 92", "order 1"),
    ),
    "an element inside out": (
        MSH,
        "g.msh",
        swap("1 5 7 3 2 6 8 4", "2 6 8 4 1 5 7 3"),
        OF,
        ("g.msh: hex8 element 1 is inside out",),
    ),
    "an element twisted": (MSH, "g.msh", swap("1 5 7 3 2", "1 7 5 3 2"), OF, ("element 1 is too distorted or flat",)),
    "a node twice in an element": (
        INP,
        "g.inp",
        swap("5, 5, 9", "5, 5, 5"),
        OF,
        ("g.inp: hex8 element 5 uses a node twice",),
    ),
    "a node missing": (INP, "g.inp", swap("20, 4.0, 1.0, 1.0\n", ""), OF, ("g.inp: an element uses node 20, which",)),
    "a node at two places": (
        INP,
        "g.inp",
        swap("20, 4.0", "20, 4.0, 1.0, 2.0\n20, 4.0"),
        OF,
        ("g.inp, line 24: node 20 is given again",),
    ),
    "a number of two elements": (INP, "g.inp", swap("5, 5, 9", "4, 5, 9"), OF, ("element 4 is given twice",)),
    "an element twice": (
        MSH,
        "g.msh",
        swap("5 5 9 11 7 6 10 12 8", "5 1 5 7 3 2 6 8 4"),
        OF,
        ("hex8 elements 1 and 2 have the same nodes", "one is given twice"),
    ),
    "two instances": (
        INP,
        "g.inp",
        swap("*NODE", "*INSTANCE, NAME=A, PART=P\n*INSTANCE, NAME=B, PART=P\n*NODE"),
        OF,
        ("g.inp, line 3: *INSTANCE names the part P, which the file does not have",),
    ),
    "an include that is not there": (
        INP,
        "g.inp",
        swap("*Heading", "*INCLUDE, INPUT=more.inp\n*Heading"),
        OF,
        ("there is no file more.inp",),
    ),
    "decimal commas, .msh": (
        MSH,
        "g.msh",
        swap("1.0 0.0 0.0", "1,0 0,0 0,0"),
        OF,
        ("$Nodes holds '1,0', which is no",),
    ),
    "decimal commas, .inp": (
        INP,
        "g.inp",
        swap("17, 4.0, 0.0, 0.0", "17, 4,0, 0,0, 0,0"),
        OF,
        ("line 20 has 7 whole numbers", "with points"),
    ),
    "no material": (MSH, "g.msh", cut(1), {}, ("g.msh: is a mesh without material; give young, poisson and density",)),
    "no density": (STEELY, "beam.inp", swap("*DENSITY\n7800.,\n", ""), {}, ("beam.inp: EALL has no density",)),
    "a negative density": (STEELY, "beam.inp", swap("7800.", "-7800."), {}, ("beam.inp", "density: found -7800.0")),
    "an incompressible material": (STEELY, "beam.inp", swap("0.3\n", "0.5\n"), {}, ("poisson: found 0.5",)),
    "a section without set": (
        STEELY,
        "beam.inp",
        swap("ELSET=EALL, MAT", "ELSET=ALL, MAT"),
        {},
        ("line 28", "the element set ALL, which the f"),
    ),
    "a section without material": (
        STEELY,
        "beam.inp",
        swap("L, MATERIAL=STEEL", "L, MATERIAL=STELL"),
        {},
        ("line 28", "material STELL, which has no"),
    ),
    "a support of no set": (
        STEELY,
        "beam.inp",
        swap("ROOT, 1, 3", "ROOTS, 1, 3"),
        {},
        ("line 29", "*BOUNDARY names ROO"),
    ),
    "a face that is none": (STEELY, "beam.inp", swap("S1", "S9"), {}, ("line 22", "found face S9; expected S1 to S6")),
    "a set misspelt": (MSH, "g.msh", cut(1), OF | {"fixed": "rooot"}, ("'rooot' is not in the mesh", "'root'?")),
    "a set in other letters": (INP, "g.inp", cut(1), OF | {"fixed": "root"}, ("'root' is not in the mesh", "'ROOT'?")),
    "a set that is empty": (
        INP,
        "g.inp",
        swap("*ELSET,ELSET=edge", "*NSET, NSET=NONE\n*ELSET,ELSET=edge"),
        OF | {"fixed": "NONE"},
        ("g.inp: the node set 'NONE' is empty",),
    ),
    "a set of solids": (MSH, "g.msh", cut(1), OF | {"fixed": "body"}, ("'body' is a set of solid elements",)),
    "a node that is not there": (
        STEELY,
        "beam.inp",
        cut(1),
        {"fixed": "n999"},
        ("fixed: there is no free dof 'n999'",),
    ),
    "bulk data without PSOLID": (
        BULK,
        "beam.bdf",
        swap("PSOLID,7,3\n", ""),
        {},
        ("beam.bdf: property 7 has no PSOLID",),
    ),
    "bulk data without MAT1": (BULK, "beam.bdf", swap("MAT1,3", "MAT1,4"), {}, ("property 7 names material 3",)),
    "supports that are not there": (
        BULK,
        "beam.bdf",
        cut(1),
        {"constraints": 99},
        ("no constraint set 99; it has [1]",),
    ),
    "matrices of two sizes": (
        MTX,
        "M.mtx",
        lambda b: b.replace(b"6 6 ", b"7 7 "),
        {},
        ("different size", "K is 6 x 6, M is 7 x 7"),
    ),
    "a map that is shorter": (MTX, "map.txt", swap("2 z\n", ""), {}, ("have 6 rows, the dof map has 5 entries",)),
    "a map that is longer": (
        MTX,
        "map.txt",
        swap("2 z\n", "2 z\n3 x\n"),
        {},
        ("have 6 rows, the dof map has 7 entries",),
    ),
    "a map with a row twice": (
        MTX,
        "map.txt",
        swap("2 z\n", "2 y\n"),
        {},
        ("names node 2, direction 2, more than once",),
    ),
    "a map with another direction": (
        MTX,
        "map.txt",
        swap("2 z", "2 q"),
        {},
        ("map.txt, line 6: 'q' is not a direction",),
    ),
    "no map": (MTX[:2], "K.mtx", cut(1), {}, ("K.mtx, M.mtx: no map from rows to nodes",)),
    "no mass": (("K.mtx", "map.txt"), "K.mtx", cut(1), {}, ("K.mtx, map.txt: no mass matrix M",)),
    "two stiffnesses": (("K.mtx", "K.npz", "map.txt"), "K.mtx", cut(1), {}, ("both look like the matrix K",)),
    "a header misspelt": (MTX, "K.mtx", swap("Market", "Markt"), {}, ("K.mtx: found the first line '%%MatrixMarkt",)),
    "complex numbers": (MTX, "K.mtx", swap("real", "complex"), {}, ("K.mtx: holds complex values; expected real",)),
    "entries missing": (MTX, "K.mtx", cut(0.6), {}, ("K.mtx: claims 21 entries, holds 12",)),
    "decimal commas in a matrix": (MTX, "K.mtx", swap("1 1 4.62", "1 1 4,62"), {}, ("K.mtx: found 64 numbers",)),
    "no archive of numpy": (("K.npz", "M.npz", "map.txt"), "K.npz", always(b"x"), {}, ("K.npz: not a readable .npz",)),
    "a mapping that is shorter": (
        ("K.hb", "M.hb", "K.mapping"),
        "K.mapping",
        swap(" 6 2 UZ\n", ""),
        {},
        ("dof map has 5 entries",),
    ),
    "an empty mass beside": (("ccx.sti",), "ccx.mas", always(b""), {}, ("ccx.mas: the file is empty",)),
    "a .dof that is shorter": (("ccx.sti",), "ccx.dof", swap("2.3\n", ""), {}, ("ccx.sti: has row or column 6",)),
    "a punch without header": (PUNCH, "job.pch", swap("DMIG    KAAX", "DMIG    KAAY"), {}, ("job.pch, line 2", "KAAX")),
    "a punch cut": (PUNCH, "job.pch", cut(0.5), {}, ("job.pch, job.bdf: no mass matrix M",)),
    "a letter among digits": (PUNCH, "job.pch", swap("4.620", "4.62O"), {}, ("job.pch, line 2", "is not a number")),
    "a .full that is text": (
        ("job.full",),
        "job.full",
        always(b"text " * 99),
        {},
        ("job.full: the file is damaged", ".full"),
    ),
    "quadratic matrices": (
        MTX,
        "K.mtx",
        cut(1),
        {"quadratic": True},
        ("quadratic: the matrices have elements already",),
    ),
    "names of matrices of a mesh": (
        MSH,
        "g.msh",
        cut(1),
        OF | {"names": {"K": "KGG"}},
        ("names has no effect on g.msh",),
    ),
}

WARNED: dict[str, tuple[tuple[str, ...], str, Change, dict[str, Any], tuple[str, ...]]] = {
    "density of t/mm3 beside Pa": (STEELY, "beam.inp", swap("7800.", "7.8e-9"), {}, ("E = 2e+11", "density = 7.8e-09")),
    "MPa beside kg/m3": (STEELY, "beam.inp", swap("2e11", "2e5"), {}, ("E = 2e+05 and density = 7800", "check them")),
    "GPa": (MSH, "g.msh", cut(1), SMALL, ("g.msh: all: E = 210 and density = 7800 fit no common system",)),
    "SI in mm": (MSH, "g.msh", cut(1), OF | {"units": "N, mm, t, s"}, ("which no solid has", "2e+11")),
    "linear elements": (MSH, "g.msh", cut(1), OF, ("g.msh: 4 hex8 elements are linear", "--quadratic")),
    "bodies that only touch": (
        INP,
        "g.inp",
        apart,
        OF | {"fixed": "ROOT"},
        ("is not constrained", "6 rigid body motions"),
    ),
    "a comma in Poisson's ratio": (
        STEELY,
        "beam.inp",
        swap("0.3\n", "0,3\n"),
        {},
        ("line 24", "is it a decimal comma?"),
    ),
    "a group without a name": (
        MSH,
        "g.msh",
        swap('4\n1 1 "edge"\n', "3\n"),
        OF,
        ("physical groups without a name are not read: 1 of curves",),
    ),
    "nothing is fixed": (MSH, "g.msh", cut(1), OF, ("(20 nodes) is not constrained (6 rigid body motions)",)),
    "an input file as .msh": (
        MSH,
        "g.msh",
        lambda _: Path("g.inp").read_bytes(),
        OF,
        ("g.msh: is a file of Abaqus or CalculiX, and read",),
    ),
}

FINE: dict[str, tuple[tuple[str, ...], str, Change, dict[str, Any]]] = {
    "line ends of Windows, .inp": (INP, "g.inp", lambda b: b.replace(b"\n", b"\r\n"), OF | {"fixed": "ROOT"}),
    "line ends of Windows, .msh": (MSH, "g.msh", lambda b: b.replace(b"\n", b"\r\n"), OF | {"fixed": "root"}),
    "a byte order mark, .inp": (INP, "g.inp", lambda b: b"\xef\xbb\xbf" + b, OF | {"fixed": "ROOT"}),
    "a byte order mark, .msh": (MSH, "g.msh", lambda b: b"\xef\xbb\xbf" + b, OF | {"fixed": "root"}),
    "a comment in Latin-1": (INP, "g.inp", lambda b: b"** gr\xf6\xdfe\n" + b, OF | {"fixed": "ROOT"}),
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Every file as it should be."""
    folder = tmp_path_factory.mktemp("sound")
    write_models(folder)
    points, groups = beam()
    write_msh(folder / "g.msh", points, groups)
    write_inp(folder / "g.inp", points, groups)
    return {path.name: path.read_bytes() for path in folder.iterdir()} | {"job.full": b""}


def spoilt(sound: dict[str, bytes], folder: Path, name: str, change: Change, patch: pytest.MonkeyPatch) -> None:
    patch.chdir(folder)
    for each, content in sound.items():
        (folder / each).write_bytes(content)
    (folder / name).write_bytes(change(sound[name]))


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("name", REFUSED)
def test_refused(sound: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    files, spoiled, change, options, fragments = REFUSED[name]
    spoilt(sound, tmp_path, spoiled, change, monkeypatch)
    with pytest.raises(InputError) as caught:
        import_model(files, output="out.h5", **options)
    for fragment in fragments:
        assert fragment in str(caught.value)
    assert not Path("out.h5").exists()


@pytest.mark.parametrize("name", WARNED)
def test_told(sound: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """A warning, or a line of the summary that import prints."""
    from slipstick.importers.import_model import summary

    files, spoiled, change, options, fragments = WARNED[name]
    spoilt(sound, tmp_path, spoiled, change, monkeypatch)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        model = import_model(files, **options)
    said = [*(str(warning.message) for warning in caught), *summary(model)]
    for fragment in fragments:
        assert any(fragment in sentence for sentence in said), said


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("name", FINE)
def test_read_as_it_is_meant(sound: dict[str, bytes], tmp_path: Path, monkeypatch: Any, name: str) -> None:
    files, spoiled, change, options = FINE[name]
    spoilt(sound, tmp_path, spoiled, change, monkeypatch)
    model = import_model(files, **options)
    assert (model.n_dofs, len(model.constrained)) == (48, 12)


def test_the_tables_are_long() -> None:
    assert len(REFUSED) + len(WARNED) >= 70
