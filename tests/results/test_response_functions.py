"""Universal files of responses per force: read again by our own reader, and by pyuff itself, with units and names."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from helpers.cases import oscillator as case
from helpers.command import slipstick
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.case.case import Case
from slipstick.results.measured_receptances import read_functions, read_receptances

pytest.importorskip("pyuff")
UNITS = {"length": "mm", "force": "N", "time": "s"}
SHORT = 6e-12
"""Relative error of a frequency in the 13 characters that the format has for it."""


def chain(dofs: tuple[str, ...] = ("tip", "n12x", "n7rz"), **given: object) -> ss.Problem:
    M, K = np.diag([1.0, 1.2, 0.8]), np.array([[60.0, -25, 0], [-25, 70, -30], [0, -30, 80]])
    structure = ss.MatrixStructure(M=M, C=0.02 * K, K=K, dofs=list(dofs))
    options = {"loads": ss.Load(dof=dofs[1], cos=3.0, sin=-4.0), "harmonics": [0, 1], "units": UNITS, "outputs": dofs}
    return ss.Problem(structure, **(options | given))


@pytest.mark.parametrize("ending", ["uff", "unv"])
def test_what_is_written_is_read_back(tmp_path: Path, ending: str) -> None:
    """Of a linear response the receptances in closed form."""
    problem = chain()
    branch = ss.linear_response(problem, omega=np.linspace(2.0, 11.0, 40))
    table = read_receptances(branch.save_table(tmp_path / f"a.{ending}"))
    omega = branch.dataset.omega.values
    np.testing.assert_allclose(table.omega, omega, rtol=SHORT)
    s = problem.structure
    exact = np.array([np.linalg.inv(s.K + 1j * w * s.C - w * w * s.M)[:, 1] for w in omega])
    names = [table.dofs[k] for k in table.rows]
    assert names == ["tip", "n12x", "n7rz"]
    assert {table.dofs[k] for k in table.columns} == {"n12x"}
    c, s_ = (branch.dataset.displacement.sel(coefficient=k).values for k in ("c1", "s1"))
    np.testing.assert_allclose(table.values, (c - 1j * s_) / (3.0 + 4.0j), rtol=1e-12)
    np.testing.assert_allclose(table.values, exact, rtol=1e-10)
    functions, _ = read_functions(tmp_path / f"a.{ending}")
    assert [function.unit for function in functions] == ["mm/N", "mm/N", "rad/N"]


def test_pyuff_reads_nodes_and_units(tmp_path: Path) -> None:
    import pyuff

    file = ss.linear_response(chain(), omega=[3.0, 4.0]).save_table(tmp_path / "a.uff")
    sets = pyuff.UFF(str(file)).read_sets()
    assert [(s["rsp_node"], s["rsp_dir"], s["ref_node"], s["ref_dir"]) for s in sets] == [
        (1, 0, 12, 1), (12, 1, 12, 1), (7, 6, 12, 1),
    ]  # fmt: skip
    first = sets[0]
    assert (first["func_type"], first["ordinate_spec_data_type"], first["orddenom_spec_data_type"]) == (4, 8, 13)
    assert first["ordinate_axis_units_lab"].strip() == "mm"
    assert first["orddenom_axis_units_lab"].strip() == "N"
    np.testing.assert_allclose(first["x"], np.array([3.0, 4.0]) / (2 * np.pi), rtol=SHORT)
    assert all(len(line) <= 80 for line in file.read_text(encoding="ascii").splitlines())


@pytest.mark.parametrize(
    ("branch", "says"),
    [
        (lambda: ss.linear_response(chain(loads=[ss.Load(dof=dof, sin=1.0) for dof in ("tip", "n12x")]), omega=[3.0]),
         "one force on one dof"),
        (lambda: ss.parameter_response(one_mass(damper()), "load.x.amplitude", (90.0, 100.0), omega=9.0),
         "a frequency response"),
        (lambda: ss.Branch(ss.linear_response(chain(), omega=[3.0]).dataset, ss.Outcome.COMPLETED),
         "the forces are not known"),
    ],
)  # fmt: skip
def test_what_has_no_response_functions(tmp_path: Path, branch, says: str) -> None:
    with raises_fault(says=says):
        branch().save_table(tmp_path / "a.uff")
    assert list(tmp_path.iterdir()) == []


def test_the_verb_writes_them(tmp_path: Path) -> None:
    """From a results file, with the force of its problem; not of tables that are no response."""
    branch = ss.forced_response(one_mass(damper()), omega=(8.0, 9.0))
    branch.save(tmp_path / "results.nc")
    assert slipstick("table", tmp_path / "results.nc", tmp_path / "a.uff").exit_code == 0
    assert (tmp_path / "a.uff").read_bytes() == branch.save_table(tmp_path / "b.uff").read_bytes()
    refused = slipstick("table", tmp_path / "results.nc", tmp_path / "a.uff", "--table", "peaks", "--force")
    assert refused.exit_code == 2
    assert "response functions alone" in refused.output
    with raises_fault("table", says="frequency response"):
        ss.runs.save_table(branch.sensitivity(["damper.mu"]), tmp_path / "c.uff")


def test_a_fit_to_what_was_written(tmp_path: Path) -> None:
    """Responses per force of a curve with friction give the parameters back, from the terminal too."""
    problem = one_mass(damper(), harmonics=range(6))
    steady = ss.steady_response(problem, omega=np.linspace(6.0, 12.0, 8))
    file = steady.save_table(tmp_path / "test.uff")
    fit = ss.identify(problem, file, {"damper.kt": 85.0, "damper.mu": 0.26})
    for name, value in fit.values.items():
        assert value == pytest.approx(problem.parameter(name), rel=1e-8)
    contact = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=300.0)
    other = chain(contacts=[ss.ContactPair(name="damper", contact=contact, tangential="tip")], harmonics=range(4))
    with raises_fault(says="there is no dof 'x'; the functions are x/x"):
        ss.identify(other, file, {"damper.kt": 1.0})
    text = case(head='harmonics = "0..5"\n', rubbing="velocity = 0.0", response="from = 8.0\nto = 12.0\n")
    (tmp_path / "case.toml").write_text(text + '[identify]\nparameters = { "damper.mu" = 0.2 }\n')
    read = Case.from_file(tmp_path / "case.toml").problem()
    ss.steady_response(read, omega=np.linspace(5.0, 12.0, 6)).save_table(tmp_path / "b.uff")
    result = slipstick("identify", tmp_path / "case.toml", tmp_path / "b.uff", "-o", tmp_path / "out", "--json")
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)["values"]["damper.mu"]
    assert found == pytest.approx(read.parameter("damper.mu"), rel=1e-8)
