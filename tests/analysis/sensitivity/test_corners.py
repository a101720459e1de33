"""Parameters at a corner: what changes on one side as on no other has no derivative, and that is said."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.analysis.sensitivity.tolerances import amplitude_band
from slipstick.typing import Array

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

NORMAL = {"kt": 100.0, "mu": 0.3, "kn": 50.0}


def numbers(problem: ss.Problem, omega: float) -> Array:
    data = ss.steady_response(problem, omega=omega).dataset
    return np.array([data.amplitude[0, 0], data["mean"][0, 0], data.dissipated_power[0].sum()])


def one_sided(problem: ss.Problem, name: str, omega: float, step: float) -> tuple[Array, Array]:
    """Differences of amplitude, mean and power where the parameter grows and where it falls."""
    value, here = problem.parameter(name), numbers(problem, omega)
    up, down = (numbers(problem.with_parameter(name, value + sign * step), omega) for sign in (1.0, -1.0))
    return (up - here) / step, (here - down) / step


@pytest.mark.parametrize("omega", [10.0, 11.0])
@pytest.mark.parametrize(("contact", "name"), [
    (damper(0.0), "damper.velocity"), (damper(0.0, cos={2: 0.0}), "damper.cos2"),
])  # fmt: skip
def test_an_amplitude_that_is_a_tie_of_extremes(contact: ss.ContactPair, name: str, omega: float) -> None:
    """What shifts the motion to one side makes one of its extremes the larger one, whichever way it goes."""
    problem = one_mass(contact, harmonics=range(11))
    branch = ss.steady_response(problem, omega=omega)
    with pytest.warns(ss.SlipstickWarning, match=f"the amplitude of x has no derivative by {name} at 1 of 1 points"):
        found = branch.sensitivity([name, "damper.mu"])
    above, below = one_sided(problem, name, omega, 1e-4)
    assert above[0] * below[0] < 0.0
    assert np.isnan(float(found.amplitude[0, 0]))
    assert float(found.amplitude_above[0, 0]) == pytest.approx(above[0], rel=1e-3)
    assert float(found.amplitude_below[0, 0]) == pytest.approx(below[0], rel=1e-3)
    assert float(found["mean"][0, 0]) == pytest.approx(0.5 * (above[1] + below[1]), rel=1e-5)
    difference = (problem.with_parameter("damper.mu", 0.3 + sign * 1e-5) for sign in (1.0, -1.0))
    up, down = (numbers(changed, omega)[0] for changed in difference)
    for side in ("", "_above", "_below"):
        assert float(found[f"amplitude{side}"][1, 0]) == pytest.approx((up - down) / 2e-5, rel=1e-5)


def test_bands_of_tolerances_take_the_steeper_side() -> None:
    """The parameter is so small that the extremes are still equal."""
    problem = one_mass(damper(0.0, cos={2: 1e-9}), harmonics=range(11))
    tied = ss.steady_response(problem, omega=10.0)
    above, _ = one_sided(problem, "damper.cos2", 10.0, 1e-4)
    band = amplitude_band(tied, "x", {"damper.cos2": 1.0})
    spread = 0.5 * float(band.high[0] - band.low[0])
    assert spread == pytest.approx(1e-9 * above[0], rel=1e-3)


@pytest.mark.parametrize(("contact", "name"), [
    ({"gap": 0.0}, "c.gap"), ({"normal_load": 0.0}, "c.normal_load"), ({"gap": 0.0}, "load.y.amplitude"),
])  # fmt: skip
def test_contacts_that_just_touch(contact: dict[str, float], name: str) -> None:
    """At rest across: they open on one side and close on the other; what moves them not has a derivative."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=np.diag([40.0, 60.0]), dofs=["x", "y"])
    across = None if "normal_load" in contact else "y"
    pair = ss.ContactPair(name="c", contact=ss.FrictionContact(**NORMAL, **contact), tangential="x", normal=across)
    loads = [ss.Load(dof="x", sin=100.0), ss.Load(dof="y", harmonic=0, cos=0.0)]
    problem = ss.Problem(structure, contacts=pair, loads=loads, harmonics=range(6))
    branch = ss.steady_response(problem, omega=5.0)
    for of in ("amplitude", "displacement"):
        with pytest.warns(ss.SlipstickWarning, match=f"no derivative by {name} at 1 point: contacts that just touch"):
            found = branch.sensitivity([name, "c.mu"], of=of)
        assert np.all(np.isnan(found[of].values[0]))
        assert np.all(found[of].values[1] == 0.0)


def test_grazing_has_a_derivative() -> None:
    """Contact that lasts no time adds nothing, on both sides."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["y"])
    size = 100.0 / abs(complex(15.0, 2.0))
    stop = ss.ContactPair(
        name="c", contact=ss.FrictionContact(kt=0.0, mu=0.0, kn=50.0, gap=size), ports={"normal": "y"}
    )
    problem = ss.Problem(structure, contacts=stop, loads=ss.Load(dof="y", sin=100.0), harmonics=range(6))
    found = ss.steady_response(problem, omega=5.0).sensitivity("c.gap")
    up, down = one_sided(problem, "c.gap", 5.0, 1e-6)
    assert float(found.amplitude[0, 0]) == pytest.approx(0.0, abs=1e-6)
    assert [up[0], down[0]] == pytest.approx([0.0, 0.0], abs=0.05)  # falls as the root of the step


def test_contacts_without_stiffness_and_stuck_ones() -> None:
    for law, name, reason in (
        ({"kt": 0.0, "mu": 0.3, "normal_load": 800.0}, "c.kt", "have no mean friction force yet"),
        ({"kt": 100.0, "mu": 0.3, "normal_load": 1e6}, "c.velocity", "their mean friction force jumps"),
    ):
        pair = ss.ContactPair(name="c", contact=ss.FrictionContact(**law), tangential="x")
        branch = ss.steady_response(one_mass(pair), omega=5.0)
        with pytest.warns(ss.SlipstickWarning, match=f"no derivative by {name} at 1 point: .*{reason}"):
            found = branch.sensitivity(name)
        assert np.all(np.isnan(found.amplitude))
