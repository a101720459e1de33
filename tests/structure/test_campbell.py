"""Campbell diagrams: closed forms, published numbers, modes that cross and veer."""

from __future__ import annotations

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.models.rotor import TURN, Bearing, Disc, Shaft, beam_rotor, jeffcott_rotor
from slipstick.structure.campbell import campbell
from slipstick.structure.matrices import MatrixStructure

K, IT, IP = 40.0, 2.0, 1.2


def top(**change: object) -> MatrixStructure:
    given = {"M": IT * np.eye(2), "K": K * np.eye(2), "gyroscopic": IP * TURN, "speed": 0.0, "dofs": ["x", "y"]}
    return MatrixStructure(**given | change)  # type: ignore[arg-type]


def test_a_tilting_disc() -> None:
    """``w = -+ W Ip / 2 It + sqrt((W Ip / 2 It)^2 + k / It)``; order n meets it at ``n W``."""
    speeds = np.linspace(0.0, 20.0, 9)
    found = campbell(top(), speeds, engine_orders=(1, 2))
    half = 0.5 * speeds * IP / IT
    exact = np.sqrt(half**2 + K / IT)[:, None] + half[:, None] * np.array([-1.0, 1.0])
    assert found.frequency.values == pytest.approx(exact, rel=1e-12)
    assert found.damping_ratio.values == pytest.approx(0.0, abs=1e-12)
    assert found.whirl.values[1:].tolist() == [[-1, 1]] * 8
    met = sorted((float(np.sqrt(K / (n * n * IT - sense * n * IP))), n, sense) for n in (1, 2) for sense in (1, -1))
    for name, k in (("speed", 0), ("order", 1), ("whirl", 2)):
        assert found[f"crossing_{name}"].values == pytest.approx([row[k] for row in met], rel=1e-11)
    assert found.crossing_frequency.values == pytest.approx(found.crossing_speed * found.crossing_order, rel=1e-11)


def test_crossings_are_the_resonances_of_the_tied_speed() -> None:
    steel = beam([0.0])
    for n in (1, 2):
        found = campbell(steel, np.linspace(0.0, 900.0, 7), engine_orders=[n], modes=6)
        tied = beam(None, engine_order=n).natural_frequencies
        inside = tied[tied < 0.999 * n * 900.0][: found.sizes["crossing"]]
        assert found.sizes["crossing"] >= 4
        assert np.sort(found.crossing_frequency.values) == pytest.approx(inside, rel=1e-9)


def beam(speed: object, **change: object) -> MatrixStructure:
    import slipstick as ss

    steel = ss.Material(young=211e9, poisson=0.3, density=7810.0)
    discs = [Disc(node=2, mass=32.6, polar=0.33, diametral=0.178), Disc(node=4, mass=52.0, polar=0.8, diametral=0.4)]
    bearings = [Bearing(node=n, kxx=1e6, kyy=0.8e6) for n in (0, 6)]
    speeds = {"speed": 0.0} if speed is not None else change
    return beam_rotor(
        [Shaft(length=1.5, outer=0.05, elements=6)], material=steel, discs=discs, bearings=bearings, **speeds
    )  # type: ignore[arg-type]


def test_modes_that_cross_keep_their_numbers() -> None:
    """Two uncoupled discs: a steep forward line passes through the flat ones of the other."""
    zero = np.zeros((2, 2))
    own = MatrixStructure(
        M=np.eye(4), K=np.diag([9.0, 9.0, 25.0, 25.0]), dofs=["ax", "ay", "bx", "by"], speed=0.0,
        gyroscopic=np.block([[0.9 * TURN, zero], [zero, 0.01 * TURN]]),
    )  # fmt: skip
    speeds = np.linspace(0.1, 12.0, 13)
    frequency = campbell(own, speeds).frequency.values
    half = 0.45 * speeds
    steep = half + np.sqrt(half**2 + 9.0)
    assert np.abs(frequency - steep[:, None]).max(axis=0).min() < 1e-9


def test_a_damped_rotor_in_its_frame() -> None:
    """A function of the speed: the frequencies of the rotating frame are those of the fixed one less the speed."""
    found = campbell(
        lambda W: jeffcott_rotor(mass=2.0, stiffness=50.0, damping=0.2, speed=W, frame="rotating"), [1.0, 2.0, 4.0]
    )
    assert found.frequency.values[-1] == pytest.approx([1.0, 9.0], abs=2e-3)
    assert np.all(found.damping_ratio.values > 0.0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((top(), [1.0]), "speeds"),
        ((top(), [2.0, 1.0]), "ascending"),
        ((MatrixStructure(M=[[1.0]], K=[[1.0]], dofs=["x"]), [0.0, 1.0]), "nothing in it turns"),
        ((3.0, [0.0, 1.0]), "a function of the speed"),
    ],
)
def test_faults(arguments: tuple[object, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        campbell(*arguments)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="engine_orders"):
        campbell(top(), [0.0, 1.0], engine_orders=[0])
