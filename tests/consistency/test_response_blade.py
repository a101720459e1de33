"""The reduced blade: eight contacts with normal motion, against its published numbers and the linear limits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import slipstick as ss

DATA = Path(__file__).parents[2] / "examples" / "blade_reduced" / "blade_reduced.npz"
STIFFNESS = 27450.33
HERTZ = 2 * np.pi


@pytest.fixture(scope="module")
def structure() -> ss.ModalStructure:
    dofs = [f"n{node}.{axis}" for node in range(1, 9) for axis in "xyz"]
    return ss.ModalStructure.load(DATA, dofs=dofs, loss_factor=0.001, load="pressure")


def blade(structure: ss.ModalStructure, load: float = 1.0, velocity: float = 0.0, mu: float = 0.3) -> ss.Problem:
    pairs = [
        ss.ContactPair(
            name=f"c{i}",
            contact=ss.FrictionContact(kt=STIFFNESS, mu=mu, kn=STIFFNESS, gap=-3.96918 * load / STIFFNESS),
            tangential=f"n{i}.y",
            normal=f"n{i}.z",
            rubbing=ss.RubbingMotion(velocity=velocity),
        )
        for i in range(1, 9)
    ]
    loads = [ss.Load(shape="pressure", cos=2.0)]
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=ss.Harmonics(range(6)))


@pytest.mark.parametrize("load, velocity, around, wanted", [
    (1.0, 0.0, (300.0, 315.0), (307.7, 4.66e-5)), (4.0, 0.0, (300.0, 315.0), (309.2, 1.76e-4)),
    (1.0, 5.0, (205.0, 217.0), (211.0, 3.480e-3)), (1.0, 1.0, (205.0, 220.0), (212.0, 7.92e-4)),
])  # fmt: skip
def test_known_peaks(
    structure: ss.ModalStructure, load: float, velocity: float, around: tuple[float, float], wanted: tuple[float, float]
) -> None:
    """The numbers are given to three or four digits, the frequencies roughly."""
    branch = ss.forced_response(
        blade(structure, load, velocity), omega=(around[0] * HERTZ, around[1] * HERTZ), peaks_of="n1.y"
    )
    assert branch.outcome is ss.Outcome.COMPLETED
    omega, size = max(branch.peaks("n1.y"), key=lambda peak: peak[1])
    assert omega / HERTZ == pytest.approx(wanted[0], abs=1.0)
    assert size == pytest.approx(wanted[1], rel=2e-3)


def test_fast_rubbing_of_contacts_that_stay_closed_is_linear(structure: ss.ModalStructure) -> None:
    """Far from contact loss normal load and friction depend linearly on the motion: no higher harmonics, no stick."""
    problem = blade(structure, load=1000.0, velocity=1e4)
    fast = ss.forced_response(problem, omega=(206 * HERTZ, 216 * HERTZ))
    plain = ss.forced_response(problem.with_parameter("friction", 0.0), omega=(206 * HERTZ, 216 * HERTZ))
    assert fast.dataset["stick_fraction"].to_numpy().max() == 0.0
    assert fast.dataset["separation_fraction"].to_numpy().max() == 0.0
    high = fast.dataset["displacement"].to_numpy()[:, :, 3:]
    assert np.abs(high).max() < 1e-9 * fast.dataset["amplitude"].to_numpy().max()
    assert len(plain) > 10


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_free_outputs_follow_from_receptance(structure: ss.ModalStructure) -> None:
    """Dofs that are no contact port (x of every node) without friction forces: the linear response."""
    problem = blade(structure, load=0.0, mu=0.0).with_parameter("*.gap", 1.0)
    branch = ss.forced_response(problem, omega=(200 * HERTZ, 220 * HERTZ), peaks_of="n3.x")
    linear = ss.linear_response(problem, omega=branch.dataset["omega"].to_numpy())
    wanted, solved = linear.dataset["amplitude"].to_numpy(), branch.dataset["kind"].to_numpy() != "interpolated"
    assert branch.dataset["amplitude"].to_numpy() == pytest.approx(wanted, rel=1e-3)
    assert branch.dataset["amplitude"].to_numpy()[solved] == pytest.approx(wanted[solved], rel=1e-7)
    (peak,) = branch.peaks("n3.x")
    assert peak[0] == pytest.approx(float(structure.omega[0]), rel=1e-4)
    fine = ss.linear_response(problem, omega=peak[0] * (1 + np.linspace(-1e-5, 1e-5, 5)))
    x = np.linspace(-1.0, 1.0, 5)
    parabola = np.polyfit(x, fine.dataset["amplitude"].sel(dof="n3.x").to_numpy(), 2)
    assert abs(parabola[1] / (2 * parabola[0])) < 0.1  # within a millionth of omega
