"""Which file is what, and that every file and option has an effect or is refused."""

from pathlib import Path

import pytest

from slipstick.errors import InputError
from slipstick.fem.materials import Material
from slipstick.importers.roles import ImportOptions, refuse_unused, roles_of

STEEL = Material(young=2e11, poisson=0.3, density=7800.0)


def roles(*names, **options):
    return roles_of([Path(name) for name in names], ImportOptions(**options))


@pytest.mark.parametrize("order", [1, -1])
def test_roles_do_not_depend_on_the_order(order):
    found = roles(*["job_STIF1.mtx", "job_MASS1.mtx", "job_damping.mtx", "rows.dof", "mesh.inp"][::order])
    assert {role: path.name for role, path in found.matrices.items()} == {
        "K": "job_STIF1.mtx",
        "M": "job_MASS1.mtx",
        "C": "job_damping.mtx",
    }
    assert (found.dof_map, found.nodes) == (Path("rows.dof"), Path("mesh.inp"))


def test_an_option_outweighs_the_name():
    found = roles("a_stiffness.mtx", "b.mtx", mass=Path("b.mtx"), damping=Path("d.npz"))
    assert {role: path.name for role, path in found.matrices.items()} == {
        "K": "a_stiffness.mtx",
        "M": "b.mtx",
        "C": "d.npz",
    }
    with pytest.raises(InputError, match="say which is the mass"):
        roles("a.mtx", "b.mtx")


def test_a_mesh_alone_is_the_model_not_its_positions():
    assert roles("mesh.inp").nodes is None
    assert roles("mesh.inp").matrices == {}


@pytest.mark.parametrize(
    ("names", "options", "said"),
    [
        (("a.mtx", "m.mtx", "notes.pdf"), {}, "notes.pdf: what it is for does not show"),
        (("a.mtx", "m.mtx"), {"quadratic": True}, "quadratic: the matrices have elements already"),
        (("a.mtx", "m.mtx"), {"material": STEEL}, "material: matrices hold their material already"),
        (("model.h5",), {"quadratic": True}, "model.h5: holds matrices"),
        (("mesh.inp", "rows.dof"), {}, "rows.dof: what it is for does not show"),
        (("mesh.inp",), {"names": {"K": "KGG"}}, "names has no effect on mesh.inp"),
        (("mesh.inp",), {"constraints": 3}, "constraints has no effect on mesh.inp"),
        (("mesh.bdf",), {"constraints": 3}, None),
    ],
)
def test_nothing_is_without_effect(names, options, said):
    paths, given = [Path(name) for name in names], ImportOptions(**options)
    found = roles_of(paths, given)
    if said is None:
        return refuse_unused(paths, found, given)
    with pytest.raises(InputError, match=said):
        refuse_unused(paths, found, given)
    return None
