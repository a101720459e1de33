"""Case files: what they build, and every fault told at once in a sentence."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.cases import oscillator
from helpers.command import slipstick
from helpers.counting import traced
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.io import mmwrite

from slipstick.case.case import Case
from slipstick.errors import InputError

GOOD = "\n" + oscillator(
    head='title = "SDOF oscillator with a rubbing friction contact"\nharmonics = "0..10"\n',
    load="harmonic = 1\n",
    rubbing='velocity = 10.0, cos = { "1" = 2.0 }',
    response="from = 2.0\nto = 15.0\n",
)

TWO = """
format = 1
harmonics = [0, 1, 2, 3]
[structure]
kind = "matrices"
dofs = ["x", "z"]
mass = "M.npz"
stiffness = "K.mtx"
loss_factor = 0.01
[[load]]
dof = "x"
amplitude = 2.0
phase = "90 deg"
[[contact]]
name = "shoe"
tangential = { x = 0.8, z = -0.6 }
normal = "z"
kt = 10
kn = 5
mu = 0.3
gap = -1.0
[[contact]]
name = "heel"
tangential = "x"
normal = "z"
kt = 10
kn = 5
mu = 0.3
normal_load = 20.0
[response]
from = "0.5 Hz"
to = "60 rpm"
at = ["0.75 Hz", 5.0]
max_points = 50
[output]
dofs = ["z"]
"""


def faults(text: str, path: Path | str = "case.toml") -> list[str]:
    with pytest.raises(InputError) as error:
        Case.from_text(text, path)
    for sentence in error.value.sentences:
        assert "\n" not in sentence
        assert len(sentence) < 400
    return list(error.value.sentences)


def test_the_contract_case() -> None:
    case = Case.from_text(GOOD)
    problem = case.problem()
    assert case.title == "SDOF oscillator with a rubbing friction contact"
    assert case.span == (2.0, 15.0)
    assert problem.harmonics.orders == tuple(range(11))
    assert problem.structure.dofs == ("x",)
    (load,), (pair,) = problem.loads, problem.contacts
    assert (load.dof, load.harmonic, load.cos, load.sin) == ("x", 1, 0.0, 100.0)
    assert pair.name == "damper"
    assert dict(pair.tangential) == {"x": 1.0}
    assert pair.normal is None
    assert float(pair.contact.normal_load) == 800.0
    assert pair.rubbing.velocity == 10.0
    assert dict(pair.rubbing.cos) == {1: 2.0}
    assert case.text == GOOD


def test_motion_of_the_counter_surface_along_the_normal() -> None:
    rub = 'cos = { "1" = 2.0 }, normal_cos = { "2" = 3.7e-4 }, normal_sin = { "1" = 1e-4 }'
    unfit = replaced(('cos = { "1" = 2.0 }', rub))
    assert faults(unfit) == [
        "[[contact]] 'damper' kn is missing; give the normal contact stiffness, needed with normal, gap, normal_cos, "
        "normal_sin and profile"
    ]
    lobed = unfit.replace("normal_load = 800.0", "normal_load = 800.0\nkn = 50.0")
    (pair,) = Case.from_text(lobed).problem().contacts
    assert dict(pair.rubbing.normal_cos) == {2: 3.7e-4}
    assert dict(pair.rubbing.normal_sin) == {1: 1e-4}
    swept = lobed.replace("from = 2.0", 'parameter = "damper.normal_cos2"\nomega = 4.0\nfrom = 0.0')
    case = Case.from_text(swept)
    assert case.problem().parameter(str(case.parameter)) == 3.7e-4
    wrong = faults(lobed.replace('{ "2" = 3.7e-4 }', '{ "two" = 3.7e-4 }'))
    assert wrong == [
        "[[contact]] 'damper' rubbing.normal_cos: found { two = 0.00037 }; expected a table of harmonic = amplitude "
        'such as { "1" = 2.0 }, amplitudes finite lengths'
    ]


def test_files_units_normal_loads_and_phases(tmp_path: Path) -> None:
    np.savez(tmp_path / "M.npz", M=np.eye(2))
    mmwrite(tmp_path / "K.mtx", sparse.coo_array(np.array([[40.0, -5.0], [-5.0, 120.0]])), symmetry="symmetric")
    case = Case.from_text(TWO, tmp_path / "two.toml")
    problem = case.problem()
    assert case.title == "two"
    assert case.span == pytest.approx((math.pi, 2 * math.pi))
    assert case.requested == pytest.approx((1.5 * math.pi, 5.0))
    assert case.options().max_points == 50
    expected = np.sqrt(np.linalg.eigvalsh([[40.0, -5.0], [-5.0, 120.0]]))
    np.testing.assert_allclose(problem.structure.natural_frequencies, expected, rtol=1e-12)
    (load,) = problem.loads
    assert (load.cos, load.sin) == pytest.approx((0.0, -2.0), abs=1e-15)  # 2 cos(tau + 90 deg) = -2 sin tau
    shoe, heel = problem.contacts
    assert dict(shoe.tangential) == {"x": 0.8, "z": -0.6}
    assert (shoe.contact.gap, heel.contact.gap) == (-1.0, -4.0)  # gap = -normal_load / kn
    assert list(problem.outputs) == ["z"]


def test_a_modal_structure_with_default_names(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    shapes = rng.normal(size=(6, 4))
    omega = np.array([10.0, 20.0, 35.0, 60.0])
    compliance = (shapes / omega**2) @ shapes.T + 1e-4 * np.eye(6)
    np.savez(
        tmp_path / "m.npz",
        omega=omega,
        mode_shapes=shapes,
        static_compliance=compliance,
        load_participation=np.ones(4),
        static_load_response=np.full(6, 0.01),
    )
    text = GOOD.split("[structure]")[0] + (
        '[structure]\nkind = "modal"\nfile = "m.npz"\nmodes = 2\nforce = true\nloss_factor = 0.01\n'
        '[[load]]\nshape = "pressure"\ncos = 1\n'
        '[[contact]]\nname = "tip"\ntangential = "n2y"\nkt = 10\nmu = 0.3\nnormal_load = 1\n'
        "[response]\nfrom = 5\nto = 15\n"
    )
    problem = Case.from_text(text, tmp_path / "case.toml").problem()
    assert problem.structure.dofs == ("n1x", "n1y", "n1z", "n2x", "n2y", "n2z")
    assert problem.structure.load_shapes == ("pressure",)
    assert list(problem.structure.natural_frequencies) == [10.0, 20.0]
    static = problem.structure.project(np.eye(6), np.eye(6)).static
    np.testing.assert_allclose(static, compliance, rtol=1e-10)


def replaced(*pairs: tuple[str, str]) -> str:
    text = GOOD
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return text


BAD = {
    "misspelt key": (("stiffness", "stifness"), "unknown key 'stifness' in [structure]; did you mean 'stiffness'?"),
    "misspelt contact key": (("kt =", "kkt ="), "unknown key 'kkt' in [[contact]] 'damper'; did you mean 'kt'?"),
    "misspelt nested key": (
        ("velocity", "velocty"),
        "unknown key 'velocty' in [[contact]] 'damper' rubbing; did you mean 'velocity'?",
    ),
    "misspelt section": (
        ("[response]", "[respons]"),
        "unknown key 'respons' in the case file; did you mean 'response'?",
    ),
    "misspelt top key": (
        ("harmonics", "harmonic"),
        "unknown key 'harmonic' in the case file; did you mean 'harmonics'?",
    ),
    "text for a number": (
        ("kt = 100.0", 'kt = "100"'),
        "[[contact]] 'damper' kt: found \"100\"; expected a number >= 0",
    ),
    "bool for a number": (("mu = 0.3", "mu = true"), "[[contact]] 'damper' mu: found true; expected a number"),
    "number for a text": (('"damper"', "3"), "[[contact]] number 1 name: found 3; expected a name"),
    "negative kt": (("kt = 100.0", "kt = -1"), "[[contact]] 'damper' kt: found -1; expected a number >= 0"),
    "negative mu": (("mu = 0.3", "mu = -0.3"), "[[contact]] 'damper' mu: found -0.3; expected a number >= 0"),
    "inf": (("800.0", "inf"), "[[contact]] 'damper' normal_load: found inf; expected a number >= 0"),
    "nan": (("sin = 100.0", "sin = nan"), "[[load]] number 1 sin: found nan; expected a finite number"),
    "nan in a matrix": (("[[40.0]]", "[[nan]]"), "[structure] stiffness: found [[nan]]; row 1, column 1 is nan"),
    "inf velocity": (("= 10.0", "= inf"), "[[contact]] 'damper' rubbing.velocity: found inf; expected a finite"),
    "matrix not square": (("[[40.0]]", "[[40.0, 1.0]]"), "row 1 has 2 entries but there are 1 rows; expected a square"),
    "matrix of wrong size": (
        ("[[1.0]]", "[[1.0, 0.0], [0.0, 1.0]]"),
        "[structure] mass: found 2 x 2; expected 1 x 1 as the stiffness",
    ),
    "too many dofs": (('dofs = ["x"]', 'dofs = ["x", "y"]'), "[structure] dofs: found 2 names; expected 1"),
    "not positive definite": (("[[40.0]]", "[[-40.0]]"), "[structure] stiffness: the stiffness matrix is not positive"),
    "no mass": (("[[1.0]]", "[[0.0]]"), "[structure] mass: the mass matrix is not positive definite"),
    "unknown dof of a load": (
        ('dof = "x"', 'dof = "xx"'),
        "[[load]] number 1 dof: there is no dof 'xx' in the structure",
    ),
    "unknown dof of a contact": (
        ('tangential = "x"', 'tangential = "X1"'),
        "[[contact]] 'damper' tangential: there is no dof 'X1' in the structure; did you mean 'x'?",
    ),
    "unknown kind": (
        ('"matrices"', '"beam"'),
        '[structure] kind: found "beam"; this version knows "matrices", "modal"',
    ),
    "empty range": (
        ("to = 15.0", "to = 2.0"),
        "[response] to is 2 rad/s, the same as from; give a range that is not empty",
    ),
    "no end": (("to = 15.0", ""), "[response] to is missing; give"),
    "negative frequency": (("from = 2.0", "from = -2.0"), "[response] from: found -2.0; expected a frequency > 0"),
    "unknown unit": (("from = 2.0", 'from = "2 herz"'), '[response] from: found "2 herz"; expected a number in rad/s'),
    "at outside": (
        ("to = 15.0", "to = 15.0\nat = [20.0]"),
        "[response] at, number 1: 20 rad/s lies outside the range 2 to 15 rad/s",
    ),
    "huge harmonics": (("0..10", "0..100000000"), "harmonic 100000000 is above the largest allowed"),
    "harmonics without 0": (("0..10", "1..10"), "expected increasing whole numbers starting at 0"),
    "load on a harmonic not kept": (("harmonic = 1", "harmonic = 12"), "harmonic 12"),
    "rub on a harmonic not kept": (('"1" = 2.0', '"11" = 2.0'), "harmonic 11"),
    "new format": (("format = 1", "format = 2"), "format: found 2; expected format = 1"),
    "single brackets": (("[[load]]", "[load]"), "[[load]]: found a table; expected tables that begin"),
    "no normal load": (
        ("normal_load = 800.0", ""),
        "[[contact]] 'damper': the normal load is missing; give normal_load",
    ),
    "two normal loads": (
        ("normal_load = 800.0", "normal_load = 1\ngap = -1"),
        "gap is given together with normal_load; keep one",
    ),
    "normal without kn": (("normal_load = 800.0", 'normal = "x"\ngap = -1'), "kn is missing; give the normal contact"),
    "no force": (("sin = 100.0", ""), "no force is given; give cos, sin, or amplitude with phase"),
    "dof and shape": (('dof = "x"', 'dof = "x"\nshape = "p"'), "shape is given together with dof; keep one of them"),
    "unknown shape": (('dof = "x"\nh', 'shape = "p"\nh'), "there is no load shape 'p'; there are none"),
    "leaving the folder": (("[[40.0]]", '"../K.npz"'), '[structure] stiffness: found "../K.npz"; the path leaves'),
    "absolute path": (("[[40.0]]", '"/etc/passwd"'), "the path leaves the folder of the case"),
    "missing file": (("[[40.0]]", '"K.npz"'), '[structure] stiffness: found "K.npz"; there is no such file'),
    "table for mu": (
        ("mu = 0.3", "mu = { table = [[25, 0.5]] }"),
        "mu: the table has the shape (1, 2); expected at least two rows",
    ),
    "not TOML": (("to = 15.0", "to == 15.0"), "case.toml: not valid TOML: Invalid value (at line 24, column 5)"),
    "unknown parameter": (
        ("to = 15.0", 'to = 15.0\nparameter = "damper.speed"\nomega = 3.0'),
        "[response] parameter: there is no parameter 'damper.speed'",
    ),
    "parameter without omega": (("to = 15.0", 'to = 15.0\nparameter = "damper.mu"'), "omega is missing"),
    "unit for a parameter": (
        ("from = 2.0", 'from = "2 Hz"\nparameter = "damper.mu"\nomega = 3.0'),
        '[response] from: found "2 Hz"; expected a finite number',
    ),
    "unknown peak": (("to = 15.0", 'to = 15.0\npeaks_of = "y"'), "[response] peaks_of: there is no dof 'y'"),
    "unknown output": (("[response]", '[output]\ndofs = ["y"]\n[response]'), "[output] dofs: there is no dof 'y'"),
    "period ratio": (("format = 1", 'format = 1\nperiod_ratio = "3:2"'), "expected two whole numbers from 1 to 1000"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_fault_is_one_sentence(name: str, tmp_path: Path) -> None:
    change, words = BAD[name]
    found = faults(replaced(change), tmp_path / "case.toml")
    assert len(found) == 1, found
    assert words in " ".join(found)


def test_not_symmetric(tmp_path: Path) -> None:
    np.savez(tmp_path / "M.npz", M=np.eye(2))
    np.savez(tmp_path / "K.npz", K=np.array([[40.0, -5.0], [0.0, 120.0]]))
    (found,) = faults(TWO.replace("K.mtx", "K.npz"), tmp_path / "two.toml")
    assert found.startswith("[structure] stiffness: not symmetric")


def test_equal_names_of_contacts(tmp_path: Path) -> None:
    np.savez(tmp_path / "M.npz", M=np.eye(2))
    np.savez(tmp_path / "K.npz", K=np.diag([40.0, 120.0]))
    text = TWO.replace("K.mtx", "K.npz").replace('"heel"', '"shoe"')
    (found,) = faults(text, tmp_path / "two.toml")
    assert "[[contact]] number 1: the name 'shoe' is used 2 times" in found


def test_all_faults_of_all_sections_at_once() -> None:
    text = replaced(
        ("kt = 100.0", "kt = -1"),
        ("mu = 0.3", "mu = nan"),
        ("normal_load = 800.0", ""),
        ("[[40.0]]", "[[-40.0]]"),
        ('dof = "x"', 'dof = "y"'),
        ("to = 15.0", "to = 2.0"),
        ("0..10", "0..3000"),
        ("sin = 100.0", "sine = 100.0"),
        ("format = 1", "format = 1\nspeed = 3"),
    )
    found = faults(text)
    for words in ("kt", "mu", "normal load", "stiffness", "dof 'y'", "not empty", "more than 500", "sine", "speed"):
        assert any(words in sentence for sentence in found), words
    assert len(found) == 9  # the misspelt sine is not also missing


@pytest.mark.parametrize("text", ["", "format = 1", "structure = 3\ncontact = 1\nload = [1]\nresponse = 0", "[output]"])
def test_little_is_told_completely(text: str) -> None:
    assert len(faults(text)) >= 3


def test_files_that_are_no_cases(tmp_path: Path) -> None:
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00\x01" * 50)
    (tmp_path / "nul.toml").write_bytes(b"format = 1\n\0")
    (tmp_path / "deep.toml").write_text("a = " + "[" * 100_000)
    for name, words in {
        "binary.toml": "not a text file",
        "nul.toml": "not valid TOML",
        "deep.toml": "nested more than 50 deep",
        "none.toml": "there is no such file",
        ".": "found a folder",
    }.items():
        with pytest.raises(InputError, match=words):
            Case.from_file(tmp_path / name)


def test_a_huge_file_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "big.toml").open("wb") as stream:
        stream.truncate(40 * 1024**2)
    with pytest.raises(InputError, match="larger than 6 MB"):
        Case.from_file(tmp_path / "big.toml")


def test_too_many_unknowns_are_refused_before_anything_is_made_of_them() -> None:
    head, rest = GOOD.split("[[contact]]")
    contact, response = rest.split("[response]")
    many = "".join("[[contact]]" + contact.replace('"damper"', f'"c{i}"') for i in range(700))
    with traced() as memory:
        (found,) = faults(head + many + "[response]" + response)
    assert "14700 unknowns" in found
    assert memory.peak < 100e6  # their matrix alone has 14700^2 numbers of 8 bytes, 1.7e9


values = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=8), st.lists(st.integers(), max_size=3)
)


def toml(value: object) -> str:
    if value is None:
        return "{}"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return '"' + "".join(c if c.isalnum() else "_" for c in value) + '"'
    return str(value)


@settings(max_examples=80, deadline=None)
@given(st.sampled_from([line for line in GOOD.splitlines() if " = " in line]), values)
def test_any_value_anywhere_is_taken_or_told(line: str, value: object) -> None:
    key = line.split(" = ")[0]
    try:
        Case.from_text(GOOD.replace(line, f"{key} = {toml(value)}", 1))
    except InputError as error:
        assert error.sentences  # noqa: PT017


def test_a_byte_order_mark_is_read_over(tmp_path):
    """Editors on Windows write one."""
    path = tmp_path / "case.toml"
    example = Path(__file__).parents[2] / "examples/oscillator/oscillator.toml"
    path.write_bytes(b"\xef\xbb\xbf" + example.read_bytes())
    assert Case.from_file(path).problem().title.startswith("SDOF")


def test_a_run_projects_the_structure_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """For its warnings, its recorder and the linear limits in the report together, and for the curve; damping is looked
    at through one port by both.
    """
    from slipstick.structure.matrices import MatrixStructure

    counted: list[int] = []
    project = MatrixStructure.project

    def counting(self: MatrixStructure, rows: Any, columns: Any, shapes: Any = ()) -> Any:
        counted.append(np.shape(columns)[1])
        return project(self, rows, columns, shapes)

    monkeypatch.setattr(MatrixStructure, "project", counting)
    (tmp_path / "case.toml").write_text(GOOD)
    done = slipstick("run", tmp_path / "case.toml", "-o", tmp_path / "out", "--no-figures")
    assert done.exit_code == 0, done.output
    assert sorted(counted) == [1, 1, 2, 2]  # a contact and a loaded dof are two columns


def test_faults_of_a_study_are_told_with_the_others() -> None:
    study = '\n[study]\n"damper.mu" = []\nmethod = "sobel"\n'
    assert faults(GOOD.replace("kt = 100.0", 'kt = "stiff"') + study) == [
        "[[contact]] 'damper' kt: found \"stiff\"; expected a number >= 0, or { table = [[temperature, value], ...] }",
        "[study] method: found 'sobel'; did you mean 'sobol'?",
        "[study] damper.mu: found an empty list; expected at least one value",
    ]


def test_peaks_are_not_held_against_outputs_that_are_wrong() -> None:
    wrong = GOOD.replace("to = 15.0", 'to = 15.0\npeaks_of = ["x"]') + '\n[output]\ndofs = ["q"]\n'
    assert faults(wrong) == ["[output] dofs: there is no dof 'q' in the structure; there are x"]
