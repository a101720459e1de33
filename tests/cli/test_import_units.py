"""Units of an import: scaling, conversion, and numbers that do not fit, by the command line and from Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.abaqus import skewed, write_input
from helpers.command import slipstick as command
from typer.testing import Result

import slipstick as ss
from slipstick.errors import InputError, SlipstickWarning
from slipstick.io.model_file import load_model


def slipstick(*arguments: object) -> Result:
    return command("import", *arguments)


@pytest.fixture
def millimetres(tmp_path: Path) -> Path:
    """A mesh of 40 mm with the material of steel in N, mm, tonne."""
    write_input(tmp_path / "beam.inp", skewed("hex20"), step="*FREQUENCY\n3")
    return tmp_path / "beam.inp"


@pytest.mark.parametrize(
    "options",
    [
        ("--to", "SI", "--units", "N, mm, t, s"),
        ("--scale", "length=1e-3"),
        ("--scale", "mass=1e3", "--scale", "length=1e-3"),
    ],
)
def test_a_model_comes_into_metres(millimetres: Path, options: tuple[str, ...]) -> None:
    out = millimetres.with_name("model.h5")
    result = slipstick(millimetres, "-o", out, *options)
    assert result.exit_code == 0, result.output
    old, new = ss.import_model(millimetres), load_model(out)
    np.testing.assert_allclose(new.coordinates, 1e-3 * old.coordinates)
    np.testing.assert_allclose(new.K.toarray(), 1e3 * old.K.toarray())
    np.testing.assert_allclose(new.M.toarray(), 1e3 * old.M.toarray())
    (steel,) = new.materials.values()
    assert (steel.young, steel.density) == pytest.approx((2.1e11, 7800.0))
    assert "multiplied: length 0.001, mass 1000" in result.stdout
    assert new.units == ("N, m, kg, s" if "--to" in options else new.units)
    assert not new.warnings


def test_a_material_given_holds_after_scaling(millimetres: Path) -> None:
    """A mesh in mm with a material in SI: what the file says of material is not taken."""
    given = ss.Material(young=1.1e11, poisson=0.3, density=4430.0)
    with pytest.warns(SlipstickWarning, match="is used for the whole mesh"):
        model = ss.import_model(millimetres, scale={"length": 1e-3}, material=given)
    (titanium,) = model.materials.values()
    assert (titanium.young, titanium.density) == pytest.approx((1.1e11, 4430.0))
    volume = 40e-3 * 10e-3 * 8e-3
    along = (model.dof_components == 0).astype(float)
    assert along @ (model.M @ along) == pytest.approx(4430.0 * volume, rel=0.2)  # the root is held


def test_a_model_file_is_converted_too(millimetres: Path) -> None:
    out = millimetres.with_name("model.h5")
    ss.import_model(millimetres, units="N, mm, t, s", output=out)
    model = ss.import_model(out, to="lbf, in")
    assert model.units == "lbf, in"
    (steel,) = model.materials.values()
    assert steel.young == pytest.approx(2.1e11 / 6894.757, rel=1e-6)
    with pytest.warns(
        SlipstickWarning, match="E = 2.1e.05 and density = 7.8e-09 would be .* in the units stated .SI., which"
    ):
        ss.import_model(millimetres, units="SI")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            {"to": "SI"},
            "to: the units of the files are not stated; give units = .*E and density look like N, mm, tonne",
        ),
        ({"to": "SI", "scale": {"length": 1.0}}, "to is given together with scale"),
        ({"to": "metric", "units": "SI"}, "to: found 'metric'; expected units such as"),
        ({"to": "SI", "units": "mine"}, "units: found 'mine'"),
        ({"scale": {"lenght": 1.0}}, "scale, lenght.*did you mean 'length'"),
        ({"scale": {"length": 0.0}}, "scale, length: found 0.0; expected a factor > 0"),
        ({"scale": {"mass": 2.0, "force": 3.0}}, "scale: mass, length and time make a force 2"),
    ],
)
def test_faults(millimetres: Path, options: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        ss.import_model(millimetres, **options)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--scale", "length"), "--scale length: expected a factor such as length=25.4e-3"),
        (("--scale", "width=2"), "scale, width: unknown key"),
        (("--scale", "length=-1"), "expected a factor > 0"),
        (("--to", "SI"), "the units of the files are not stated"),
    ],
)
def test_faults_of_the_command_line(millimetres: Path, options: tuple[str, ...], said: str) -> None:
    result = slipstick(millimetres, "-o", millimetres.with_name("model.h5"), *options)
    assert result.exit_code == 2
    assert said in result.stderr
    assert not millimetres.with_name("model.h5").exists()


def test_stated_units_of_the_result_are_not_asked_for_again(millimetres: Path) -> None:
    result = slipstick(millimetres, "-o", millimetres.with_name("model.h5"), "--to", "SI", "--units", "N, mm, t, s")
    assert "not stated" not in result.output


NAMES = ("mm", "N", "s")


def named(problem: ss.Problem) -> tuple[str, str, str]:
    return problem.units.length, problem.units.force, problem.units.time


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> ss.models.ReducedBody:
    """The beam in N, mm, t, s, kept at one dof."""
    path = tmp_path_factory.mktemp("units") / "beam.inp"
    write_input(path, skewed("hex20"), step="*FREQUENCY\n3")
    model = ss.import_model(path, units="N, mm, t, s")
    return ss.reduced_body(model, keep=model.dofs[-1], modes=4)


def test_units_of_an_import_reach_the_problem(body: ss.models.ReducedBody) -> None:
    assert named(ss.Problem(body.structure)) == NAMES
    assert named(ss.Problem(body.structure.changed(loss_factor=0.1))) == NAMES
    assert ss.Problem(body.structure).units.label("force/length") == "N/mm"
    same = ss.Problem(body.structure, units={"force": "N", "temperature": "degC"})
    assert (*named(same), same.units.temperature) == (*NAMES, "degC")


def test_other_units_beside_a_structure_that_knows_its_own_are_refused(body: ss.models.ReducedBody) -> None:
    with pytest.raises(InputError) as caught:
        ss.Problem(body.structure, units={"length": "m", "force": "kN", "time": "sec"})
    assert [fault.where for fault in caught.value.faults] == [("units", "length"), ("units", "force")]
    assert "units, length: found 'm'; expected 'mm', the unit of the numbers of the structure" in str(caught.value)


def test_units_not_stated_leave_the_problem_its_own(millimetres: Path) -> None:
    model = ss.import_model(millimetres)
    structure = ss.reduced_body(model, keep=model.dofs[-1], modes=4).structure
    assert structure.units is None
    assert named(ss.Problem(structure, units={"length": "m"})) == ("m", "force", "time")


def test_units_of_a_model_file_reach_the_case(millimetres: Path) -> None:
    ss.import_model(millimetres, units="N, mm, t, s", to="kN, mm, kg, ms", output=millimetres.with_name("model.h5"))
    dof = load_model(millimetres.with_name("model.h5")).dofs[-1]
    text = f"""
format = 1
harmonics = "0..1"
[structure]
kind = "fe"
file = "model.h5"
keep = ["{dof}"]
modes = 4
[[load]]
dof = "{dof}"
cos = 1.0
[[contact]]
name = "damper"
tangential = "{dof}"
kt = 1.0
mu = 0.3
normal_load = 1.0
[response]
from = 1.0
to = "2 Hz"
"""
    case = millimetres.with_name("case.toml")
    with pytest.raises(InputError) as caught:
        ss.Case.from_text(text, case)
    assert [fault.where for fault in caught.value.faults] == [("response", "to")]
    assert "rad/ms" in str(caught.value)
    read = ss.Case.from_text(text.replace('"2 Hz"', "2.0"), case)
    assert named(read.problem()) == ("mm", "kN", "ms")
    with pytest.raises(InputError, match=r"units\.length: found 'm'"):
        ss.Case.from_text(text.replace("harmonics", 'units = { length = "m" }\nharmonics', 1), case)


def test_units_of_a_sector_reach_its_waves() -> None:
    sector = ss.reduced_sector(ss.models.bladed_sector("coarse"), surface="tip", contacts=1, modes=2)
    assert named(ss.Problem(sector.travelling_wave(2))) == ("m", "N", "s")
