"""Rotors against closed forms, and against the published numbers of another code."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import slipstick as ss
from slipstick.errors import InputError
from slipstick.models.rotor import TURN, Bearing, Disc, Shaft, beam_element, beam_rotor, jeffcott_rotor
from slipstick.structure.complex_modes import complex_modes

SHEAR = 81.2e9
STEEL = ss.Material(young=211e9, poisson=211e9 / (2 * SHEAR) - 1.0, density=7810.0)


def test_a_jeffcott_rotor_in_both_frames() -> None:
    """Poles of the fixed frame, less the speed times i for forward whirl, are those of the rotating one."""
    given = {"mass": 2.0, "stiffness": 50.0, "damping": 0.3, "internal_damping": 0.2}
    fixed, rotating = (jeffcott_rotor(**given, speed=3.0, frame=frame) for frame in ("fixed", "rotating"))
    poles = [
        complex_modes(e.M, e.C, e.K).poles for e in (s.time_equations(np.eye(2), np.eye(2)) for s in (fixed, rotating))
    ]
    forward = max(poles[0][poles[0].imag > 0.0], key=lambda pole: pole.real)  # pushed by the internal damping
    backward = min(poles[0][poles[0].imag > 0.0], key=lambda pole: pole.real)
    expected = [forward - 3.0j, backward + 3.0j]
    for pole in expected:
        assert np.abs(poles[1] - pole).min() < 1e-10
    # (m s^2 + (c + ci) s + k - i W ci) z = 0 for z = x + i y
    assert m_s(forward, speed=3.0) == pytest.approx(0.0, abs=1e-9)


def m_s(s: complex, speed: float) -> complex:
    return 2.0 * s * s + 0.5 * s + 50.0 - 1j * speed * 0.2


def test_a_fast_rotor_in_its_frame_has_negative_stiffness_and_is_held_by_coriolis_forces() -> None:
    fast = jeffcott_rotor(mass=2.0, stiffness=50.0, speed=8.0, frame="rotating")
    assert fast.natural_frequencies == pytest.approx([3.0, 13.0])
    assert fast.self_excited == ""
    assert fast.K[0, 0] < 0.0
    assert (
        "at 5.0001 rad/s"
        in jeffcott_rotor(mass=2.0, stiffness=50.0, speed=8.0, internal_damping=0.1, damping=0.01).self_excited
    )


@pytest.mark.parametrize("shear", [False, True])
def test_whirl_of_a_pinned_shaft(shear: bool) -> None:
    """Sine modes of a turning Timoshenko or Rayleigh beam; the mesh is converged by extrapolation."""
    L, d, W = 1.0, 0.1, 2000.0
    piece = Shaft(length=L, outer=d)
    A, I, E, rho, B = piece.area, piece.second_moment, STEEL.young, STEEL.density, np.pi / L  # noqa: E741
    if shear:
        g = piece.shear_coefficient(STEEL.poisson) * SHEAR * A
        first, second = [-rho * A, 0.0, g * B**2], [-rho * I, 2.0 * rho * I * W, E * I * B**2 + g]
        exact = np.roots(np.polysub(np.polymul(first, second), [(g * B) ** 2]))
    else:
        exact = np.roots([-rho * A - rho * I * B**2, 2.0 * rho * I * B**2 * W, E * I * B**4])
    exact = np.sort(np.abs(exact))[:2]
    found = []
    for n in (10, 20, 40):
        pinned = [Bearing(node=k, kxx=1e16) for k in (0, n)]
        rotor = beam_rotor(
            [Shaft(length=L, outer=d, elements=n)], material=STEEL, bearings=pinned, speed=W, shear=shear
        )
        found.append(rotor.natural_frequencies[:2])
    coarse, middle, fine = (each / exact - 1.0 for each in found)
    order = np.log2(np.abs(coarse / middle))
    assert order == pytest.approx(2.0 if shear else 4.0, abs=0.1)
    factor = 4.0 if shear else 16.0
    assert (factor * fine - middle) / (factor - 1.0) == pytest.approx(0.0, abs=1e-6)
    assert shear or np.abs(fine).max() < 1e-6


# ross.rotor_assembly, test_campbell of ROSS 2.4 (github.com/petrobras/ross): damped frequencies at 0, 150, 300 rad/s
# without the fifth, which is along the shaft
ROSS = {
    0.0: [82.65303734, 86.65811435, 254.52047828, 274.31285391, 679.48903239],
    150.0: [82.60929602, 86.68625235, 251.70037114, 276.87787937, 652.85679897],
    300.0: [82.48132723, 86.76734307, 245.49092844, 282.33294699, 614.05536277],
}


def published(speed: float, outer: float = 0.35) -> ss.MatrixStructure:
    """The rotor of its examples: six elements, two discs, two bearings that differ in x and y."""
    discs = [
        Disc.of(node=node, material=STEEL, width=0.07, outer=size, inner=0.05) for node, size in ((2, 0.28), (4, outer))
    ]
    bearings = [Bearing(node=node, kxx=1e6, kyy=0.8e6) for node in (0, 6)]
    shaft = Shaft(length=1.5, outer=0.05, elements=6)
    return beam_rotor([shaft], material=STEEL, discs=discs, bearings=bearings, speed=speed)


@pytest.mark.parametrize("speed", ROSS)
def test_the_published_campbell_diagram(speed: float) -> None:
    found = published(speed).natural_frequencies[:5]
    assert found == pytest.approx(ROSS[speed], abs=6e-9)


def test_the_example_of_its_manual() -> None:
    assert published(0.0, outer=0.28).natural_frequencies[:4].round() == pytest.approx([92.0, 96.0, 275.0, 297.0])


def test_internal_damping_makes_forward_whirl_grow_above_the_first_critical_speed() -> None:
    """In stiff bearings all is damped by the shaft: growth begins where the speed meets the whirl."""
    shaft, ends = Shaft(length=1.0, outer=0.05, elements=8), [Bearing(node=k, kxx=1e12) for k in (0, 8)]
    given: dict[str, Any] = {"material": STEEL, "bearings": ends, "internal_damping": 1e-6}
    critical = beam_rotor([shaft], material=STEEL, bearings=ends, engine_order=1).natural_frequencies
    forward = critical[1]
    assert beam_rotor([shaft], **given, speed=0.999 * forward).self_excited == ""
    assert "mode" in beam_rotor([shaft], **given, speed=1.001 * forward).self_excited


def test_a_rigid_element_has_the_inertia_of_a_cylinder() -> None:
    piece = Shaft(length=0.3, outer=0.1, inner=0.04)
    M, K, G = beam_element(piece, 0.3, STEEL, shear=True)
    mass = STEEL.density * piece.area * 0.3
    lift, turn = np.zeros((2, 8))
    lift[[0, 4]] = 1.0
    turn[[2, 6]], turn[[1, 5]] = 1.0, (0.15, -0.15)  # about x through the middle: y = -z rx
    assert lift @ M @ lift == pytest.approx(mass)
    assert turn @ M @ turn == pytest.approx(mass * 0.3**2 / 12.0 + STEEL.density * piece.second_moment * 0.3)
    assert K @ turn == pytest.approx(0.0, abs=1e-6 * np.abs(K).max())
    other = np.zeros(8)
    other[[3, 7]], other[[0, 4]] = 1.0, (-0.15, 0.15)  # about y: x = z ry
    assert K @ other == pytest.approx(0.0, abs=1e-6 * np.abs(K).max())
    assert turn @ G @ other == pytest.approx(2.0 * STEEL.density * piece.second_moment * 0.3)  # Ip W ry' about x
    assert pytest.approx(-G) == G.T


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"discs": [Disc(node=9, mass=1.0, polar=0.0, diametral=0.0)]},
            "discs, number 1, node: found 9; expected at most 2",
        ),
        ({"speed": None}, "speed is not given"),
        ({"shaft": []}, "shaft: there is none"),
        ({"material": 3.0}, "material: found 3"),
    ],
)
def test_faults(change: dict[str, Any], words: str) -> None:
    given: dict[str, Any] = {
        "shaft": [Shaft(length=1.0, outer=0.1, elements=2)], "material": STEEL, "speed": 0.0,
        "bearings": [Bearing(node=0, kxx=1e6), Bearing(node=2, kxx=1e6)],
    } | change  # fmt: skip
    with pytest.raises(InputError, match=words):
        beam_rotor(given.pop("shaft"), **given)
    assert TURN[0, 1] == 1.0


def test_wrong_parts() -> None:
    with pytest.raises(InputError, match="inner"):
        Shaft(length=1.0, outer=0.1, inner=0.2)
    with pytest.raises(InputError, match="frame"):
        jeffcott_rotor(frame="moving")
    with pytest.raises(InputError, match="speed"):
        jeffcott_rotor(frame="rotating")
