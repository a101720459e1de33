"""Curves with a Jacobian that is never written out against those with one that is."""

import numpy as np
import pytest
from helpers.benchmarks import benchmark
from helpers.results import corrected

import slipstick as ss
from slipstick.balance.contact_jacobian import ContactJacobian
from slipstick.solve import newton
from slipstick.solve.continuation import corrector
from slipstick.solve.linear.jacobian import OF_CORRECTIONS

PLATE = benchmark("many_contacts")

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def curves(nx, ny, span):
    problem = PLATE.problem(*PLATE.plate(nx, ny, modes=60))
    return [
        ss.forced_response(problem, omega=span, at=np.linspace(*span, 9)[1:-1], options={"jacobian": kind})
        for kind in ("dense", "iterative")
    ]


def same_curves(dense, iterative):
    """The same motion at the requested frequencies, at each of their passages."""
    assert dense.outcome.ok
    assert iterative.outcome.ok
    assert (dense.dataset.attrs["jacobian"], iterative.dataset.attrs["jacobian"]) == ("dense", "iterative")
    asked = [branch.dataset.isel(point=branch.dataset.kind.values == "requested") for branch in (dense, iterative)]
    assert asked[0].sizes["point"] == asked[1].sizes["point"] >= 7
    np.testing.assert_array_equal(asked[1].omega, asked[0].omega)
    size = float(np.abs(asked[0].displacement).max())
    np.testing.assert_allclose(asked[1].displacement, asked[0].displacement, rtol=0, atol=1e-8 * size)


def test_ten_contacts_that_slip_and_lift_off():
    dense, iterative = curves(5, 2, (1500.0, 1900.0))
    same_curves(dense, iterative)
    assert float(dense.dataset.separation_fraction.max()) > 0.5
    assert float(dense.dataset.slip_fraction.max()) > 0.05


def kinds(n, span, points, **options):
    """Curves with residuals written out and solved for."""
    return [
        ss.forced_response(
            PLATE.problem(*PLATE.plate(*PLATE.GRIDS[n], modes=60, residuals=kind)), omega=span,
            at=np.linspace(*span, points + 2)[1:-1], options={"jacobian": "iterative", **options},
        )
        for kind in ("written", "solved")
    ]  # fmt: skip


def same_kinds(written, solved, size=1e-8, kind="requested"):
    """The same motion and forces at the frequencies asked for."""
    assert type(solved.problem.structure).__name__ == "SolvedModes"
    assert [b.dataset.attrs.get("reduction_residuals") for b in (written, solved)] == [None, "solved"]
    asked = [
        branch.dataset.isel(point=(branch.dataset.kind.values == kind) | (kind is None)) for branch in (written, solved)
    ]
    np.testing.assert_array_equal(asked[1].omega, asked[0].omega)
    assert asked[0].sizes["point"] >= 1
    for name in ("displacement", "contact_normal", "normal_force", "friction_force"):
        one, other = asked[0][name].values, asked[1][name].values
        np.testing.assert_allclose(other, one, rtol=0, atol=size * np.abs(one).max(), err_msg=name)
    np.testing.assert_allclose(asked[1].truncation, asked[0].truncation, rtol=1e-3)


def test_residuals_solved_for_at_twenty_contacts():
    """Sensitivities too, which solve with the transposes."""
    problems = (
        PLATE.problem(*PLATE.plate(*PLATE.GRIDS[20], modes=60, residuals=kind)) for kind in ("written", "solved")
    )
    written, solved = (
        ss.steady_response(problem.with_parameter("friction", 0.1), omega=1740.0, options={"jacobian": "iterative"})
        for problem in problems
    )
    same_kinds(written, solved, kind=None)
    assert float(written.dataset.slip_fraction.max()) > 0.02
    names = ["c3.mu", "c7.kn", "loss_factor", "load"]
    of = {"dof": "20n", "of": "displacement"}
    one, other = (branch.sensitivity(names, **of)["displacement"].values for branch in (written, solved))
    np.testing.assert_allclose(other, one, rtol=1e-5, atol=1e-7 * np.abs(one).max())


@pytest.mark.parametrize(
    "n, residuals, span",
    [
        (10, "written", (1500.0, 1900.0)),
        pytest.param(100, "written", (1640.0, 1760.0), marks=pytest.mark.verify),
        pytest.param(100, "solved", (1640.0, 1760.0), marks=pytest.mark.verify),
        pytest.param(300, "written", (1640.0, 1760.0), marks=pytest.mark.verify),
        pytest.param(300, "solved", (1700.0, 1800.0), marks=pytest.mark.verify),
    ],
)
def test_what_is_spared_changes_no_number(n, residuals, span, monkeypatch):
    """Sizes of corrections are asked for roughly, without products, and what stands for one Jacobian serves the next:
    with all products, and with each of its own, the curve is the same."""
    problem = PLATE.problem(*PLATE.plate(*PLATE.GRIDS[n], modes=60, residuals=residuals))

    def curve():
        return ss.forced_response(
            problem, omega=span, at=np.linspace(*span, 5)[1:-1], options={"jacobian": "iterative"}
        )

    spared = curve()
    for module, name in ((newton, "_SIZE_ERROR"), (corrector, "_DISTANCE_ERROR")):
        monkeypatch.setattr(module, name, OF_CORRECTIONS)
    monkeypatch.setattr(ContactJacobian, "take_over", lambda self, other: None)
    whole = curve()
    assert spared.outcome.ok
    assert float(spared.dataset.separation_fraction.max()) > 0.3
    found = [branch.dataset.isel(point=branch.dataset.kind.values == "peak") for branch in (spared, whole)]
    assert found[0].omega.size
    for name in ("omega", "amplitude"):
        np.testing.assert_allclose(found[0][name], found[1][name], rtol=1e-9)
    asked = [branch.dataset.isel(point=branch.dataset.kind.values == "requested") for branch in (spared, whole)]
    np.testing.assert_array_equal(asked[0].omega, asked[1].omega)
    for name in ("displacement", "contact_normal", "normal_force", "friction_force"):
        one, other = asked[0][name].values, asked[1][name].values
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-9 * np.abs(other).max(), err_msg=name)


def test_linear_limits_with_residuals_solved_for():
    """As a page draws them beside the curve."""
    written, solved = (
        ss.linear_response(
            PLATE.problem(*PLATE.plate(*PLATE.GRIDS[50], modes=60, residuals=kind)), omega=[1500.0, 1700.0],
            state="stuck",
        ).dataset.displacement.values
        for kind in ("written", "solved")
    )  # fmt: skip
    np.testing.assert_allclose(solved, written, rtol=0, atol=1e-8 * np.abs(written).max())


@pytest.mark.verify
def test_residuals_solved_for_through_a_resonance():
    written, solved = kinds(100, (1640.0, 1760.0), 4)
    same_kinds(written, solved)
    assert float(written.dataset.slip_fraction.max()) > 0.02
    assert float(written.dataset.separation_fraction.max()) > 0.3


@pytest.mark.verify
@pytest.mark.parametrize("n", [300, 1000])
def test_residuals_solved_for_at_hundreds_of_contacts(n):
    """On the flank of the resonance, where many slip or lift off."""
    problems = (PLATE.problem(*PLATE.plate(*PLATE.GRIDS[n], residuals=kind)) for kind in ("written", "solved"))
    written, solved = (ss.steady_response(problem, omega=[1660.0, 1685.0]) for problem in problems)
    same_kinds(written, solved, kind=None)
    assert float(written.dataset.separation_fraction.max()) > 0.3


@pytest.mark.verify
def test_fifty_contacts_give_the_same_curve():
    """Peaks below a hundredth of the highest are left out: one that is a 600th of the range wide is stepped over."""
    dense, iterative = curves(10, 5, PLATE.RANGE)
    found = [np.array(branch.peaks("50n")) for branch in (iterative, dense)]
    found = [peaks[peaks[:, 1] > 0.01 * peaks[:, 1].max()] for peaks in found]
    assert len(found[1]) == 2
    np.testing.assert_allclose(*found, rtol=1e-8)
    same_curves(dense, iterative)


@pytest.mark.verify
def test_five_hundred_contacts_through_a_resonance():
    n = 500
    branch = ss.forced_response(PLATE.problem(*PLATE.plate(*PLATE.GRIDS[n])), omega=(1500.0, 1900.0))
    assert branch.outcome.ok
    assert branch.dataset.attrs["jacobian"] == "iterative"
    assert float(corrected(branch.dataset).residual.max()) < 1e-8
    peak = max(branch.peaks(f"{n}n"), key=lambda p: p[1])
    # the same plate on ten contacts of the same stiffness in all peaks at 1770 rad/s
    assert peak[0] == pytest.approx(1740.0, rel=0.03)
