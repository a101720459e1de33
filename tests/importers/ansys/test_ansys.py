"""Ansys files: the ones the readers' packages ship, Harwell-Boeing files written here, and a real blade."""

import contextlib
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.sparse import coo_array, csc_array, triu
from scipy.sparse.linalg import eigsh

from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.materials import Material
from slipstick.importers.import_model import import_model, summary
from slipstick.importers.mesh_files import read_mesh
from slipstick.importers.read_model import read_model
from slipstick.importers.roles import ImportOptions
from slipstick.io.model_file import load_model

BEAM = Material(young=16.9e6, poisson=0.31, density=4.1408e-4)
"""Of file.full, in lbf and inch."""
BLADE = Path(__file__).parents[4] / "shared" / "data" / "turbine_blade" / "blade.cdb"


@pytest.fixture(scope="module")
def shipped() -> Path:
    examples = pytest.importorskip("ansys.mapdl.reader.examples")
    return Path(os.path.dirname(examples.__file__))


@pytest.fixture(scope="module")
def archives() -> Path:
    examples = pytest.importorskip("mapdl_archive.examples")
    return Path(os.path.dirname(examples.__file__))


def test_full_holds_the_modes_that_ansys_computed(shipped):
    """Ansys' own modes (file.rst, free beam) fulfil K x = w^2 M x with the matrices of file.full (clamped beam) in each
    row that does not touch the clamped nodes: matrices, order and map are right, and w is Ansys' to 1e-6."""
    from ansys.mapdl.reader import read_binary

    model = read_model(shipped / "file.full")
    mesh = read_mesh(shipped / "HexBeam.cdb").mesh
    elements = mesh.labels[mesh.blocks["hex20"]]
    touching = np.unique(elements[np.isin(elements, model.constrained[:, 0]).any(axis=1)])
    inner = ~np.isin(model.dof_nodes, touching)
    result = read_binary(str(shipped / "file.rst"))
    for mode, printed in enumerate(result.time_values):
        nodes, shape = result.nodal_solution(mode)
        x = shape[np.searchsorted(nodes, model.dof_nodes), model.dof_components]
        force, momentum = (model.K @ x)[inner], (model.M @ x)[inner]
        squared = momentum @ force / (momentum @ momentum)
        assert np.sqrt(squared) / (2 * np.pi) == pytest.approx(printed, rel=1e-6)
        assert np.linalg.norm(force - squared * momentum) < 1e-5 * np.linalg.norm(force)


def test_full_is_what_the_reader_kept_by_others_finds(shipped):
    from ansys.mapdl.reader.full import FullFile

    from slipstick.importers.raw_model import full_symmetric

    reference, stiffness, mass = FullFile(str(shipped / "file.full")).load_km(sort=True)
    model = read_model(shipped / "file.full")
    names = {f"n{node}{'xyz'[axis]}": row for row, (node, axis) in enumerate(reference.tolist())}
    rows = [names[dof] for dof in model.dofs]
    for ours, theirs in ((model.K, stiffness), (model.M, mass)):
        assert abs(full_symmetric(theirs, "theirs")[rows][:, rows] - ours).max() == 0.0


def test_full_lists_what_is_held(shipped):
    model = read_model(shipped / "file.full")
    assert model.n_dofs == 900
    assert sorted(set(model.constrained[:, 0].tolist())) == list(range(1, 22))
    assert len(model.constrained) == 63
    first = np.sqrt(eigsh(model.K, 1, model.M, sigma=0.0)[0][0]) / (2 * np.pi)
    assert first == pytest.approx(1283.2003692, rel=1e-8)  # by dense LAPACK on the same matrices


def test_full_takes_positions_and_components_from_the_archive(shipped):
    """The archive is in N and m, the matrices in lbf and inch: only with the material of the matrices they fit."""
    files = [shipped / "file.full", shipped / "HexBeam.cdb"]
    with pytest.raises(InputError, match=r"the matrices have the mass .*, the mesh beside them .*in the same units"):
        read_model(files)
    model = read_model(files, ImportOptions(material=BEAM))
    assert model.warnings == ()
    assert len(model.node_ids) == 321
    assert "NCOMP2" in model.node_sets
    held = np.unique(model.constrained[:, 0])
    np.testing.assert_array_equal(model.positions(held)[:, 2], 0.0)


def test_archive_assembles_to_the_mass_and_frequencies_of_full(shipped):
    """SOLID186 integrates with 2 x 2 x 2 points, our hex20 with 3 x 3 x 3: 0.5 % in frequency; the mass is the same."""
    full = read_model(shipped / "file.full")
    with pytest.warns(SlipstickWarning) as caught:
        model = read_model(shipped / "HexBeam.cdb", ImportOptions(material=BEAM))
    said = [str(warning.message) for warning in caught]
    assert said[0] == "HexBeam.cdb: 40 elements of type SOLID186 are computed as fully integrated hex20"
    assert "not the file's own: material 1 (E = 7e+10" in said[1]
    model = model.fix(np.unique(full.constrained[:, 0]))
    assert sorted(model.dofs) == sorted(full.dofs)
    assert model.M.sum() == pytest.approx(full.M.sum(), rel=1e-9)
    ours, theirs = (np.sqrt(eigsh(m.K, 6, m.M, sigma=0.0)[0]) for m in (model, full))
    np.testing.assert_allclose(ours, theirs, rtol=5e-3)
    assert np.all(ours > theirs)


@pytest.mark.parametrize(
    ("name", "blocks"),
    [
        ("HexBeam.cdb", {"hex20": 40}),
        ("sector.cdb", {"hex8": 101, "wedge6": 4}),
        ("TetBeam.cdb", {"tet4": 3913}),
        ("academic_rotor.cdb", {"hex8": 524}),
    ],
)
def test_shipped_archives(archives, name, blocks):
    from slipstick.fem.geometry import volume

    found = read_mesh(archives / name)
    assert {kind: len(part) for kind, part in found.mesh.blocks.items()} == blocks
    assert volume(found.mesh) > 0.0
    if name == "HexBeam.cdb":
        assert found.materials["material 1"] == Material(young=7e10, poisson=0.35, density=2700.0)
        assert set(found.mesh.element_sets) >= {"ECOMP1", "ECOMP2"}


def test_a_mesh_without_material_says_what_to_give(archives):
    with pytest.raises(InputError, match=r"sector\.cdb: is a mesh without material; give young, poisson and density"):
        read_model(archives / "sector.cdb")


def _cdb(rows: list[list[int]], kind: int, points: list[tuple[float, float, float]]) -> str:
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


def test_degenerate_bricks_units_material_and_supports(tmp_path):
    pytest.importorskip("mapdl_archive")
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    points = [(x, y, z) for z in (0.0, 1.0) for x, y in square] + [(0.5, 0.5, 2.0), (2.0, 0.0, 0.0), (2.0, 0.0, 1.0)]
    rows = [
        [1, 2, 3, 4, 5, 6, 7, 8],
        [5, 6, 7, 8, 9, 9, 9, 9],
        [2, 10, 3, 3, 6, 11, 7, 7],
        [6, 11, 7, 7, 9, 9, 9, 9],
    ]
    path = tmp_path / "shapes.cdb"
    path.write_text(_cdb(rows, 185, points))
    found = read_mesh(path)
    expected = {"hex8": [1], "pyramid5": [2], "wedge6": [3], "tet4": [4]}
    assert {kind: part.tolist() for kind, part in found.mesh.element_labels.items()} == expected
    assert found.units == "inch, lbf, s"
    assert found.materials == {"material 1": Material(young=3e7, poisson=0.3, density=7.3e-4)}
    assert found.held.tolist() == [[1, 0], [1, 1], [2, 0], [2, 1], [2, 2]]
    from slipstick.fem.geometry import volume

    assert volume(found.mesh) == pytest.approx(1 + 1 / 3 + 0.5 + 1 / 6)
    model = read_model(path, quiet=True)
    assert model.constrained.tolist() == found.held.tolist()


def test_archive_that_claims_too_much_or_ends_early(shipped, tmp_path):
    text = (shipped / "HexBeam.cdb").read_text()
    path = tmp_path / "bad.cdb"
    for spoilt in (
        text[: len(text) // 3],
        text[: text.index("EBLOCK") + 500],
        text.replace("NBLOCK,6,SOLID,       321,       321", "NBLOCK,6,SOLID,       321,1000000000000"),
        text.replace("\n        1", "\n  garbage", 1),
        "/PREP7\n",
    ):
        path.write_text(spoilt)
        with pytest.raises(InputError) as caught:
            read_mesh(path)
        assert len(caught.value.problems) == 1


@pytest.mark.parametrize("words", [3, 50, 300, 2000, 100_000, 131_000, 140_000])
def test_full_cut_anywhere_is_refused_without_ending_the_process(shipped, tmp_path, words):
    path = tmp_path / "cut.full"
    np.fromfile(shipped / "file.full", dtype="<i4")[:words].tofile(path)
    with pytest.raises(InputError, match="damaged or truncated"):
        read_model(path)


@pytest.mark.parametrize("at", [103, 105, 206, 212, 536, 538, 540, 131_000])
def test_full_with_a_wild_number_is_refused_or_read(shipped, tmp_path, at):
    words = np.fromfile(shipped / "file.full", dtype="<i4")
    words[at] = 2_000_000_000
    path = tmp_path / "wild.full"
    words.tofile(path)
    with contextlib.suppress(InputError):
        assert read_model(path).n_dofs == 900


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


@pytest.fixture
def hbmat(tmp_path):
    a = np.random.default_rng(5).normal(size=(8, 8))
    K, M = a @ a.T + 8 * np.eye(8), np.diag(np.arange(1.0, 9.0))
    dofs = [(node, label) for node in (7, 4) for label in ("UX", "UY", "UZ", "ROTZ")]
    write_harwell_boeing(tmp_path / "beam_K.matrix", K, right_side=True)
    write_harwell_boeing(tmp_path / "beam_M.matrix", M)
    write_mapping(tmp_path / "beam_K.mapping", dofs)
    return tmp_path, K, M


def test_hbmat_with_mapping(hbmat):
    folder, K, M = hbmat
    model = read_model([folder / "beam_K.matrix", folder / "beam_M.matrix"])
    assert model.dofs == ("n7x", "n7y", "n7z", "n7rz", "n4x", "n4y", "n4z", "n4rz")
    np.testing.assert_allclose(model.K.toarray(), K, rtol=1e-15)
    np.testing.assert_allclose(model.M.toarray(), M, rtol=1e-15)


def test_unsymmetric_harwell_boeing_from_scipy(tmp_path):
    """A file of another writer: scipy's, RUA, several numbers a line."""
    from scipy.io import hb_write

    from slipstick.importers.plain.harwell_boeing import read_harwell_boeing

    matrix = coo_array(np.diag(np.arange(1.0, 30.0)) + np.diag(np.full(28, -0.123456789), 1)).tocsc()
    hb_write(tmp_path / "a.hb", matrix)
    np.testing.assert_allclose(read_harwell_boeing(tmp_path / "a.hb").toarray(), matrix.toarray(), rtol=1e-14)


def test_hbmat_without_mapping_says_so(hbmat):
    folder, *_ = hbmat
    (folder / "beam_K.mapping").unlink()
    with pytest.raises(InputError, match="no map from rows to nodes and directions"):
        read_model([folder / "beam_K.matrix", folder / "beam_M.matrix"])


def test_hbmat_that_claims_or_lacks_numbers(hbmat):
    folder, *_ = hbmat
    path = folder / "beam_K.matrix"
    text = path.read_text()
    size = f"{8:14d}{8:14d}"
    for spoilt, sentence in (
        (text[:700], "truncated"),
        (text.replace(size, f"{10**12:14d}{10**12:14d}", 1), "claims 1000000000000 rows"),
        (text.replace("RSA", "CSA", 1), "type CSA"),
        (text.replace("D+0", "D#0", 1), "something else than numbers"),
        ("no matrix at all", "not a Harwell-Boeing text file"),
    ):
        path.write_text(spoilt)
        with pytest.raises(InputError, match=sentence):
            read_model([path, folder / "beam_M.matrix"])


@pytest.mark.skipif(not BLADE.is_file(), reason="the turbine blade is not beside this checkout")
def test_real_turbine_blade(tmp_path):
    pytest.importorskip("mapdl_archive")
    root = ["FIRTREE1", "FIRTREE2", "FIRTREE3", "FIRTREE4"]
    with pytest.warns(SlipstickWarning, match="stiff in bending"):
        model = import_model(BLADE, output=tmp_path / "blade.h5", fixed=root)
    notes = summary(model)
    assert model.mesh.n_nodes == 15689
    assert {kind: len(part) for kind, part in model.mesh.blocks.items()} == {"hex8": 12331, "wedge6": 38}
    assert {name: len(nodes) for name, nodes in model.node_sets.items()} == {
        "PRESSURE_SURF": 2701,
        **dict.fromkeys(root, 80),
    }
    assert "lbf, inch, s" in model.units
    assert [warning for warning in model.warnings if "stiff in bending" in warning] == list(model.warnings)
    assert len(model.warnings) == 1
    assert not any("not held" in note for note in notes)
    assert model.mesh.surface("PRESSURE_SURF").n_faces > 2000
    with pytest.warns(SlipstickWarning, match="stiff in bending"):
        again = load_model(tmp_path / "blade.h5")
    assert again.n_dofs == model.n_dofs == 3 * (15689 - len(np.unique(model.constrained[:, 0])))


@pytest.mark.verify
@pytest.mark.skipif(not BLADE.is_file(), reason="the turbine blade is not beside this checkout")
def test_real_turbine_blade_quadratic():
    pytest.importorskip("mapdl_archive")
    root = ["FIRTREE1", "FIRTREE2", "FIRTREE3", "FIRTREE4"]
    model = read_model(BLADE, ImportOptions(fixed=root, quadratic=True))
    assert model.n_dofs == 175_521
    assert model.mesh.n_nodes == 59_371


CUBE = [(x, y, z) for z in (0.0, 1.0) for x, y in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]]


def cube(folder: Path, more: str = "", *, old: str = "", new: str = "") -> Path:
    """One brick with three nodes held, and more commands."""
    text = _cdb([list(range(1, 9))], 185, CUBE) + "D,4,ALL,0.\n" + more
    assert old in text
    (folder / "cube.cdb").write_text(text.replace(old, new, 1) if old else text)
    return folder / "cube.cdb"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("CE,R5.0,DEFI,    3,    1,  0.0\nCE,R5.0,NODE,    5,UX  ,  1.0\n", "and 1 more: CE ties degrees of freedom"),
        ("CP,    1,UX  ,    5,    6\n", "CP ties degrees of freedom to each other"),
        ("ET,2,21\nR,2,1000\nTYPE,2\nREAL,2\nEN,100,6\n", "EN adds an element outside of the element blocks"),
        ("MPCHG,2,ALL\n", "MPCHG changes the materials"),
        ("EDELE,1\n", "EDELE changes the mesh"),
        ("D,      5,UX  , 0.1, 0.0\n", "D prescribes a value that is not 0"),
        ("D,      5,UX  , %MOVE%, 0.0\n", "D prescribes a value that is not 0"),
        ("D,ROOT,ALL,0.\n", "D names its nodes otherwise than one on a line"),
        ("INISTATE,DEFI,1,,,,100.\n", "INISTATE sets stresses"),
        ("MP,EX,1,3.0E+07,-1e3\n", "MP of material 1: EX depends on temperature"),
        ("MPDATA,R5.0, 1,EX  ,       1, 4, 2.9E+07\n", "material 1: EX depends on temperature (3e+07 to 2.9e+07)"),
        ("MP,EY,1,2.0E+07\n", "material 1: EY is 2e+07, along x 3e+07: not isotropic"),
        ("MP,GXY,1,2.0E+07\n", "material 1: GXY is 2e+07, of an isotropic material 1.15385e+07"),
        ("TB,ANEL,1,1,21,0\n", "TB, ANEL of material 1 is not isotropic elasticity"),
        ("D,99999999999999999999,ALL,0.\n", "D cannot be read"),
        (
            "CMBLOCK,ROOT,NODE,       3\n(8i10)\n         1        -4\n",
            "component ROOT claims 3 numbers, the file has 2",
        ),
        ("CDREAD,DB,'other',cdb\n", "CDREAD brings in data that are not in the file"),
    ],
)
def test_what_couples_or_holds_otherwise_is_refused_by_name(tmp_path, more, said):
    pytest.importorskip("mapdl_archive")
    with pytest.raises(InputError) as caught:
        read_model(cube(tmp_path, more))
    assert said in str(caught.value)
    assert str(caught.value).startswith("cube.cdb")


@pytest.mark.parametrize(("kind", "name"), [(21, "MASS21"), (14, "COMBIN14"), (174, "CONTA174"), (999, "999")])
def test_other_elements_are_refused_by_name(tmp_path, kind, name):
    """A second brick of a type that adds stiffness, mass or contact."""
    pytest.importorskip("mapdl_archive")
    path = tmp_path / "two.cdb"
    text = _cdb([list(range(1, 9)), list(range(1, 9))], 185, CUBE).replace("ET,1,185", f"ET,1,185\nET,2,{kind}")
    lines = text.splitlines()
    second = next(i for i, line in enumerate(lines) if line.startswith(f"{1:9d}{1:9d}") and line[90:99] == f"{2:9d}")
    lines[second] = f"{1:9d}{2:9d}" + lines[second][18:]
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=f"two.cdb: 1 elements of type {name} add stiffness, mass or constraints"):
        read_model(path)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("ALPHAD, 0.5\n", "ALPHAD is not read; give the structure's loss_factor"),
        ("OMEGA, 0.0, 0.0, 100.\n", "OMEGA rotates the structure"),
        ("NOSUCH,1,2\n", "NOSUCH is not understood: it has no effect here"),
        ("MP,DMPR,1,0.02\n", "DMPR of material 1: damping is not read"),
        ("TB,BISO,1,1,2\n", "TB, BISO of material 1 is left out: the structure is linear"),
        ("KEYOP,1,2,3\n", "1 elements of type SOLID185 with KEYOPT(2) = 3 are computed as fully integrated hex8"),
    ],
)
def test_what_is_approximated_is_warned_of(tmp_path, more, said):
    pytest.importorskip("mapdl_archive")
    path = cube(tmp_path, old="ET,1,185\n", new="ET,1,185\n" + more) if more[:3] == "KEY" else cube(tmp_path, more)
    with pytest.warns(SlipstickWarning) as caught:
        read_model(path)
    assert any(said in str(warning.message) for warning in caught)


def test_rotated_nodes(tmp_path, shipped):
    """Free or wholly held they do not matter; held in part they do, and beside matrices always."""
    pytest.importorskip("mapdl_archive")
    rows = {node: "".join(f"{v:21.13E}" for v in CUBE[node - 1]) + "\n" for node in (1, 4, 7)}
    turned = {node: row[:-1] + f"{30.0:21.13E}{0.0:21.13E}\n" for node, row in rows.items()}
    for node in (4, 7):
        assert read_model(cube(tmp_path, old=rows[node], new=turned[node]), quiet=True).n_dofs == 24 - 8
    with pytest.raises(InputError, match=r"1 nodes \(1, ...\) are held along rotated directions"):
        read_model(cube(tmp_path, old=rows[1], new=turned[1]))
    lines = (shipped / "HexBeam.cdb").read_text().splitlines()
    number = next(i for i, line in enumerate(lines) if line.startswith(f"{50:9d}{0:9d}{0:9d}"))
    lines[number] = lines[number].ljust(27 + 63) + f"{45.0:21.13E}"
    (tmp_path / "turned.cdb").write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=r"1 nodes \(50, ...\) have rotated directions"):
        read_model([shipped / "file.full", tmp_path / "turned.cdb"], ImportOptions(material=BEAM))
