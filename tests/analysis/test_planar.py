"""Analyses with contacts that slide in two directions, each held against another way to the same number."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

import slipstick as ss

FOOT = ss.PlanarFrictionContact(kt=100.0, mu=0.3, kn=50.0, normal_load=800.0)
pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def problem(contact: ss.FrictionContact = FOOT, **options: Any) -> ss.Problem:
    """Two directions and a normal one that opens the contact."""
    return ss.Problem(
        ss.MatrixStructure(M=np.eye(3), C=2.0 * np.eye(3), K=40.0 * np.diag([1.0, 1.2, 5.0]), dofs=["x", "y", "z"]),
        contacts=[ss.ContactPair(name="foot", contact=contact, tangential=("x", "y"), normal="z")],
        loads=[ss.Load(dof="x", cos=200.0), ss.Load(dof="y", sin=100.0), ss.Load(dof="z", cos=2000.0)],
        harmonics=range(6), **options,
    )  # fmt: skip


@cache
def curve(mu: float = 0.3) -> ss.Branch:
    return ss.forced_response(problem(FOOT.changed(mu=mu)), omega=(4.0, 16.0), peaks_of=["x"])


def peak(branch: ss.Branch) -> tuple[float, float]:
    """Frequency and amplitude of the highest peak of x."""
    d = branch.dataset
    at = max(np.flatnonzero(d["kind"].to_numpy() == "peak"), key=lambda i: float(d["amplitude"][i, 0]))
    return float(d["omega"][at]), float(d["amplitude"][at, 0])


def test_a_curve_with_separation() -> None:
    d = curve().dataset
    assert curve().outcome.ok
    assert float(d["separation_fraction"].max()) > 0.2
    assert float(d["stick_fraction"].max()) > 0.5


def test_sensitivity_of_the_peak_is_that_of_other_curves() -> None:
    found = curve().sensitivity(["foot.mu"], dof="x")
    at = int(np.argmin(np.abs(found["peak_omega"].to_numpy()[0] - peak(curve())[0])))
    slope = float(found["peak_amplitude"][0, at])
    difference = (peak(curve(0.301))[1] - peak(curve(0.299))[1]) / 0.002
    assert slope == pytest.approx(difference, rel=1e-4)


def test_a_tracked_peak_is_that_of_curves() -> None:
    tracked = ss.track_peak(problem(), "foot.mu", (0.3, 0.4), dof="x", omega=(4.0, 16.0))
    assert tracked.outcome.ok
    ends = tracked.dataset.isel(point=[0, -1])
    for i, mu in enumerate((0.3, 0.4)):
        omega, amplitude = peak(curve(mu))
        assert float(ends["omega"][i]) == pytest.approx(omega, rel=1e-5)
        assert float(ends["amplitude"][i, 0]) == pytest.approx(amplitude, rel=1e-7)


def test_the_force_of_a_nonlinear_mode_drives_it_at_its_frequency() -> None:
    """Power balance: the self-excitation of the mode gives what friction and dampers take."""
    modes = ss.nonlinear_modes(problem_without_normal(), amplitude=(0.5, 8.0), dof="x")
    assert modes.outcome.ok
    d = modes.dataset
    assert float(d["slip_fraction"].max()) > 0.5
    assert float(d["stick_fraction"].max()) == pytest.approx(1.0)
    w, X, power = d["omega"].to_numpy(), d["displacement"].to_numpy(), d["dissipated_power"].to_numpy()[:, 0]
    squares = (X[:, :, 1:] ** 2 * np.repeat(np.arange(1, 6), 2) ** 2).sum(axis=(1, 2))
    given = 2.0 * d["modal_damping"].to_numpy() * w * 0.5 * w**2 * squares
    dampers = 2.0 * 0.5 * w**2 * squares
    np.testing.assert_allclose(given, dampers + power, rtol=1e-6)


def problem_without_normal() -> ss.Problem:
    contact = ss.PlanarFrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    return ss.Problem(
        ss.MatrixStructure(M=np.eye(2), C=2.0 * np.eye(2), K=40.0 * np.diag([1.0, 1.2]), dofs=["x", "y"]),
        contacts=[
            ss.ContactPair(name="foot", contact=contact, tangential=({"x": 0.8, "y": 0.6}, {"x": -0.6, "y": 0.8}))
        ],
        harmonics=range(6),
    )


def test_friction_heats_and_follows_the_temperature() -> None:
    model = ss.ThermalModel(
        curve=ss.FrictionCurve(temperature=[20.0, 300.0], mu=[0.3, 0.2]), background=20.0, resistance=0.02
    )
    d = ss.steady_response(problem(thermal=model), omega=9.0).dataset
    temperature, mu = float(d["temperature"][0, 0]), float(d["friction_coefficient"][0, 0])
    assert temperature == pytest.approx(20.0 + 0.02 * float(d["dissipated_power"][0, 0]))
    assert mu == pytest.approx(0.3 - 0.1 * (temperature - 20.0) / 280.0)
    cold = ss.steady_response(problem(FOOT.changed(mu=mu)), omega=9.0).dataset
    np.testing.assert_allclose(d["amplitude"], cold["amplitude"], rtol=1e-8)


def test_heat_of_contacts_of_both_kinds() -> None:
    """Along a line the planar contact is that of one direction, heated as well as the other one, derivatives too."""
    rub = ss.RubbingMotion(velocity=1.0)

    def heated(contact: ss.FrictionContact, tangential: Any, **options: Any) -> ss.Branch:
        edge = ss.FrictionContact(kt=100.0, mu=0.5, normal_load=40.0)
        model = ss.ThermalModel(
            curve={name: ss.FrictionCurve(temperature=[25.0, 4000.0], mu=[0.5, 0.1]) for name in ("foot", "edge")},
            background=25.0,
            **{"resistance": {"foot": 3.0, "edge": 1.0}, **options},
        )
        two = ss.Problem(
            ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=40.0 * np.eye(2), dofs=["x", "y"]),
            contacts=[
                ss.ContactPair(name="foot", contact=contact, tangential=tangential, rubbing=rub),
                ss.ContactPair(name="edge", contact=edge, tangential="x", rubbing=rub),
            ],
            loads=[ss.Load(dof="x", sin=15.0)],
            harmonics=range(4),
            thermal=model,
        )
        return ss.steady_response(two, omega=6.4)

    line = ss.FrictionContact(kt=100.0, mu=0.5, normal_load=40.0)
    plane = ss.PlanarFrictionContact(kt=100.0, mu=0.5, normal_load=40.0)
    one, both = heated(line, "x"), heated(plane, ("x", "y"))
    for name in ("temperature", "friction_coefficient", "amplitude"):
        np.testing.assert_allclose(both.dataset[name], one.dataset[name], rtol=1e-8, atol=1e-12)
    assert np.all(both.dataset["temperature"] > 30.0)
    names = ["foot.kt", "edge.kt", "friction"]
    found, expected = (branch.sensitivity(names, dof="x")["amplitude"] for branch in (both, one))
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-12)
    diagonal = heated(plane, ("x", "y"), resistance=np.diag([1.0, 3.0]), contacts=["edge", "foot"])
    np.testing.assert_array_equal(diagonal.dataset["temperature"], both.dataset["temperature"])
    with pytest.raises(ss.InputError, match="contacts of different laws"):
        heated(plane, ("x", "y"), resistance=np.ones((2, 2)), contacts=["foot", "edge"])
    with pytest.raises(ss.InputError, match="no contact 'fot'"):
        heated(plane, ("x", "y"), resistance={"fot": 1.0})


def test_study_loops_and_report(tmp_path: Any) -> None:
    found = ss.study(problem(), {"foot.mu": [0.3]}, omega=(8.0, 12.0))
    assert float(found["peak_amplitude"].sel(dof="x").max()) > 1.0
    branch = curve()
    first, second = (branch.loop(3, "foot", port=port) for port in ("tangential", "second"))
    assert np.hypot(first["force"], second["force"]).max() > 0.0
    power = float(branch.dataset["dissipated_power"][3, 0])
    energy = sum(np.trapezoid(loop["force"], loop["total"]) for loop in (first, second))
    assert energy * float(branch.dataset["omega"][3]) / (2.0 * np.pi) == pytest.approx(power, rel=1e-3)
    assert branch.report(tmp_path / "r.html")


CIRCLE = ss.Problem(
    ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=40.0 * np.eye(2), dofs=["x", "y"]),
    contacts=[
        ss.ContactPair(
            name="foot", contact=ss.PlanarFrictionContact(kt=100.0, mu=0.3, normal_load=800.0), tangential=("x", "y")
        )
    ],
    loads=[ss.Load(dof="x", cos=200.0), ss.Load(dof="y", sin=200.0)], harmonics=range(4),
)  # fmt: skip


class TestCircleThatSlipsEverywhereAtOnce:
    """Stuck, the circle has the amplitude p / |k + kt - omega^2 + i c omega|; it slips where that is mu N / kt."""

    @staticmethod
    def marked(branch: ss.Branch, name: str) -> list[float]:
        d = branch.dataset
        assert branch.outcome.ok
        return [float(value) for value in d[name].to_numpy()[d["kind"].to_numpy() == "state change"]]

    @pytest.mark.parametrize("stability", [False, True])
    @pytest.mark.parametrize("span", [(2.0, 20.0), (20.0, 2.0), (16.0, 5.0)])
    def test_both_corners_over_frequency(self, span: tuple[float, float], stability: bool) -> None:
        roots = np.roots([1.0, -2.0 * 140.0 + 0.4**2, 140.0**2 - (200.0 / 2.4) ** 2])
        begins, ends = sorted(np.sqrt(roots.real), reverse=span[0] > span[1])
        found = self.marked(ss.forced_response(CIRCLE, omega=span, stability=stability), "omega")
        assert found == [pytest.approx(begins, abs=5e-8), pytest.approx(ends, abs=5e-8)]  # of the element: 1e-8

    def test_over_the_normal_load(self) -> None:
        limit = 100.0 * 200.0 / abs(140.0 - 64.0 + 3.2j) / 0.3
        for start, stop in ((600.0, 1200.0), (1200.0, 600.0)):
            branch = ss.parameter_response(CIRCLE, "foot.normal_load", (start, stop), omega=8.0)
            assert self.marked(branch, "parameter") == [pytest.approx(limit, rel=5e-8)]

    @pytest.mark.parametrize("beyond", [-1e-9, 1e-12, 1e-9, 1e-8, 1e-7, 1e-6])
    def test_first_points_beside_the_corner(self, beyond: float) -> None:
        """Slipping, ``p = |r (k - omega^2 + i c omega) + mu N e^{i a}|`` with ``cos a = mu N / (kt r)``."""
        limit, reach = 240.0, 2.4
        load = reach * abs(140.0 - 64.0 + 3.2j) * (1.0 + beyond)

        def rest(root: float) -> float:
            r = reach * (1.0 + root * root)
            turned = reach / r + 1j * np.sqrt(1.0 - (reach / r) ** 2)
            return float(abs(r * (40.0 - 64.0 + 3.2j) + limit * turned) - load)

        exact = reach * (1.0 + (brentq(rest, 0.0, 1.0, xtol=1e-15) ** 2 if beyond > 0.0 else beyond))
        loads = [ss.Load(dof="x", cos=load), ss.Load(dof="y", sin=load)]
        branch = ss.steady_response(replace(CIRCLE, loads=loads), omega=8.0)
        assert branch.outcome.ok
        assert branch.dataset.amplitude.values[0] == pytest.approx([exact, exact], rel=2e-9)
