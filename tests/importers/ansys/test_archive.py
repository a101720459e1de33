"""Archives: the ones the readers' packages ship, some written here, and a real blade."""

import numpy as np
import pytest
from helpers.ansys import BEAM, BLADE, CUBE, archive_text, cube, needs_blade
from scipy.sparse.linalg import eigsh
from scipy.spatial.transform import Rotation

from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.materials import Material
from slipstick.importers.import_model import import_model, read_mesh, read_model, summary
from slipstick.importers.roles import ImportOptions
from slipstick.io.model_file import load_model


def test_archive_assembles_to_the_matrices_of_full(shipped):
    """SOLID186 as Ansys assembles it: the stiffness to rounding; its mass takes fewer points, 2e-6 in frequency."""
    full = read_model(shipped / "file.full")
    with pytest.warns(SlipstickWarning) as caught:
        model = read_model(shipped / "HexBeam.cdb", ImportOptions(material=BEAM))
    said = [str(warning.message) for warning in caught]
    assert len(said) == 1
    assert "not the file's own: material 1 (E = 7e+10" in said[0]
    model = model.fix(np.unique(full.constrained[:, 0]))
    assert sorted(model.dofs) == sorted(full.dofs)
    assert model.M.sum() == pytest.approx(full.M.sum(), rel=1e-9)
    rows = [model.index(dof) for dof in full.dofs]
    assert abs(model.K[rows][:, rows] - full.K).max() < 1e-12 * abs(full.K).max()
    ours, theirs = (np.sqrt(eigsh(m.K, 6, m.M, sigma=0.0)[0]) for m in (model, full))
    np.testing.assert_allclose(ours, theirs, rtol=2e-6)


@pytest.mark.parametrize(
    ("name", "blocks"),
    [
        ("HexBeam.cdb", {"hex20r": 40}),
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
    path.write_text(archive_text(rows, 185, points))
    found = read_mesh(path)
    expected = {"hex8": [1], "pyramid5": [2], "wedge6": [3], "tet4": [4]}
    assert {kind: part.tolist() for kind, part in found.mesh.element_labels.items()} == expected
    assert found.units == "inch, lbf, s"
    assert found.materials == {"material 1": Material(young=3e7, poisson=0.3, density=7.3e-4)}
    assert found.held_rows.tolist() == [[1, 0], [1, 1], [2, 0], [2, 1], [2, 2]]
    from slipstick.fem.geometry import volume

    assert volume(found.mesh) == pytest.approx(1 + 1 / 3 + 0.5 + 1 / 6)
    model = read_model(path, quiet=True)
    assert model.constrained.tolist() == found.held_rows.tolist()


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
        assert len(caught.value.sentences) == 1


@needs_blade
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
    assert "lbf, inch, s" in model.units_told
    assert [warning for warning in model.warnings if "stiff in bending" in warning] == list(model.warnings)
    assert len(model.warnings) == 1
    assert not any("not constrained" in note for note in notes)
    assert model.mesh.surface("PRESSURE_SURF").n_faces > 2000
    with pytest.warns(SlipstickWarning, match="stiff in bending"):
        again = load_model(tmp_path / "blade.h5")
    assert again.n_dofs == model.n_dofs == 3 * (15689 - len(np.unique(model.constrained[:, 0])))


@pytest.mark.verify
@needs_blade
def test_real_turbine_blade_quadratic():
    pytest.importorskip("mapdl_archive")
    root = ["FIRTREE1", "FIRTREE2", "FIRTREE3", "FIRTREE4"]
    model = read_model(BLADE, ImportOptions(fixed=root, quadratic=True))
    assert model.n_dofs == 175_521
    assert model.mesh.n_nodes == 59_371


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("CERIG,1,2,ALL\n", "CERIG ties degrees of freedom to each other"),
        ("CPINTF,ALL\n", "CPINTF ties degrees of freedom to each other"),
        ("NROTAT,5\n", "NROTAT rotates the directions of nodes"),
        ("ET,2,21\nR,2,1000\nTYPE,2\nREAL,2\nEN,100,6\n", "EN adds an element outside of the element blocks"),
        ("MPCHG,2,ALL\n", "MPCHG changes the materials"),
        ("EDELE,1\n", "EDELE changes the mesh"),
        ("D,      5,UX  , 0.1, 0.2\n", "D prescribes a value that is not 0"),
        ("D,      5,ROTX, 0.1, 0.0\n", "D prescribes a value that is not 0"),
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


@pytest.mark.parametrize(("kind", "name"), [(27, "MATRIX27"), (181, "SHELL181"), (177, "CONTA177"), (999, "999")])
def test_other_elements_are_refused_by_name(tmp_path, kind, name):
    """A second brick of a type that adds stiffness, mass or contact."""
    pytest.importorskip("mapdl_archive")
    path = tmp_path / "two.cdb"
    text = archive_text([list(range(1, 9)), list(range(1, 9))], 185, CUBE).replace("ET,1,185", f"ET,1,185\nET,2,{kind}")
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
        ("KEYOP,1,2,1\n", "1 elements of type SOLID185 with KEYOPT(2) = 1 are computed by their mean strain"),
        ("KEYOP,1,2,3\n", "1 elements of type SOLID185 with KEYOPT(2) = 3 are computed as fully integrated hex8"),
    ],
)
def test_what_is_approximated_is_warned_of(tmp_path, more, said):
    pytest.importorskip("mapdl_archive")
    path = cube(tmp_path, old="ET,1,185\n", new="ET,1,185\n" + more) if more[:3] == "KEY" else cube(tmp_path, more)
    with pytest.warns(SlipstickWarning) as caught:
        read_model(path)
    assert any(said in str(warning.message) for warning in caught)


def test_solids_that_come_after_other_elements_are_read(tmp_path):
    pytest.importorskip("mapdl_archive")
    text = archive_text([list(range(1, 9)), list(range(1, 9))], 185, CUBE).replace("ET,1,185", "ET,1,185\nET,2,154")
    lines = text.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith(f"{1:9d}{1:9d}") and line[90:99] == f"{1:9d}")
    lines[first] = f"{1:9d}{2:9d}" + lines[first][18:]
    (tmp_path / "two.cdb").write_text("\n".join(lines) + "\n")
    found = read_mesh(tmp_path / "two.cdb")
    assert {kind: len(block) for kind, block in found.mesh.blocks.items()} == {"hex8": 1}
    assert found.mesh.element_label("hex8", 0) == 2
    assert any("SURF154" in note for note in found.notes)


@pytest.mark.parametrize("angles", [(30.0, 20.0, 10.0), (-70.0, 110.0, 45.0), (0.0, 90.0, 0.0), (0.0, 0.0, -15.0)])
def test_axes_of_nodes_are_turned_about_z_then_the_new_x_then_the_new_y(tmp_path, angles):
    """Against scipy's intrinsic rotations."""
    pytest.importorskip("mapdl_archive")
    row = "".join(f"{v:21.13E}" for v in CUBE[4]) + "\n"
    path = cube(tmp_path, old=row, new=row[:-1] + "".join(f"{angle:21.13E}" for angle in angles) + "\n")
    axes = read_mesh(path).axes[5]
    np.testing.assert_allclose(axes, Rotation.from_euler("ZXY", angles, degrees=True).as_matrix().T, atol=1e-12)


def test_rotated_nodes(tmp_path, shipped):
    """Held in part they are held along their own directions; beside matrices of Ansys the rows are turned."""
    pytest.importorskip("mapdl_archive")
    rows = {node: "".join(f"{v:21.13E}" for v in CUBE[node - 1]) + "\n" for node in (1, 4, 7)}
    turned = {node: row[:-1] + f"{30.0:21.13E}{0.0:21.13E}\n" for node, row in rows.items()}
    for node in (4, 7):
        assert read_model(cube(tmp_path, old=rows[node], new=turned[node]), quiet=True).n_dofs == 24 - 8
    path = cube(tmp_path, old=rows[1], new=turned[1])
    path.write_text(path.read_text().replace("D,1,UY,0.\n", ""))
    model = read_model(path, quiet=True)
    assert model.n_dofs == 24 - 7
    angle = np.radians(30.0)  # node 1 may move along its own y and z alone: x = -tan y
    x, y = (model.directions([name]).toarray()[:, 0] for name in ("n1x", "n1y"))
    np.testing.assert_allclose(np.cos(angle) * x + np.sin(angle) * y, 0.0, atol=1e-12)
    lines = (shipped / "HexBeam.cdb").read_text().splitlines()
    number = next(i for i, line in enumerate(lines) if line.startswith(f"{50:9d}{0:9d}{0:9d}"))
    lines[number] = lines[number].ljust(27 + 63) + f"{45.0:21.13E}"
    (tmp_path / "turned.cdb").write_text("\n".join(lines) + "\n")
    options = ImportOptions(material=BEAM)
    own = read_model([shipped / "file.full", shipped / "HexBeam.cdb"], options, quiet=True)
    turned_rows = read_model([shipped / "file.full", tmp_path / "turned.cdb"], options, quiet=True)
    at = [own.index(f"n50{axis}") for axis in "xyz"]
    c = np.sqrt(0.5)
    R = np.array([[c, -c, 0.0], [c, c, 0.0], [0.0, 0.0, 1.0]])  # columns: the directions of the rows in the file
    K, found = own.K.toarray()[np.ix_(at, at)], turned_rows.K.toarray()[np.ix_(at, at)]
    np.testing.assert_allclose(found, R @ K @ R.T, atol=1e-9 * np.abs(K).max())
