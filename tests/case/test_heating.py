"""Heat in case files: the thermal model they describe, and a sentence for each fault."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slipstick.case.case import Case
from slipstick.errors import InputError

HEAD = """
format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["x", "y"]
mass = [[1.0, 0.0], [0.0, 1.0]]
damping = [[0.4, 0.0], [0.0, 0.4]]
stiffness = [[40.0, 0.0], [0.0, 60.0]]
[[load]]
dof = "x"
sin = 100.0
[response]
from = 2.0
to = 15.0
"""
MU = "{ table = [[25, 0.5], [200, 0.45], [900, 0.3]] }"
THERMAL = "[contact.thermal]\nbackground = 25\nresistance = 8.0\n"


def contact(name: str, mu: str = MU, thermal: str = THERMAL, dof: str = "x", kt: str = "100.0") -> str:
    return (
        f'[[contact]]\nname = "{name}"\ntangential = "{dof}"\nkt = {kt}\nmu = {mu}\nnormal_load = 8.0\n'
        f"rubbing = {{ velocity = 10.0 }}\n{thermal}"
    )


def case(*parts: str, folder: Path = Path()) -> Case:
    return Case.from_text("\n".join([HEAD, *parts]), folder / "case.toml")


def faults(*parts: str, folder: Path = Path()) -> list[str]:
    with pytest.raises(InputError) as caught:
        case(*parts, folder=folder)
    return list(caught.value.sentences)


def test_a_table_and_a_resistance() -> None:
    problem = case(contact("a")).problem()
    assert problem.thermal is not None
    [heated] = problem.contact_states
    np.testing.assert_array_equal(heated.resistance, [8.0])
    np.testing.assert_array_equal(heated.background, [25.0])
    assert problem.contacts[0].values("mu") == 0.5
    assert heated.limits[1][0] == 900.0


def test_no_heat_no_model() -> None:
    assert case(contact("a", mu="0.3", thermal="")).problem().thermal is None


def test_tables_of_several_parameters_each_with_its_interpolation() -> None:
    kt = '{ table = [[0, 120.0], [500, 100.0], [1000, 90.0]], interpolation = "cubic" }'
    problem = case(contact("a", kt=kt)).problem()
    [heated] = problem.contact_states
    curve = heated.curves[0][0]
    assert curve.interpolation == {"mu": "pchip", "kt": "cubic"}
    assert problem.contacts[0].values("kt") == pytest.approx(float(curve.kt(25.0)))


def test_influence_matrix_in_the_file_and_own_resistance_of_the_rest() -> None:
    problem = case(
        '[thermal]\ninfluence = [[2.0, 0.5], [0.5, 3.0]]\ncontacts = ["c", "a"]\nbackground = 30',
        contact("a", thermal=""),
        contact("b", dof="y", thermal="[contact.thermal]\nbackground = 40\nresistance = 7.0\n"),
        contact("c", mu="0.3", thermal="", dof="y"),
    ).problem()
    [heated] = problem.contact_states
    expected = [[3.0, 0.0, 0.5], [0.0, 7.0, 0.0], [0.5, 0.0, 2.0]]
    np.testing.assert_array_equal(heated.resistance, expected)
    np.testing.assert_array_equal(heated.background, [30.0, 40.0, 30.0])


@pytest.mark.parametrize("name", ["influence", "thermal_influence", "R"])
def test_influence_matrix_from_a_file(tmp_path: Path, name: str) -> None:
    extra = {} if name == "R" else {"other": np.zeros(3)}
    np.savez(tmp_path / "heat.npz", **{name: np.array([[2.0, 0.5], [0.5, 3.0]])}, **extra)
    problem = case(
        '[thermal]\ninfluence = "heat.npz"\nbackground = 25', contact("a", thermal=""), contact("b", thermal=""),
        folder=tmp_path,
    ).problem()  # fmt: skip
    [heated] = problem.contact_states
    np.testing.assert_array_equal(heated.resistance, [[2.0, 0.5], [0.5, 3.0]])


def test_of_two_matrices_in_a_file_the_one_by_the_plain_name_counts(tmp_path: Path) -> None:
    first, second = np.array([[2.0, 0.5], [0.5, 3.0]]), np.eye(2)
    np.savez(tmp_path / "heat.npz", influence=first, thermal_influence=second)
    problem = case(
        '[thermal]\ninfluence = "heat.npz"\nbackground = 25', contact("a", thermal=""), contact("b", thermal=""),
        folder=tmp_path,
    ).problem()  # fmt: skip
    [heated] = problem.contact_states
    np.testing.assert_array_equal(heated.resistance, first)


BAD = {
    "table without heat": ([contact("a", thermal="")], "mu is a table over temperature, but the temperature"),
    "no resistance": (
        [contact("a", thermal="[contact.thermal]\nbackground = 25\n")],
        "[[contact]] 'a' thermal.resistance is missing",
    ),
    "no background": (
        [contact("a", thermal="[contact.thermal]\nresistance = 8.0\n")],
        "[[contact]] 'a' thermal.background is missing",
    ),
    "background outside": (
        [contact("a", thermal="[contact.thermal]\nresistance = 8.0\nbackground = 20\n")],
        "lies outside its table, 25 to 900",
    ),
    "negative resistance": ([contact("a", thermal=THERMAL.replace("8.0", "-8.0"))], "a number >= 0"),
    "misspelt": ([contact("a", thermal=THERMAL.replace("resistance", "resistence"))], "did you mean 'resistance'?"),
    "falling temperatures": ([contact("a", mu="{ table = [[25, 0.5], [20, 0.4]] }")], "temperature 20 follows 25"),
    "no table": ([contact("a", mu='{ interpolation = "natural" }')], "mu.table is missing; give rows of temperature"),
    "text in the table": ([contact("a", mu='{ table = [["a", "b"]] }')], "expected a table of finite numbers"),
    "wrong key of a table": (
        [contact("a", mu="{ tabel = [[25, 0.5], [200, 0.4]] }")],
        "unknown key 'tabel' in [[contact]] 'a' mu; did you mean 'table'?",
    ),
    "unknown interpolation": (
        [contact("a", mu='{ table = [[25, 0.5], [200, 0.4]], interpolation = "linear" }')],
        "found 'linear'; expected one of pchip, cubic, natural",
    ),
    "unknown contact": (
        ['[thermal]\ninfluence = [[1.0]]\ncontacts = ["b"]\nbackground = 25', contact("a")],
        "[thermal] contacts: there is no contact 'b'",
    ),
    "matrix of the wrong size": (
        ["[thermal]\ninfluence = [[1.0]]\nbackground = 25", contact("a", thermal=""), contact("b", thermal="")],
        "expected (2, 2), one row and one column for each contact",
    ),
    "twice": (
        ["[thermal]\ninfluence = [[1.0]]\nbackground = 25", contact("a")],
        "[thermal] influence holds this contact; keep one",
    ),
    "missing file": (
        ['[thermal]\ninfluence = "nothing.npz"\nbackground = 25', contact("a", thermal="")],
        "nothing.npz",
    ),
    "kn without normal": (
        [contact("a") .replace("normal_load", "kn = { table = [[25, 5.0], [900, 4.0]] }\nnormal_load")],
        "kn depends on temperature but the contact has no normal direction",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_fault_is_one_sentence(name: str, tmp_path: Path) -> None:
    parts, words = BAD[name]
    found = faults(*parts, folder=tmp_path)
    assert len(found) == 1, found
    assert words in found[0]
