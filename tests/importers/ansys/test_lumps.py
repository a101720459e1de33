"""MASS21 and COMBIN14 of archives: what they add to the matrices, by hand."""

import numpy as np
import pytest
from helpers.ansys import CUBE, archive_text

from slipstick.errors import InputError
from slipstick.importers.import_model import read_model

pytest.importorskip("mapdl_archive")


def with_element(folder, kind, nodes, reals, options="", more=""):
    """The cube with one more element of a type, its real constants in an RLBLOCK."""
    text = archive_text([list(range(1, 9)), nodes], 185, CUBE) + "D,4,ALL,0.\n" + more
    lines = text.replace("ET,1,185", f"ET,1,185\nET,2,{kind}\n{options}").splitlines()
    second = next(i for i, line in enumerate(lines) if line[:9] == f"{1:9d}" and line[90:99] == f"{2:9d}")
    lines[second] = f"{1:9d}{2:9d}{7:9d}" + lines[second][27:]
    words = [f"{value:16.9g}" for value in reals]
    block = [f"{7:8d}{len(reals):8d}" + "".join(words[:6])]
    if words[6:]:
        block.append("".join(words[6:]))
    block = ["RLBLOCK,       1,       7,       6,       7", "(2i8,6g16.9)", "(7g16.9)", *block]
    at = lines.index(next(line for line in lines if line.startswith("MP,EX")))
    path = folder / "m.cdb"
    path.write_text("\n".join([*lines[:at], *block, *lines[at:]]) + "\n")
    return read_model(path, quiet=True)


def plain(folder):
    path = folder / "p.cdb"
    path.write_text(archive_text([list(range(1, 9))], 185, CUBE) + "D,4,ALL,0.\n")
    return read_model(path, quiet=True)


def added(model, base, name, dofs):
    at, old = ([m.index(dof) for dof in dofs] for m in (model, base))
    return (getattr(model, name).toarray()[np.ix_(at, at)]) - getattr(base, name).toarray()[np.ix_(old, old)]


DOFS = ("n5x", "n5y", "n5z", "n7x", "n7y", "n7z")


def test_a_point_mass(tmp_path):
    model = with_element(tmp_path, 21, [5], [2.5], "KEYOP,       2,  3,       2\n")
    np.testing.assert_allclose(added(model, plain(tmp_path), "M", DOFS), np.diag([2.5] * 3 + [0.0] * 3), atol=1e-12)
    assert not any("MASS21" in note for note in model.notes)


def test_a_mass_with_inertia_of_its_own_is_a_mechanism_on_a_solid(tmp_path):
    """Its rotations have mass and no stiffness, unless something holds or couples them."""
    reals = [2.5, 2.5, 2.5, 0.1, 0.2, 0.3]
    with pytest.raises(InputError, match=r"3 dofs have mass but no stiffness \(a mechanism\): n5rx, n5ry, n5rz"):
        with_element(tmp_path, 21, [5], reals)
    held = with_element(tmp_path, 21, [5], reals, more="D,5,ROTX,0.\nD,5,ROTY,0.\nD,5,ROTZ,0.\n")
    np.testing.assert_allclose(added(held, plain(tmp_path), "M", DOFS[:3]), 2.5 * np.eye(3), atol=1e-12)


@pytest.mark.parametrize("axis", [0, 2])
def test_springs(tmp_path, axis):
    options = f"KEYOP,       2,  2,       {axis}\n" if axis else ""
    model = with_element(tmp_path, 14, [5, 7], [1e6, 0.0], options)
    along = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0) if axis == 0 else np.array([0.0, 1.0, 0.0])
    pair = np.concatenate([along, -along])
    np.testing.assert_allclose(added(model, plain(tmp_path), "K", DOFS), 1e6 * np.outer(pair, pair), atol=1e-6)
    damped = with_element(tmp_path, 14, [5, 7], [1e6, 3.0], options)
    assert any("COMBIN14 element 2: damping is not read" in warning for warning in damped.warnings)


@pytest.mark.parametrize(
    ("kind", "nodes", "options"),
    [
        (14, [5, 7], "KEYOP,       2,  3,       1\n"),
        (14, [5, 7], "KEYOP,       2,  1,       1\n"),
        (21, [5], "KEYOP,       2,  3,       4\n"),
        (21, [5], "KEYOP,       2,  1,       1\n"),
    ],
)
def test_options_that_are_not_read_are_refused(tmp_path, kind, nodes, options):
    with pytest.raises(InputError, match=r"m\.cdb: (COMBIN14|MASS21) element 2 .* not read"):
        with_element(tmp_path, kind, nodes, [1.0], options)


def test_elements_without_real_constants(tmp_path):
    text = archive_text([list(range(1, 9)), [5]], 185, CUBE).replace("ET,1,185", "ET,1,185\nET,2,21")
    lines = text.splitlines()
    second = next(i for i, line in enumerate(lines) if line[:9] == f"{1:9d}" and line[90:99] == f"{2:9d}")
    lines[second] = f"{1:9d}{2:9d}{7:9d}" + lines[second][27:]
    (tmp_path / "m.cdb").write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError, match=r"MASS21 element 2 needs real constants 7"):
        read_model(tmp_path / "m.cdb")
    (tmp_path / "m.cdb").write_text(
        "\n".join([*lines, "R,7,3.5", "D,4,ALL,0."]).replace("ET,2,21", "ET,2,21\nKEYOP,2,3,2") + "\n"
    )
    model = read_model(tmp_path / "m.cdb", quiet=True)
    assert added(model, plain(tmp_path), "M", ("n5x",)) == pytest.approx(3.5)
