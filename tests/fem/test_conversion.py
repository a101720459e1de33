"""Models in other units: what is measured stays, and an assembly in the new units gives the same numbers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_array

from slipstick.fem.box import box
from slipstick.fem.equations import NodalEquation
from slipstick.fem.materials import Material
from slipstick.fem.model import ImportedModel
from slipstick.fem.unit_systems import Conversion
from slipstick.importers.import_model import converted
from slipstick.importers.mesh_model import MeshModel, assemble_mesh

INCH = Conversion(length=0.0254, force=4.4482216152605)
PSI = Material(young=3e7, poisson=0.3, density=7.3e-4, conductivity=6.0)


def block(size: float, material: Material) -> ImportedModel:
    mesh = box((3.0 * size, 1.0 * size, 0.5 * size), (2, 1, 1), "hex8")
    return assemble_mesh(MeshModel(mesh=mesh), source="block", material=material, fixed=["x0"])


@pytest.mark.parametrize("factors", [INCH, Conversion(length=1e-3), Conversion(length=2.0, force=3.0, time=1e-3)])
def test_a_scaled_model_is_the_one_assembled_in_the_new_units(factors):
    old, new = block(1.0, PSI), block(factors.length, factors.material(PSI))
    found = converted(old, factors)
    for name in "KM":
        exact = getattr(new, name).toarray()
        np.testing.assert_allclose(getattr(found, name).toarray(), exact, atol=1e-12 * np.abs(exact).max())
    np.testing.assert_allclose(found.coordinates, new.coordinates)
    np.testing.assert_allclose(found.mesh.nodes, new.mesh.nodes)
    assert found.materials["all"].density == pytest.approx(new.materials["all"].density)
    values = [eigh(m.K.toarray(), m.M.toarray(), eigvals_only=True) for m in (old, found)]
    np.testing.assert_allclose(values[1] * factors.time**2, values[0], rtol=1e-8)


def test_there_and_back_is_where_one_was():
    back = INCH.inverse.material(INCH.material(PSI))
    assert vars(back) | {"tables": None} == pytest.approx(vars(PSI) | {"tables": None})
    assert back.tables == {}


def test_tables_over_temperature_are_converted_and_temperatures_stay():
    hot = PSI.but(young=[(20.0, 3e7), (600.0, 2e7)], expansion=[(20.0, 1e-5), (600.0, 2e-5)], reference=30.0)
    found, size = INCH.material(hot), INCH.force / INCH.length**2
    assert [value / size for _, value in found.tables["young"]] == pytest.approx([3e7, 2e7])
    assert [at for at, _ in found.tables["young"]] == [20.0, 600.0]
    assert found.tables["expansion"] == hot.tables["expansion"]
    assert (found.expansion, found.reference) == (hot.expansion, 30.0)
    assert found.young == pytest.approx(hot.young * size)


def test_rotations_have_no_length():
    """A beam end: force and moment by displacement and rotation, and a dof that hangs on a rotation by an arm."""
    K = np.array([[12.0, -6.0], [-6.0, 4.0]])
    model = ImportedModel(
        K=csr_array(K), M=csr_array(np.diag([2.0, 0.1])), C=csr_array(0.5 * K),
        dof_nodes=np.array([1, 1]), dof_components=np.array([2, 4]), speed=10.0,
    )  # fmt: skip
    model = model.constrain([NodalEquation(terms=((7, 2, -1.0), (1, 2, 1.0), (1, 4, -3.0)))])
    found = converted(model, Conversion(length=10.0, force=7.0, time=2.0))
    np.testing.assert_allclose(found.K.toarray(), [[12.0 * 0.7, -6.0 * 7.0], [-6.0 * 7.0, 4.0 * 70.0]])
    np.testing.assert_allclose(found.M.toarray(), np.diag([2.0 * 2.8, 0.1 * 280.0]))
    np.testing.assert_allclose(found.C.toarray(), found.K.toarray())
    np.testing.assert_allclose(found.dependence.toarray(), [[1.0, -30.0]])
    assert found.speed == 5.0
    assert converted(replace(model, C=None), INCH).C is None
