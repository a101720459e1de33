"""Materials: constants of elasticity by closed forms, and one material for every element."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.materials import Material, element_values
from slipstick.fem.mesh import Mesh

STEEL = Material(young=2e11, poisson=0.3, density=7850.0, conductivity=40.0)


@pytest.mark.parametrize("poisson", [-0.9, 0.0, 0.25, 0.49])
def test_constants_fit_each_other(poisson):
    """Young's modulus and the bulk modulus out of Lame's parameters."""
    m = Material(young=3.0, poisson=poisson)
    mu, lam = m.shear_modulus, m.lame
    assert mu * (3 * lam + 2 * mu) / (lam + mu) == pytest.approx(3.0)
    assert lam + 2 * mu / 3 == pytest.approx(3.0 / (3 * (1 - 2 * poisson)))


def test_every_fault_at_once():
    with pytest.raises(InputError) as caught:
        Material(young=0.0, poisson=0.5, density=-1.0, conductivity=np.inf)
    assert len(caught.value.sentences) == 4


def halves(**sets):
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "hex8")
    rows = {name: {"hex8": np.array(members)} for name, members in sets.items()}
    return Mesh(nodes=mesh.nodes, blocks=mesh.blocks, element_sets=rows)


def density(mesh, materials):
    return element_values(mesh, materials, lambda m: m.density)["hex8"].tolist()


def test_one_material_or_one_for_each_set():
    light = Material(young=1.0, poisson=0.3, density=1.0)
    mesh = halves(a=[0], b=[1])
    assert density(mesh, STEEL) == density(mesh, {"all": STEEL}) == [7850.0, 7850.0]
    assert density(mesh, {"a": light, "b": STEEL}) == [1.0, 7850.0]


@pytest.mark.parametrize(
    ("sets", "names", "said"),
    [
        ({"a": [0], "b": [1]}, ["a"], "hex8 element 2 has no material"),
        ({"a": [0, 1], "b": [1]}, ["a", "b"], "hex8 element 2 has more than one material"),
        ({"a": [0], "b": [1]}, ["a", "c"], r"no element set \['c'\]; the mesh has: a, b"),
    ],
)
def test_elements_without_or_with_two(sets, names, said):
    with pytest.raises(InputError, match=said):
        density(halves(**sets), dict.fromkeys(names, STEEL))
