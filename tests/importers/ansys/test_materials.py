"""Materials of archives: what is not isotropic, constant and elastic is named."""

import pytest

from slipstick.errors import InputError
from slipstick.fem.materials import Material
from slipstick.importers.ansys.archive import read_materials
from slipstick.importers.findings import Findings
from slipstick.importers.import_model import read_model


def test_a_mesh_without_material_says_what_to_give(archives):
    with pytest.raises(InputError, match=r"sector\.cdb: is a mesh without material"):
        read_model(archives / "sector.cdb")


def read(text):
    return read_materials(Findings(source="a.cdb"), text)


@pytest.mark.parametrize(
    "text",
    [
        "MP,EX,1,2E11\nMP,NUXY,1,0.3\nMP,DENS,1,7800\nMP,KXX,1,40\n",
        "MPDATA,R5.0, 1,EX  ,       1, 1, 2.0E+11\nMPDATA,R5.0,1,PRXY,1,1,0.3\nmp,dens,1,7800.\nMP,KXX,1,4D1\n",
        "MPDATA,UNBL,1,EX,1,1,2E11,2E11\nMP,EY,1,2E11\nMP,PRXY,1,0.3\nMP,GXY,1,76923076923.\nMP,DENS,1,7800\nMP,KXX,1,40\n",
    ],
    ids=["MP", "MPDATA", "equal along the axes and at all temperatures"],
)
def test_an_isotropic_constant_material_however_it_is_written(text):
    assert read(text).materials == {1: Material(young=2e11, poisson=0.3, density=7800.0, conductivity=40.0)}
    assert read(text).faults == {1: []}


def test_materials_are_told_apart_by_their_number():
    found = read("MP,EX,1,1.\nMP,EX,2,2.\nMP,NUXY,2,0.25\nMP,DENS,2,3.\nMP,NUXY,1,0.\nMP,DENS,1,1.\n")
    assert {number: material.young for number, material in found.materials.items()} == {1: 1.0, 2: 2.0}


def test_a_material_that_cannot_be_keeps_its_sentence():
    found = read("MP,EX,3,-1.\nMP,NUXY,3,0.3\nMP,DENS,3,1.\n")
    assert found.materials == {}
    assert [fault.where for fault in found.faults[3]] == [("a.cdb", "material 3", "material", "young")]
    assert len(found.faults[3]) == 1
    with pytest.raises(InputError, match=r"a\.cdb, line 1: MP cannot be read"):
        read("MP,EX,one,1.\n")
