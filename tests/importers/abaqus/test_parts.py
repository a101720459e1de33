"""Parts, instances, assemblies, and systems of nodes: the flat deck of the same body is the truth."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.input_file import write

from slipstick.errors import InputError
from slipstick.importers.import_model import read_mesh, read_model

NODES = ["0,0,0", "2,0,0", "2,1,0", "0,1,0", "0,0,1", "2,0,1", "2,1,1", "0,1,1"]
STEEL = "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e5, 0.3\n*DENSITY\n7.8e-9\n"

PART = f"""*PART, NAME=BAR
*NODE
{chr(10).join(f"{i}, {x}" for i, x in enumerate(NODES, 1))}
*ELEMENT, TYPE=C3D8I
1, 1, 2, 3, 4, 5, 6, 7, 8
*NSET, NSET=SET-1, GENERATE
1, 8, 1
*NSET, NSET=LEFT
1, 4, 5, 8
*ELSET, ELSET=SET-1
1,
*ELSET, ELSET=_END_S4, INTERNAL
1,
*SURFACE, NAME=END, TYPE=ELEMENT
_END_S4, S4
*SOLID SECTION, ELSET=SET-1, MATERIAL=STEEL
*END PART
"""

ASSEMBLY = f"""*HEADING
two bars, the second behind the first and turned by 90 degrees about its own axis
{PART}*ASSEMBLY, NAME=ASSEMBLY
*INSTANCE, NAME=BAR-1, PART=BAR
*END INSTANCE
*INSTANCE, NAME="Bar-2", PART=BAR
2., 0., 0.
0., 0.5, 0.5, 1., 0.5, 0.5, 90.
*END INSTANCE
*NODE
1, 5., 0.5, 0.5
*NSET, NSET=POINT
1
*NSET, NSET=SET-1, INSTANCE=BAR-1
LEFT, 1
*NSET, NSET=FAR, INSTANCE=BAR-2
2, 3
*SURFACE, NAME=START, TYPE=ELEMENT
BAR-2.SET-1, S6
*TIE, NAME=GLUE
START, BAR-1.END
*COUPLING, CONSTRAINT NAME=C, REF NODE=POINT, SURFACE=BAR-2.END
*KINEMATIC
*END ASSEMBLY
{STEEL}*BOUNDARY
SET-1, ENCASTRE
BAR-2.3, 2
*STEP
*FREQUENCY
3
*END STEP
"""


def flat() -> str:
    """The same with two rows of nodes of one deck; BAR-2 has labels from 11."""
    places = np.array([[float(x) for x in row.split(",")] for row in NODES])
    other = places + np.array([2.0, 0.0, 0.0])
    turned = np.stack([other[:, 0], 0.5 - (other[:, 2] - 0.5), 0.5 + (other[:, 1] - 0.5)], axis=1)
    lines = [f"{i}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(places.tolist(), 1)]
    lines += [f"{i}, {x}, {y}, {z}" for i, (x, y, z) in enumerate(turned.tolist(), 11)]
    return f"""*NODE
{chr(10).join(lines)}
21, 5., 0.5, 0.5
*ELEMENT, TYPE=C3D8I, ELSET=ALL
1, 1, 2, 3, 4, 5, 6, 7, 8
11, 11, 12, 13, 14, 15, 16, 17, 18
*SURFACE, NAME=START, TYPE=ELEMENT
11, S6
*SURFACE, NAME=END1, TYPE=ELEMENT
1, S4
*SURFACE, NAME=END2, TYPE=ELEMENT
11, S4
*TIE, NAME=GLUE
START, END1
*COUPLING, CONSTRAINT NAME=C, REF NODE=21, SURFACE=END2
*KINEMATIC
*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL
{STEEL}*BOUNDARY
1, 1, 3
4, 1, 3
5, 1, 3
8, 1, 3
13, 2
"""


def test_two_moved_instances_are_the_flat_deck(tmp_path):
    model = read_model(write(tmp_path, ASSEMBLY))
    (tmp_path / "flat").mkdir()
    reference = read_model(write(tmp_path / "flat", flat()))
    assert model.dofs == reference.dofs
    np.testing.assert_allclose(model.coordinates, reference.coordinates, atol=1e-15)
    assert abs(model.K - reference.K).max() < 1e-12 * abs(reference.K).max()
    assert abs(model.M - reference.M).max() < 1e-12 * abs(reference.M).max()
    told = [note for note in model.notes if "raised" in note]
    assert told == [
        "m.inp: labels of instance BAR-2 are raised by 10: other instances have them",
        "m.inp: labels of the assembly are raised by 20: other instances have them",
    ]


def test_names_say_whose_they_are_where_several_have_them(tmp_path):
    mesh = read_mesh(write(tmp_path, ASSEMBLY)).mesh
    assert set(mesh.node_sets) == {
        *("SET-1", "BAR-1.SET-1", "BAR-2.SET-1", "BAR-1.LEFT", "BAR-2.LEFT", "POINT", "FAR"),
    }
    assert set(mesh.surfaces) >= {"START", "BAR-1.END", "BAR-2.END"}
    assert mesh.labels[mesh.node_sets["SET-1"]].tolist() == [1, 4, 5, 8]
    assert mesh.labels[mesh.node_sets["FAR"]].tolist() == [12, 13]
    assert mesh.labels[mesh.node_sets["POINT"]].tolist() == [21]


def test_a_set_of_the_assembly_does_not_take_in_that_of_a_part(tmp_path):
    """Both are called Set-1 by Abaqus/CAE, and the support means the second one."""
    one = f"""{PART}*ASSEMBLY, NAME=A
*INSTANCE, NAME=BAR-1, PART=BAR
*END INSTANCE
*NSET, NSET=SET-1, INSTANCE=BAR-1
1, 4
*END ASSEMBLY
{STEEL}*BOUNDARY
SET-1, 1, 3
BAR-1.LEFT, 1
"""
    mesh = read_mesh(write(tmp_path, one))
    assert {node for node, axis in mesh.held if axis == 1} == {1, 4}
    assert {node for node, axis in mesh.held if axis == 0} == {1, 4, 5, 8}
    assert set(mesh.mesh.node_sets) == {"SET-1", "BAR-1.SET-1", "LEFT"}


@pytest.mark.parametrize(
    ("system", "node", "place"),
    [
        ("1., 2., 3.", "1., 0., 0.5", (2.0, 2.0, 3.5)),
        ("1., 2., 3., 1., 5., 3.", "1., 0., 0.5", (1.0, 3.0, 3.5)),
        ("1., 2., 3., 1., 2., 4.\n1., 3., 3.", "1., 0.25, 0.5", (0.5, 2.25, 4.0)),
        ("", "1., 0., 0.5", (1.0, 0.0, 0.5)),
    ],
)
def test_nodes_of_a_system(tmp_path, system, node, place):
    """Origin alone; with a point of the x axis; with a third one in the x-y plane; ended."""
    before = "*SYSTEM\n7., 7., 7.\n" if not system else ""
    text = f"{before}*SYSTEM\n{system}\n*NODE\n9, {node}\n*SYSTEM\n{PART}".replace("*PART, NAME=BAR\n", "")
    mesh = read_mesh(write(tmp_path, text.replace("*END PART\n", "") + STEEL)).mesh
    np.testing.assert_allclose(mesh.nodes[mesh.labels == 9][0], place, atol=1e-15)
    np.testing.assert_array_equal(mesh.nodes[mesh.labels == 3][0], [2.0, 1.0, 0.0])


def test_cylindrical_nodes(tmp_path):
    text = f"*NODE, SYSTEM=C\n9, 2., 30., 0.5\n{PART}".replace("*PART, NAME=BAR\n", "").replace("*END PART\n", "")
    mesh = read_mesh(write(tmp_path, text + STEEL)).mesh
    np.testing.assert_allclose(mesh.nodes[mesh.labels == 9][0], [np.sqrt(3.0), 1.0, 0.5], atol=1e-15)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("PART=BAR\n*END INSTANCE", "PART=ROD\n*END INSTANCE", "*INSTANCE names the part ROD, which"),
        ('NAME="Bar-2", ', "", "*INSTANCE lacks NAME="),
        ('"Bar-2"', "BAR-1", "*INSTANCE is given twice"),
        ("2., 0., 0.\n", "2., x, 0.\n", "*INSTANCE cannot be read"),
        ("1., 0.5, 0.5, 90.", "1., 0.5", "*INSTANCE cannot be read (5 numbers of a rotation"),
        ("1., 0.5, 0.5, 90.", "0., 0.5, 0.5, 90.", "*INSTANCE cannot be read (the two points of the axis are the same"),
        ("BAR-2.SET-1, S6", "BAR-2.SET-7, S6", "*SURFACE names BAR-2.SET-7"),
        ("BAR-2.3, 2", "BAR-3.SET-1, 2", "*BOUNDARY names BAR-3.SET-1"),
        ("*NODE\n1, 5.", "*SYSTEM\n1., 0.\n*NODE\n1, 5.", "*SYSTEM cannot be read (2 numbers"),
        (
            "*NODE\n1, 5.",
            "*SYSTEM\n0., 0., 0., 0., 0., 1.\n*NODE\n1, 5.",
            "*SYSTEM cannot be read (an x axis",
        ),
    ],
)
def test_faults(tmp_path, old, new, said):
    assert old in ASSEMBLY
    with pytest.raises(InputError) as caught:
        read_model(write(tmp_path, ASSEMBLY.replace(old, new, 1)))
    assert said in str(caught.value)
    assert "m.inp, line" in str(caught.value)


def test_instances_beyond_all_bounds_are_refused_before_they_are_made(tmp_path, monkeypatch):
    monkeypatch.setattr("slipstick.importers.abaqus.parts._LARGEST", 30)
    with pytest.raises(InputError, match=r"m.inp, line 30: .INSTANCE makes more than 30 lines"):
        read_model(write(tmp_path, ASSEMBLY))
