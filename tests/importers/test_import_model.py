"""A model from a foreign mesh by one call."""

import pytest
from helpers.plain import STEEL

from slipstick.errors import InputError
from slipstick.importers.import_model import import_model, read_model, summary
from slipstick.importers.roles import ImportOptions


def test_gmsh_to_a_model_with_options(gmsh, tmp_path):
    model = import_model(gmsh, output=tmp_path / "m.h5", material=STEEL, fixed=["tip"], quadratic=True, units="SI")
    notes = summary(model)
    assert set(model.mesh.blocks) == {"tet10"}
    assert model.units == "SI"
    assert notes[0].startswith("box.msh: ")
    assert notes[1].startswith("units: SI; the mass that moves along x is 1.")  # of 15600, less what is fixed
    assert notes[1].endswith("the largest dimension 2")
    assert {kind: len(part) for kind, part in model.mesh.element_sets["all"].items()} == {
        "tet10": model.mesh.n_elements
    }
    assert model.materials == {"all": STEEL}
    assert read_model(tmp_path / "m.h5").dofs == model.dofs
    with pytest.raises(InputError, match="node set 'root' is not in the mesh"):
        read_model(gmsh, ImportOptions(material=STEEL, fixed=["root"]))
    with pytest.raises(InputError, match="is a mesh without material"):
        read_model(gmsh)


def test_the_summary_tells_of_dofs_that_depend_on_others(tmp_path):
    from helpers.input_file import CUBE, HELD, write

    tied = summary(read_model(write(tmp_path, CUBE + HELD + "*EQUATION\n2\n2, 1, 1., 5, 1, -1.\n")))
    assert ", 1 that depend on others" in tied[0]
    assert "the mass that moves along x is" in tied[1]
    lever = summary(read_model(write(tmp_path, CUBE + HELD + "*EQUATION\n2\n2, 1, 1., 5, 1, -2.\n")))
    assert "its equations do not let it move along x as a whole" in lever[1]
