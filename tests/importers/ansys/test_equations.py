"""CE and CP commands: as equations, along directions of the nodes, and what is refused."""

import numpy as np
import pytest
from helpers.ansys import CUBE, cube

from slipstick.errors import InputError
from slipstick.importers.ansys.couplings import read_equations
from slipstick.importers.findings import Findings
from slipstick.importers.import_model import read_model

WRITTEN = (
    "CE,R5.0,DEFI,       3,       1,  0.00000000    \n"
    "CE,R5.0,NODE,      5,UX  ,  1.00000000    ,      6,UX  , -0.50000000    ,\n"
    "CE,R5.0,NODE,      7,UX  , -0.50000000    ,\n"
)
BY_HAND = "CE,1,0,5,UX,1,6,UX,-0.5\nCE,1,0,7,UX,-0.5\n"
CYCLE = "CP,R5.0,DEFI,       3,       1,UY\nCP,R5.0,NODE,       5,       6,       8,\n"


def equations(text):
    findings = Findings(source="a.cdb")
    return read_equations(findings, text), findings


@pytest.mark.parametrize("text", [WRITTEN, BY_HAND], ids=["written", "by hand"])
def test_constraint_equations(text):
    (found,), findings = equations(text)
    assert found.terms == ((5, 0, 1.0), (6, 0, -0.5), (7, 0, -0.5))
    assert str(found.where) == "a.cdb, line 1: CE"
    assert findings.met == {}


@pytest.mark.parametrize("text", [CYCLE, "CP,1,UY,5,6\nCP,1,UY,8\n", "CP,NEXT,UY,5,6,8\n"])
def test_coupled_dofs(text):
    found, _ = equations(text)
    assert [equation.terms for equation in found] == [((6, 1, 1.0), (5, 1, -1.0)), ((8, 1, 1.0), (5, 1, -1.0))]


def test_several_sets_stay_apart():
    found, _ = equations(CYCLE + CYCLE.replace("UY", "UZ").replace("       1,", "       2,") + WRITTEN)
    assert [equation.pairs[0] for equation in found] == [(6, 1), (8, 1), (6, 2), (8, 2), (5, 0)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (WRITTEN.replace("0.00000000    \n", "0.10000000    \n", 1), "CE has a constant that is not 0"),
        (WRITTEN.replace("7,UX", "7,TEMP"), "CE ties TEMP to displacements"),
    ],
)
def test_equations_that_are_refused_by_name(text, said):
    found, findings = equations(text)
    assert found == []
    (coupling,) = findings.couplings
    assert said in str(coupling.refused)


def test_temperatures_have_no_effect():
    found, findings = equations("CP,1,TEMP,5,6\n")
    assert found == []
    assert findings.notes == ("a.cdb: without effect here: CP",)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (WRITTEN.rsplit("CE", 1)[0], "announces 3 terms, 2 are there"),
        ("CE,1,0,5,UX,much\n", "line 1: CE cannot be read"),
        ("CP,1\n", "line 1: CP cannot be read"),
        ("CE,R5.0,NODE,5,UX,1.\n", "line 1: CE cannot be read"),
    ],
)
def test_damaged_lines(text, said):
    with pytest.raises((InputError), match=said):
        equations(text)


def test_equations_in_a_model(tmp_path):
    pytest.importorskip("mapdl_archive")
    model = read_model(cube(tmp_path, WRITTEN + CYCLE), quiet=True)
    motion = {name: model.directions([name]).toarray()[:, 0] for name in ("n5x", "n6x", "n7x", "n5y", "n6y", "n8y")}
    np.testing.assert_allclose(motion["n5x"], 0.5 * (motion["n6x"] + motion["n7x"]), atol=1e-15)
    np.testing.assert_array_equal(motion["n5y"], motion["n6y"])
    np.testing.assert_array_equal(motion["n5y"], motion["n8y"])
    assert model.n_dofs == read_model(cube(tmp_path), quiet=True).n_dofs - 3


def test_equations_are_along_the_directions_of_their_nodes(tmp_path):
    """Node 5 turned by 30 degrees about z, then 20 about x, 10 about y; its x moves as the global x of node 6."""
    pytest.importorskip("mapdl_archive")
    row = "".join(f"{v:21.13E}" for v in CUBE[4]) + "\n"
    turned = row[:-1] + "".join(f"{angle:21.13E}" for angle in (30.0, 20.0, 10.0)) + "\n"
    model = read_model(cube(tmp_path, "CP,1,UX,5,6\n", old=row, new=turned), quiet=True)
    a, b, c = np.radians([30.0, 20.0, 10.0])
    about_z = np.array([[np.cos(a), np.sin(a), 0], [-np.sin(a), np.cos(a), 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, np.cos(b), np.sin(b)], [0, -np.sin(b), np.cos(b)]])
    about_y = np.array([[np.cos(c), 0, -np.sin(c)], [0, 1, 0], [np.sin(c), 0, np.cos(c)]])
    along = (about_y @ about_x @ about_z)[0]
    motion = model.directions(["n5x", "n5y", "n5z", "n6x"]).toarray()
    np.testing.assert_allclose(motion[:, :3] @ along, motion[:, 3], atol=1e-14)


@pytest.mark.parametrize("more", [" CE , 1 , 0 , 5 , UX , 1 , 6 , UX , -1\n", "F,5,FX,1 $ CE,1,0,5,UX,1,6,UX,-1\n"])
def test_commands_after_blanks_and_dollars_count(tmp_path, more):
    pytest.importorskip("mapdl_archive")
    assert read_model(cube(tmp_path, more), quiet=True).n_dofs == read_model(cube(tmp_path), quiet=True).n_dofs - 1


def test_all_directions_are_coupled(tmp_path):
    pytest.importorskip("mapdl_archive")
    model = read_model(cube(tmp_path, "CP,1,ALL,5,6\n"), quiet=True)
    assert model.dependent_dofs in (("n6x", "n6y", "n6z"), ("n5x", "n5y", "n5z"))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("CE,1,0,55,UX,1,6,UX,-1\n", r"line \d+: CE names node 55, which the file does not have"),
        ("CP,1,UX,5,55\n", r"line \d+: CP names node 55, which the file does not have"),
        ("CE,R5.0,DEFI,3,2,0.0\nCE,R5.0,NODE,5,UX,1.0,6,UX,-1.0\n", "CE announces 3 terms, 2 are there"),
        ("N,5,0,0,1,45,0,0\n", "N adds, moves or turns a node outside of the node blocks"),
        ("E,1,2,3,4,5,6,7,8\n", "E adds an element outside of the element blocks"),
    ],
)
def test_what_names_other_nodes_or_makes_some(tmp_path, more, said):
    pytest.importorskip("mapdl_archive")
    with pytest.raises(InputError, match=said):
        read_model(cube(tmp_path, more), quiet=True)
