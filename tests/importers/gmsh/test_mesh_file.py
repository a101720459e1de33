"""Meshes of Gmsh in both formats, as text and binary: what is read of them, and what is refused."""

import numpy as np
import pytest
from tests.helpers.gmsh import beam, write_inp, write_msh

from slipstick import Material, import_model
from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.geometry import volume
from slipstick.importers.import_model import read_mesh

FORMS = [(version, binary) for version in ("2.2", "4.1") for binary in (False, True)]

CORNERS = {
    "tet": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)],
    "hex": [(x, y, z) for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))],
    "wedge": [(x, y, z) for z in (-1, 1) for x, y in ((0, 0), (1, 0), (0, 1))],
    "pyramid": [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 1)],
}
# the further nodes of the reference elements, as gmsh.model.mesh.getElementProperties of Gmsh 4.15 gives them
FURTHER = {
    11: ("tet", 1 / 6, [(0.5, 0, 0), (0.5, 0.5, 0), (0, 0.5, 0), (0, 0, 0.5), (0, 0.5, 0.5), (0.5, 0, 0.5)]),
    17: (
        "hex",
        8.0,
        [
            *[(0, -1, -1), (-1, 0, -1), (-1, -1, 0), (1, 0, -1), (1, -1, 0), (0, 1, -1)],
            *[(1, 1, 0), (-1, 1, 0), (0, -1, 1), (-1, 0, 1), (1, 0, 1), (0, 1, 1)],
        ],
    ),
    18: (
        "wedge",
        1.0,
        [
            *[(0.5, 0, -1), (0, 0.5, -1), (0, 0, 0), (0.5, 0.5, -1), (1, 0, 0)],
            *[(0, 1, 0), (0.5, 0, 1), (0, 0.5, 1), (0.5, 0.5, 1)],
        ],
    ),
    19: (
        "pyramid",
        4 / 3,
        [
            *[(0, -1, 0), (-1, 0, 0), (-0.5, -0.5, 0.5), (1, 0, 0)],
            *[(0.5, -0.5, 0.5), (0, 1, 0), (0.5, 0.5, 0.5), (-0.5, 0.5, 0.5)],
        ],
    ),
}


@pytest.mark.parametrize(("version", "binary"), FORMS)
def test_groups_of_every_dimension(tmp_path, version, binary):
    points, groups = beam()
    found = read_mesh(write_msh(tmp_path / "m.msh", points, groups, version=version, binary=binary))
    mesh = found.mesh
    assert volume(mesh) == pytest.approx(4.0)
    assert set(mesh.element_sets) == {"body"}
    assert set(mesh.surfaces) == {"root", "tip face"}
    assert set(mesh.node_sets) == {"edge"}
    assert np.all(mesh.nodes[mesh.surface("tip face").nodes, 0] == 4.0)
    assert len(mesh.node_set("edge")) == 2
    (quad,) = mesh.surface("tip face").faces["quad4"]  # written inward, read outward
    a, b, c, _ = mesh.nodes[quad]
    assert np.cross(b - a, c - b)[0] > 0
    assert "m.msh: groups read: element sets body; surfaces root, tip face; node sets edge" in found.notes


@pytest.mark.parametrize(("version", "binary"), FORMS)
@pytest.mark.parametrize("number", FURTHER)
def test_nodes_of_quadratic_elements(tmp_path, number, version, binary):
    family, expected, further = FURTHER[number]
    points = [*CORNERS[family], *further]
    groups = {(3, "one"): [(number, range(1, len(points) + 1))]}
    mesh = read_mesh(write_msh(tmp_path / "m.msh", points, groups, version=version, binary=binary)).mesh
    ((kind, block),) = mesh.blocks.items()
    places = mesh.nodes[block[0]]
    for middle, edge in enumerate(ELEMENTS[kind].edges, ELEMENTS[kind].n_corners):
        np.testing.assert_array_equal(places[middle], places[list(edge)].mean(axis=0))
    assert volume(mesh) == pytest.approx(expected)


def test_an_element_of_two_groups_is_one_element(tmp_path):
    """Format 2.2 writes it once for each group, of the same entity."""
    points, groups = beam()
    path = write_msh(tmp_path / "m.msh", points, groups, version="2.2")
    text = path.read_text()
    body = next(i for i, key in enumerate(groups, 1) if key[0] == 3)
    lines = text[text.index("$Elements") :].splitlines()[2:-1]
    again = [line.replace(f" 5 2 {body} {body} ", f" 5 2 9 {body} ") for line in lines if f" 5 2 {body}" in line]
    text = text.replace("$PhysicalNames\n4\n", '$PhysicalNames\n5\n3 9 "all"\n')
    text = text.replace(f"$Elements\n{len(lines)}\n", f"$Elements\n{len(lines) + len(again)}\n")
    path.write_text(text.replace("$EndElements", "\n".join(again) + "\n$EndElements"))
    mesh = read_mesh(path).mesh
    assert mesh.n_elements == 4
    assert volume(mesh) == pytest.approx(4.0)
    assert {name: len(chosen["hex8"]) for name, chosen in mesh.element_sets.items()} == {"body": 4, "all": 4}


def test_faces_inside_are_a_node_set(tmp_path):
    points, groups = beam()
    inner = [i + 1 for i, p in enumerate(points) if p[0] == 2.0]
    groups = {**groups, (2, "middle"): [(3, [inner[0], inner[1], inner[3], inner[2]])]}
    found = read_mesh(write_msh(tmp_path / "m.msh", points, groups))
    assert "middle" not in found.mesh.surfaces
    assert len(found.mesh.node_set("middle")) == 4
    assert any("no face of middle lies on the boundary: it is a set of 4 nodes, no surface" in n for n in found.notes)
    with pytest.raises(InputError, match="'middle' is a node set"):
        found.mesh.surface("middle")


def test_elements_without_a_group_and_groups_without_a_name(tmp_path):
    points, groups = beam()
    body = groups.pop((3, "body"))
    path = write_msh(tmp_path / "m.msh", points, groups, more=[(3, body)])
    assert volume(read_mesh(path).mesh) == pytest.approx(4.0)
    path.write_text(path.read_text().replace('2 2 "root"\n', "").replace("Names\n3\n", "Names\n2\n"))
    found = read_mesh(path)
    assert "root" not in found.mesh.surfaces
    assert any("physical groups without a name are not read: 2 of surfaces; name them" in note for note in found.notes)


def test_an_input_file_named_msh_is_read_as_that(tmp_path):
    points, groups = beam()
    path = write_inp(tmp_path / "all.msh", points, groups)
    found = read_mesh(path)
    assert volume(found.mesh) == pytest.approx(4.0)
    assert found.notes[0] == "all.msh: is a file of Abaqus or CalculiX, and read as that"
    gmsh = read_mesh(write_msh(tmp_path / "mesh.inp", points, groups))
    assert gmsh.notes[0] == "mesh.inp: is a file of Gmsh, and read as that"


def test_the_input_file_of_gmsh_names_surfaces_and_edges(tmp_path):
    points, groups = beam()
    path = write_inp(tmp_path / "m.inp", points, groups)
    found = read_mesh(path)
    assert not found.warnings
    assert np.all(found.mesh.nodes[found.mesh.surface("TIP_FACE").nodes, 0] == 4.0)
    steel = Material(young=2.1e11, poisson=0.3, density=7850.0)
    with pytest.warns(SlipstickWarning):
        model = import_model(path, material=steel, fixed=["ROOT"])
    assert len(model.constrained) == 12
    assert {"EDGE", "ROOT", "TIP_FACE"} <= set(model.node_sets)
    with pytest.raises(InputError, match=r"node set 'root' is not in the mesh; .*; did you mean 'ROOT'"):
        import_model(path, material=steel, fixed="root")
    with pytest.raises(InputError, match="'BODY' is a set of solid elements"):
        import_model(path, material=steel, fixed="BODY")


def test_surfaces_are_sets_beside_matrices_too(tmp_path):
    import scipy.sparse as sp

    points, groups = beam()
    mesh = write_msh(tmp_path / "m.msh", points, groups)
    steel = Material(young=2.1e11, poisson=0.3, density=7850.0)
    with pytest.warns(UserWarning, match="linear"):
        own = import_model(mesh, material=steel)
    for name in "KM":
        sp.save_npz(tmp_path / f"{name}.npz", sp.csr_array(getattr(own, name)))
    rows = zip(own.dof_nodes, own.dof_components, strict=True)
    (tmp_path / "dofs.map").write_text("".join(f"{node} {'xyz'[c]}\n" for node, c in rows))
    files = [tmp_path / name for name in ("K.npz", "M.npz", "dofs.map", "m.msh")]
    assert len(import_model(files, fixed="root").constrained) == 12


@pytest.mark.parametrize(("version", "binary"), FORMS)
def test_cut_anywhere_it_is_refused_or_whole(tmp_path, version, binary):
    """No cut is read as another mesh."""
    points, groups = beam()
    path = write_msh(tmp_path / "m.msh", points, groups, version=version, binary=binary)
    content = path.read_bytes()
    for cut in range(1, len(content) - 14, max(len(content) // 60, 1)):
        path.write_bytes(content[:cut])
        with pytest.raises(InputError, match=r"^m\.msh: "):
            read_mesh(path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("4.1 0 8", "4 0 8", r"found format '4' of Gmsh; expected 4\.1 or 2\.2"),
        ("4.0 1.0 1.0", "4,0 1,0 1,0", r"\$Nodes holds '4,0', which is no number"),
        (" 5 4\n", " 29 4\n", "elements of Gmsh type 29, which are not read; mesh with order 1 or 2"),
        ("$Elements", "$Element", r"\$Elements is missing"),
        ("\n2\n3\n", "\n2\n2\n", "node 2 is given twice"),
        ("\n2\n3\n", "\n2\n300\n", "an element uses node 3, which is not in the mesh"),
        ("\n2\n3\n", "\n2\n3.5\n", r"\$Nodes holds other numbers than whole ones"),
    ],
)
def test_spoilt_files_are_one_sentence(tmp_path, old, new, said):
    points, groups = beam()
    path = write_msh(tmp_path / "m.msh", points, groups)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=rf"^m\.msh: .*{said}"):
        read_mesh(path)


def test_a_mesh_of_fluent_is_named(tmp_path):
    path = tmp_path / "m.msh"
    path.write_text('(0 "GAMBIT to Fluent File")\n(2 3)\n')
    with pytest.raises(InputError, match=r"m\.msh: is a mesh of Ansys Fluent"):
        read_mesh(path)
