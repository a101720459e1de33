"""Sound files of every kind that is read: cases, models of other codes, our own models, results and journals."""

from __future__ import annotations

import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.io import hb_write, mmwrite
from scipy.sparse import coo_array, csc_array, save_npz

from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.io.journal import Journal, journal_of
from slipstick.io.model_file import save_model

STEEL = Material(young=2e11, poisson=0.3, density=7800.0, conductivity=40.0)
OSCILLATOR = """\
format = 1
title = "oscillator"
harmonics = "0..5"
[structure]
kind = "matrices"
dofs = ["x", "z"]
mass = [[1.0, 0.0], [0.0, 1.0]]
damping = [[0.4, 0.0], [0.0, 0.8]]
stiffness = [[40.0, -5.0], [-5.0, 120.0]]
loss_factor = 0.01
[[load]]
dof = "x"
harmonic = 1
amplitude = 100.0
phase = "90 deg"
[[load]]
dof = "z"
cos = 3.0
sin = 2.0
[[contact]]
name = "damper"
tangential = "x"
normal = { z = 1.0, x = 0.1 }
kt = 100.0
kn = 80.0
mu = 0.3
gap = -2.0
rubbing = { velocity = 3.0, cos = { "1" = 0.5 }, sin = { "2" = 0.1 } }
[response]
from = 4.0
to = 6.0
at = [4.5, 5]
peaks_of = "x"
max_points = 30
first_step = 0.1
max_step = 0.5
min_step = 1e-6
[output]
dofs = ["x", "z"]
"""
HEATED = """\
format = 1
title = "heated"
harmonics = [0, 1, 2, 3]
period_ratio = "1/2"
[structure]
kind = "matrices"
count = 2
mass = "K.npz"
damping = [[4.0, 0.0], [0.0, 4.0]]
stiffness = "K.mtx"
[thermal]
influence = [[8.0, 1.0], [1.0, 8.0]]
contacts = ["a", "b"]
background = 25.0
[[load]]
dof = "1"
sin = 30.0
[[contact]]
name = "a"
tangential = "1"
kt = 10.0
mu = { table = [[25, 0.5], [200, 0.45], [90000, 0.3]], interpolation = "pchip" }
normal_load = 4.0
rubbing = { velocity = 2.0 }
[[contact]]
name = "b"
tangential = { "2" = 1.0, "1" = -1.0 }
kt = { table = [[25, 50], [90000, 40]] }
mu = 0.3
normal_load = 8.0
[response]
parameter = "a.velocity"
omega = "1 Hz"
from = 2.0
to = 3.0
max_points = 30
"""
MODAL = """\
format = 1
title = "modal"
harmonics = "0..3"
[structure]
kind = "modal"
file = "modes.npz"
dofs = ["x", "y", "z"]
modes = 2
loss_factor = 0.01
[[load]]
dof = "x"
cos = 3.0
[[contact]]
name = "tip"
tangential = "y"
kt = 100.0
mu = 0.3
normal_load = 8.0
rubbing = { velocity = 0.1 }
[response]
from = "0.5 Hz"
to = "40 rpm"
max_points = 30
"""
FE = """\
format = 1
harmonics = "0..3"
[structure]
kind = "fe"
file = "model.h5"
surface = { direction = [0, 1, 0], angle = 20, depth = 0.001 }
contacts = 2
pressure = { pressure = "z1" }
films = { boundary = 100.0 }
cold = "x0"
modes = 4
loss_factor = 0.01
[thermal]
influence = "structure"
background = 20.0
[[load]]
shape = "pressure"
cos = 50.0
[[contact]]
name = "pad"
points = "all"
direction = [1.0, 1.0, 0.0]
kt = 1e5
mu = 0.4
normal_load_total = 6.0
rubbing = { velocity = 0.1 }
[response]
from = "150 Hz"
to = "200 Hz"
max_points = 30
"""
CASES = (OSCILLATOR, HEATED, MODAL, FE)
BULK = """\
SOL 103
BEGIN BULK
GRID,1,,0.0,0.0,0.0
GRID,2,,1.0,0.0,0.0
GRID*                  3                             2.0             0.0
*                    0.0
SPC1,5,456,1,THRU,3
ASET1,123,1,2
ENDDATA
"""


SUPERELEMENT = """\
BEGIN SUPER=101
CORD2C,7,,1.,0.,0.,1.,0.,1.
,2.,0.,0.
CORD1R,8,1,2,3
EXTRN,1,123,9,0,11,THRU,12,0
GRID   *               1               7             2.0            30.0
*                    1.0               7
GRID,2,,0.,0.,0.
GRID,3,7,1.,60.,0.
GRID,4,8,0.,1.,0.,8
ASET,1,123
QSET1,0,9,11,THRU,12
SPOINT,9,11,THRU,12
"""


def write_files(folder: Path) -> None:
    """What the cases name."""
    K = np.array([[400.0, -50.0], [-50.0, 1200.0]])
    np.savez(folder / "K.npz", matrix=np.eye(2))
    mmwrite(folder / "K.mtx", coo_array(K))
    rng = np.random.default_rng(0)
    shapes = rng.normal(size=(3, 3))
    omega = np.array([3.0, 7.0, 19.0])
    np.savez(folder / "modes.npz", omega=omega, mode_shapes=shapes, static_compliance=shapes / omega**2 @ shapes.T)
    mesh = box((0.2, 0.02, 0.01), (2, 2, 1), "hex8")
    save_model(assemble_mesh(MeshModel(mesh=mesh), source="beam", material=STEEL, fixed=("x0",)), folder / "model.h5")


def write_models(folder: Path) -> list[tuple[str, ...]]:
    """Files of every importer; the tuples of names that are imported together, the first of each to be damaged."""
    rng = np.random.default_rng(1)
    a = rng.normal(size=(6, 6))
    K, M = a @ a.T + np.eye(6), np.diag(np.arange(1.0, 7.0))
    for name, matrix in (("K", K), ("M", M)):
        mmwrite(folder / f"{name}.mtx", coo_array(matrix))
        hb_write(folder / f"{name}.hb", csc_array(matrix))
        save_npz(folder / f"{name}.npz", coo_array(matrix).tocsr())
        abaqus = "".join(
            f"{i // 3 + 1},{i % 3 + 1},{j // 3 + 1},{j % 3 + 1},{float(matrix[i, j])!r}\n" for i, j in np.ndindex(6, 6)
        )
        (folder / f"job_{'STIF' if name == 'K' else 'MASS'}1.mtx").write_text(abaqus)
    nodes = {"nodes": [2, 4], "coordinates": [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]}
    np.savez(folder / "bundle.npz", K=K, M=M, dof_nodes=[4] * 3 + [2] * 3, dof_components=[1, 2, 3] * 2, **nodes)
    lines = [f"{n} {d}" for n in (1, 2) for d in "xyz"]
    (folder / "map.txt").write_text("\n".join(lines) + "\n")
    (folder / "K.mapping").write_text(
        "Matrix Eqn Node DOF\n" + "".join(f" {i + 1} {i // 3 + 1} U{'XYZ'[i % 3]}\n" for i in range(6))
    )
    (folder / "job.op4").write_bytes(_op4({"KAA": K, "MAA": M}))
    (folder / "text.op4").write_text(_text_op4({"KAA": K, "MAA": M}))
    (folder / "job.bdf").write_text(BULK)
    (folder / "se.op4").write_text(_text_op4({"KXX": K, "MXX": M, "BXX": 0.1 * K}))
    (folder / "se.pch").write_text(SUPERELEMENT)
    (folder / "sub.mtx").write_text(_user_element({"STIFFNESS": K, "MASS": M}))
    (folder / "job.pch").write_text(_punch({"KAAX": K, "MAAX": M}))
    for name, matrix in (("sti", K), ("mas", M)):
        (folder / f"ccx.{name}").write_text(
            "".join(f"{i + 1} {j + 1} {float(matrix[i, j])!r}\n" for i in range(6) for j in range(i, 6))
        )
    (folder / "ccx.dof").write_text("".join(f"{i // 3 + 1}.{i % 3 + 1}\n" for i in range(6)))
    mesh = box((0.2, 0.02, 0.01), (2, 1, 1), "hex8")
    _input(folder / "beam.inp", mesh)
    _bulk(folder / "beam.bdf", mesh)
    _gmsh(folder / "beam.msh", mesh)
    _archive(folder / "beam.cdb", mesh)
    save_model(assemble_mesh(MeshModel(mesh=mesh), source="beam", material=STEEL, fixed=("x0",)), folder / "model.h5")
    found = [
        ("K.mtx", "M.mtx", "map.txt"), ("K.npz", "M.npz", "map.txt"), ("K.hb", "M.hb", "K.mapping"), ("bundle.npz",),
        ("map.txt", "K.mtx", "M.mtx"), ("K.mapping", "K.hb", "M.hb"), ("job.op4", "job.bdf"), ("text.op4", "job.bdf"),
        ("job.bdf", "job.op4"), ("job.pch", "job.bdf"), ("ccx.sti",), ("job_STIF1.mtx", "job_MASS1.mtx"),
        ("se.op4", "se.pch"), ("se.pch", "se.op4"), ("sub.mtx",), ("beam.inp",), ("beam.bdf",), ("beam.msh",),
        ("beam.cdb",), ("model.h5",),
    ]  # fmt: skip
    full = _shipped_full()
    if full is not None:
        (folder / "job.full").write_bytes(full.read_bytes())
        found.append(("job.full",))
    return found


def _shipped_full() -> Path | None:
    try:
        from ansys.mapdl.reader import examples
    except ImportError:
        return None
    return Path(examples.__file__).parent / "file.full"


def _user_element(matrices: dict[str, np.ndarray]) -> str:
    lines = ["*USER ELEMENT, NODES= 2, LINEAR", "** ELEMENT NODES", "** 1, 2", "1, 2", "2, 1, 2, 3, 4"]
    for name, a in matrices.items():
        lines += [f"*MATRIX,TYPE={name}", *(", ".join(repr(float(v)) for v in a[i, : i + 1]) for i in range(6))]
    return "\n".join(lines) + "\n"


def _op4(matrices: dict[str, np.ndarray]) -> bytes:
    def record(data: bytes) -> bytes:
        return struct.pack("<i", len(data)) + data + struct.pack("<i", len(data))

    out = b""
    for name, a in matrices.items():
        out += record(struct.pack("<4i", len(a), len(a), 6, 2) + name.ljust(8).encode())
        for j, column in enumerate(a.T, 1):
            out += record(struct.pack("<3i", j, 1, 2 * len(a)) + column.astype("<f8").tobytes())
        out += record(struct.pack("<3i", len(a) + 1, 1, 2) + struct.pack("<d", 1.0))
    return out


def _text_op4(matrices: dict[str, np.ndarray]) -> str:
    lines = []
    for name, a in matrices.items():
        lines.append(f"{len(a):8d}{len(a):8d}{6:8d}{2:8d}{name:8s}1P,3E24.16")
        for j, column in enumerate(a.T, 1):
            words = [f"{v:24.16E}" for v in column]
            lines += [f"{j:8d}{1:8d}{len(a):8d}", *("".join(words[i : i + 3]) for i in range(0, len(words), 3))]
        lines += [f"{len(a) + 1:8d}{1:8d}{1:8d}", f"{1.0:24.16E}"]
    return "\n".join(lines) + "\n"


def _punch(matrices: dict[str, np.ndarray]) -> str:
    lines = []
    for name, a in matrices.items():
        lines.append(f"DMIG    {name:8s}{0:8d}{6:8d}{2:8d}{0:8d}{'':8s}{6:8d}")
        for j in range(6):
            lines.append(f"DMIG*   {name:16s}{j // 3 + 1:16d}{j % 3 + 1:16d}")
            lines += [f"*       {i // 3 + 1:16d}{i % 3 + 1:16d}{a[i, j]:16.9E}" for i in range(j, 6)]
    return "\n".join(lines) + "\n"


def _input(path: Path, mesh: object) -> None:
    lines = ["*NODE", *(f"{i}, {x!r}, {y!r}, {z!r}" for i, (x, y, z) in enumerate(mesh.nodes.tolist(), 1))]  # type: ignore[attr-defined]
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=EALL")
    cells = (mesh.blocks["hex8"] + 1).tolist()  # type: ignore[attr-defined]
    lines += [f"{n}, " + ", ".join(map(str, row)) for n, row in enumerate(cells, 1)]
    lines += ["*NSET, NSET=ROOT, GENERATE", "1, 4, 1", "*ELSET, ELSET=FIRST", "1", "*SURFACE, NAME=FACE", "FIRST, S1"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2e11, 0.3", "*DENSITY", "7800.,"]
    lines += ["*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL", "*BOUNDARY", "ROOT, 1, 3"]
    lines += ["*NODE", "99, 0.3, 0.01, 0.0", "*NSET, NSET=TIP", "11, 12", "*RIGID BODY, NSET=TIP, REF NODE=99"]
    lines += ["*TRANSFORM, NSET=TIP", "1., 0.1, 0., -0.1, 1., 0.", "*EQUATION", "2", "9, 1, 1., 10, 1, -1."]
    lines += ["*ELEMENT, TYPE=SPRING1, ELSET=P", "50, 9", "*SPRING, ELSET=P", "2", "1.e5"]
    path.write_text("\n".join(lines) + "\n")


def _bulk(path: Path, mesh: object) -> None:
    nodes, cells = mesh.nodes.tolist(), (mesh.blocks["hex8"] + 1).tolist()  # type: ignore[attr-defined]
    lines = ["SOL 103", "SPC = 1", "BEGIN BULK", "CORD2C,4,,0.,0.,0.,0.,0.,1.", ",1.,0.,0."]
    lines += [f"GRID,{i},,{x:.9f},{y:.9f},{z:.9f}" for i, (x, y, z) in enumerate(nodes, 1)]
    lines += [f"CHEXA,{n},7,{','.join(map(str, c[:6]))}\n,{c[6]},{c[7]}" for n, c in enumerate(cells, 1)]
    lines += ["PSOLID,7,3", "MAT1,3,2.+11,,.3,7800.", "SPC1,1,123,1,THRU,4", "GRID,99,4,.3,10.,0.,4"]
    lines += ["RBE2,9,99,123,11,12", "MPC,5,9,1,1.,10,1,-1.", "CONM2,8,99,,.1,.01,0.,0.", ",,1.-3"]
    lines += ["CELAS2,18,1.+5,9,2", "RBE3,19,,98,123,1.,123,5,6", ",7", "GRID,98,,.1,.01,.02", "ENDDATA"]
    path.write_text("\n".join(lines) + "\n")


def _gmsh(path: Path, mesh: object) -> None:
    nodes, cells = mesh.nodes.tolist(), (mesh.blocks["hex8"] + 1).tolist()  # type: ignore[attr-defined]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", "1", '3 7 "body"', "$EndPhysicalNames"]
    lines += [
        "$Nodes",
        str(len(nodes)),
        *(f"{i} {x!r} {y!r} {z!r}" for i, (x, y, z) in enumerate(nodes, 1)),
        "$EndNodes",
    ]
    lines += ["$Elements", str(len(cells)), *(f"{i} 5 2 7 1 " + " ".join(map(str, c)) for i, c in enumerate(cells, 1))]
    path.write_text("\n".join([*lines, "$EndElements"]) + "\n")


def _archive(path: Path, mesh: object) -> None:
    nodes, cells = mesh.nodes.tolist(), (mesh.blocks["hex8"] + 1).tolist()  # type: ignore[attr-defined]
    lines = ["/PREP7", "ET,1,185", f"NBLOCK,6,SOLID,{len(nodes)},{len(nodes)}", "(3i9,6e21.13e3)"]
    lines += [f"{i:9d}{0:9d}{0:9d}{x:21.13E}{y:21.13E}{z:21.13E}" for i, (x, y, z) in enumerate(nodes, 1)]
    lines += ["N,R5.3,LOC,       -1,", f"EBLOCK,19,SOLID,{len(cells)},{len(cells)}", "(19i9)"]
    for number, row in enumerate(cells, 1):
        head = (1, 1, 1, 1, 0, 0, 0, 0, 8, 0, number)
        lines.append("".join(f"{n:9d}" for n in (*head, *row)))
    lines += ["       -1", "MP,EX,1,2.0E+11", "MP,PRXY,1,0.3", "MP,DENS,1,7.8E+03", "D,1,UX,0.", "D,2,ALL,0."]
    lines += ["CE,R5.0,DEFI,       2,       1,  0.0", "CE,R5.0,NODE,      9,UX  ,  1.0    ,     10,UX  , -0.5    ,"]
    lines += ["CP,1,UY,9,11,12"]
    path.write_text("\n".join(lines) + "\n")


def write_results(folder: Path) -> Path:
    """A results file of a run, and the journal a kill would have left beside it, one point longer."""
    from slipstick.balance.balance import Balance
    from slipstick.case.case import Case
    from slipstick.io.store import ResultStore
    from slipstick.results.record import Recorder

    case = Case.from_text(OSCILLATOR.replace("to = 6.0", "to = 4.6").replace("at = [4.5, 5]", ""), folder / "case.toml")
    recorder = Recorder(Balance(case.problem()), parameter="")
    layout = replace(recorder.layout, attributes={"case": case.text, "outcome": "INTERRUPTED", "title": "t"})
    points: list[object] = []
    case.run(listeners=[lambda event: points.append(event.point) if hasattr(event, "point") else None])
    path = folder / "results.nc"
    with ResultStore(path, layout, case.problem()) as store:
        for point in points[:-1]:
            store.append(recorder.record(point))
    journal = Journal(journal_of(path), layout)
    for point in points:
        journal.append(layout.pack(recorder.record(point)))
    journal.close(remove=False)
    return path
