"""Input files as other programs write them, and those that leave the mesh unclear."""

import pytest
from helpers.input_file import CUBE, HELD, write

from slipstick.errors import InputError
from slipstick.importers.abaqus.input_file import read_content
from slipstick.importers.import_model import read_mesh, read_model


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("*INCLUDE, INPUT=more.inp", "line 24: *INCLUDE: there is no file more.inp in the folder"),
        ("*NODE, INPUT=nodes.txt", "*NODE has its data in another file"),
        ("*NODE, SYSTEM=S\n11, 1., 90., 0.", "*NODE gives spherical coordinates"),
        ("*NODE, NSET=N2\n2, 1.5, 0., 0.", "node 2 is given again at another place"),
        ("*ELEMENT, TYPE=C3D10\n1, 2, 1, 3, 4, 5, 6, 7, 8, 9, 10", "element 1 is given twice"),
        ("*NGEN\n1, 5, 1", "*NGEN is not read: the mesh would be incomplete"),
        ("*PART, NAME=A\n*END PART\n*PART, NAME=B\n*END PART", "*PART begins a second part"),
        ("*INSTANCE, NAME=A-1, PART=A\n*END INSTANCE", "*INSTANCE names the part A, which the file does not have"),
        (
            "*SURFACE, NAME=S, TYPE=ELEMENT\nNOWHERE, S1",
            "line 25: *SURFACE names NOWHERE, which the file does not have",
        ),
        ("*SURFACE, NAME=S, TYPE=ELEMENT\nEALL, S9", "line 25: *SURFACE: found face S9; expected S1 to S4"),
        ("*SURFACE, NAME=S, TYPE=NODE\nNOWHERE", "*SURFACE names NOWHERE, which the file does not have"),
        ("*BOUNDARY\nNOWHERE, 1, 3", "*BOUNDARY names NOWHERE, which the file does not have"),
        ("*TRANSFORM, NSET=NOWHERE\n1., 1., 0., -1., 1., 0.", "*TRANSFORM names NOWHERE"),
        ("*SOLID SECTION, ELSET=NOWHERE, MATERIAL=STEEL", "*SOLID SECTION names the element set NOWHERE"),
        ("*SOLID SECTION, ELSET=EALL, MATERIAL=WOOD", "names material WOOD, which has no *ELASTIC"),
        ("*ELEMENT\n5, 1, 2", "*ELEMENT lacks TYPE="),
        ("*NODE\n99999999999999999999, 0., 0., 0.", "99999999999999999999... is too long for a label"),
        (
            "*ELEMENT, TYPE=T3D2, ELSET=BAR\n9, 2, 3\n*SOLID SECTION, ELSET=BAR, MATERIAL=STEEL",
            "1 elements of type T3D2",
        ),
    ],
)
def test_what_leaves_the_mesh_unclear_is_refused(tmp_path, more, said):
    with pytest.raises(InputError) as caught:
        read_model(write(tmp_path, CUBE + HELD + more + "\n"))
    assert said in str(caught.value)
    assert "m.inp" in str(caught.value)


def test_keywords_and_sets_as_other_programs_write_them(tmp_path):
    """Lower case, blanks before the star, a keyword over two lines, sets of an instance, sets defined later."""
    text = CUBE.replace("*ELEMENT, TYPE=C3D10, ELSET=EALL", "  *Element, type=C3D10,\n   elset=Eall")
    more = "*boundary\npart-1-1.later, encastre\n*NSET, NSET=LATER, ELSET=EALL\n*BOUNDARY\n2, 1, 6, 0.\n"
    mesh = read_mesh(write(tmp_path, text + more))
    assert len(mesh.held) == 30
    assert mesh.warnings == ()


def test_a_surface_without_face_numbers_is_the_outside(tmp_path):
    mesh = read_mesh(write(tmp_path, CUBE + HELD + "*SURFACE, NAME=SKIN\nEALL,\n")).mesh
    assert mesh.surface("SKIN").n_faces == 4


def test_content_by_hand(tmp_path):
    """Sets of sets and ranges; a later block may name what stands further down."""
    text = CUBE + "*NSET, NSET=TIP, GENERATE\n2, 6, 2\n*NSET, NSET=BOTH\nTIP, root\n*ELSET, ELSET=E2\nEALL\n"
    content = read_content(write(tmp_path, "*BOUNDARY\nBOTH, 2\n2, ENCASTRE\n" + text))
    assert content.node_sets["TIP"] == [2, 4, 6]
    assert content.node_sets["BOTH"] == [2, 4, 6, 1, 3, 4, 7, 8, 10]
    assert content.element_sets == {"EALL": [1], "E2": [1]}
    assert content.elements == {"tet10": {1: list(range(1, 11))}}
    assert content.held == {(node, 1) for node in (1, 2, 3, 4, 6, 7, 8, 10)} | {(2, axis) for axis in range(6)}
    assert content.properties == {"STEEL": {"young": 2.1e5, "poisson": 0.3, "density": 7.8e-9}}


def test_surfaces_that_are_others_together(tmp_path):
    sides = "*SURFACE, NAME=A\nEALL, S1\n*SURFACE, NAME=B\nEALL, S2\n*SURFACE, NAME=AB, COMBINE=UNION\nA, B\n"
    mesh = read_mesh(write(tmp_path, CUBE + sides)).mesh
    assert mesh.surface("AB").n_faces == 2
    with pytest.raises(InputError, match="names C, which the file does not have"):
        read_mesh(write(tmp_path, CUBE + sides.replace("A, B", "A, C")))
    found = read_mesh(write(tmp_path, CUBE + sides.replace("UNION", "DIFFERENCE")))
    assert any("AB of DIFFERENCE is left out" in sentence for sentence in found.warnings)
