"""The motion contacts feel along a profile, against the profile itself at ``angle + speed t``."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from numpy.typing import NDArray

import slipstick as ss
from slipstick.contact.casing import profile_series
from slipstick.errors import InputError
from slipstick.structure.protocol import Around

Array = NDArray[np.float64]
TURN = 2.0 * math.pi


def random_profile(seed: int, highest: int, lobes: int = 1):
    """A finite Fourier profile."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, highest + 1))
    m = lobes * np.arange(highest + 1)

    def height(angle: Array) -> Array:
        turned = np.asarray(angle)[..., None] * m
        return np.cos(turned) @ a + np.sin(turned) @ b

    return height


def met(rub: ss.RubbingMotion, tau: Array, n: int) -> Array:
    """Normal motion over tau, (n_contacts, n_tau)."""
    highest = max(rub.normal_cos)
    h = ss.Harmonics(range(highest + 1))
    return np.broadcast_to(rub.normal_coefficients(h), (n, h.size)) @ h.H_minus(tau).T


@pytest.mark.parametrize("speed", [3.0, -3.0])
@pytest.mark.parametrize("lobes", [1, 3])
@pytest.mark.parametrize("seed", range(4))
def test_contacts_meet_the_profile(seed: int, lobes: int, speed: float) -> None:
    profile = random_profile(seed, 5, lobes)
    angles = np.random.default_rng(seed).uniform(-7, 7, 4)
    rub = ss.casing_motion(profile, angles=angles, radius=[1.0, 2.0, 3.0, 4.0], speed=speed, orders=5, lobes=lobes)
    t = np.linspace(0.0, 2.0, 57)
    wanted = profile(angles[:, None] + speed * t)
    assert met(rub, lobes * abs(speed) * t, 4) == pytest.approx(wanted, abs=1e-12 * np.abs(wanted).max())
    assert np.asarray(rub.velocity) == pytest.approx(speed * np.arange(1.0, 5.0))


def test_one_contact_has_numbers() -> None:
    """Round places: the top of an oval, a quarter turn on, and half a turn on; no sine of rounding."""
    for angle, sign in ((0.0, 1.0), (math.pi / 2, -1.0), (math.pi, 1.0)):
        rub = ss.casing_motion(lambda a: 0.5 * math.cos(2 * a), angles=angle, radius=2.0, speed=3.0)
        assert set(rub.normal_cos) == {2}
        assert rub.normal_cos[2] == pytest.approx(0.5 * sign)
        assert rub.normal_sin[2] == pytest.approx(0.0, abs=1e-15)
        assert rub.velocity == 6.0
    assert ss.casing_motion(lambda a: 0.25, angles=1.0, radius=1.0, speed=1.0).normal_cos == {0: 0.25}


def polygon(seed: int) -> Array:
    rng = np.random.default_rng(seed)
    return np.column_stack([np.sort(rng.uniform(-1.0, TURN - 1.1, 9)), rng.normal(size=9)])


@pytest.mark.parametrize("seed", range(3))
def test_a_table_has_the_coefficients_of_its_polygon(seed: int) -> None:
    table = polygon(seed)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    ends = np.append(table[:, 0], table[0, 0] + TURN)
    heights = np.append(table[:, 1], table[0, 1])
    series = profile_series(table, range(8))
    for m, c, s in zip(series.orders, series.cos, series.sin, strict=True):
        total = 0.0
        for a, b, h0, h1 in zip(ends, ends[1:], heights, heights[1:], strict=False):
            x = 0.5 * (nodes + 1.0)
            total += 0.5 * (b - a) * np.sum(weights * (h0 + (h1 - h0) * x) * np.exp(-1j * m * (a + (b - a) * x)))
        wanted = total / (TURN if m == 0 else math.pi)
        assert complex(c, -s) == pytest.approx(wanted, abs=1e-13)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_table_and_function_agree() -> None:
    """A fine table of a function, closed by a last row or not, beginning anywhere."""
    profile = random_profile(7, 4)
    places = np.linspace(-2.0, TURN - 2.0, 3601)
    closed = np.column_stack([places, profile(places)])
    one, two, three = (
        ss.casing_motion(p, angles=[0.3, 2.0], radius=1.0, speed=2.0, orders=range(5))
        for p in (profile, closed, closed[:-1])
    )
    for m in range(5):
        assert one.normal_cos[m] == pytest.approx(two.normal_cos[m], abs=1e-5)
        assert three.normal_cos[m] == pytest.approx(two.normal_cos[m], abs=1e-12)


def test_the_error_is_that_of_the_series() -> None:
    """A tent of height 1: its odd coefficients are 4 / (pi m)^2, and what is left out adds up at the top."""
    tent = np.array([[0.0, 1.0], [math.pi, 0.0], [TURN, 1.0]])
    series = profile_series(tent, range(6))
    assert series.cos == pytest.approx([0.5, *(4 / (math.pi * m) ** 2 if m % 2 else 0.0 for m in range(1, 6))])
    assert series.sin == pytest.approx(np.zeros(6))
    left = 0.5 - sum(4 / (math.pi * m) ** 2 for m in (1, 3, 5))
    assert (series.range, series.error) == pytest.approx((1.0, left), rel=1e-12)
    assert series.height([0.0, 1.0]).shape == (2,)
    with pytest.warns(ss.SlipstickWarning, match=r"misses it by up to 0.0335, 3.3 % of its range 1"):
        ss.casing_motion(tent, angles=0.0, radius=1.0, speed=1.0, orders=5)
    with pytest.warns(ss.SlipstickWarning, match="which have to be 2 equal lobes"):
        ss.casing_motion(tent, angles=0.0, radius=1.0, speed=1.0, orders=20, lobes=2)
    ss.casing_motion(tent, angles=0.0, radius=1.0, speed=1.0, orders=31)  # within a hundredth: nothing is said


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_edges_on_round_places() -> None:
    """A square profile: rounding decides the height at 0 and a turn later, which is no fault."""
    rub = ss.casing_motion(lambda a: np.sign(np.sin(a)), angles=0.0, radius=1.0, speed=1.0, orders=5)
    assert [rub.normal_sin[m] for m in (1, 3, 5)] == pytest.approx([4 / (math.pi * m) for m in (1, 3, 5)], rel=1e-3)


GIVEN = {"angles": [0.0, 1.0], "radius": 1.0, "speed": 2.0}
BAD = [
    (
        lambda a: a,
        {},
        "profile: found 0.123 at angle 0.123 but 6.40619 a turn later; expected a function with period 2 pi",
    ),
    (lambda a: math.nan, {}, "expected a function of the angle with finite heights"),
    ([[0.0, 1.0], [1.0, 2.0]], {}, "found a table of shape (2, 2)"),
    ([[0.0, 1.0], [2.0, 2.0], [1.0, 1.0]], {}, "row 3 has an angle not above the one before"),
    ([[0.0, 1.0], [90.0, 2.0], [180.0, 1.0]], {}, "from 0 to 180; expected at most one turn, 2 pi rad"),
    ([[0.0, 1.0], [2.0, 2.0], [TURN, 2.0]], {}, "found 1 in the first row but 2 a turn later"),
    ("round", {}, "profile: found 'round'; expected a function of the angle"),
    (math.cos, {"speed": 0.0}, "speed: found 0"),
    (math.cos, {"radius": -1.0}, "radius: found -1; expected a length > 0"),
    (math.cos, {"radius": [1.0, 1.0, 1.0]}, "the numbers of elements do not agree"),
    (math.cos, {"lobes": 0}, "lobes: found 0"),
    (math.cos, {"orders": -1}, "harmonics: found -1"),
    (math.cos, {"angles": "top"}, "angles: found 'top'; expected an angle in rad"),
]


@pytest.mark.parametrize("profile, change, words", BAD)
def test_wrong_arguments_are_refused(profile, change, words: str) -> None:
    with pytest.raises(ss.InputError) as error:
        ss.casing_motion(profile, **{**GIVEN, **change})
    assert words in str(error.value)


def test_the_page_on_casings() -> None:
    page = (Path(__file__).parents[2] / "docs" / "lobed-casing.md").read_text(encoding="utf-8")
    block, *_ = re.findall(r"```python\n(.*?)```", page, re.S)
    names: dict[str, Any] = {}
    exec(compile(block, "lobed-casing.md", "exec"), names)
    assert names["rub"].normal_cos[1] == pytest.approx([3e-4, -3e-4])
    (line,) = re.findall(r"```toml\n(.*?)```", page, re.S)
    assert tomllib.loads(line)["rubbing"] == {"velocity": names["rub"].velocity[0], "normal_cos": {"1": 3e-4}}


def test_a_speed_that_sweeps_is_the_same_at_each_frequency():
    profile, places = {"cos": {2: 3e-4, 4: 1e-5}, "sin": {6: -2e-5}}, {"angles": [0.1, 2.0], "radius": [0.4, 0.5]}
    swept = ss.casing_motion(profile, **places, lobes=2)
    for speed in (300.0, 700.0):
        fixed = ss.casing_motion(profile, **places, speed=speed, lobes=2)
        np.testing.assert_allclose(swept.speed(2.0 * speed), fixed.speed(2.0 * speed), rtol=1e-14)
        assert swept.normal_cos.keys() == fixed.normal_cos.keys() == {1, 2, 3}
        for part in ("normal_cos", "normal_sin"):
            for order, value in getattr(fixed, part).items():
                np.testing.assert_array_equal(getattr(swept, part)[order], value)
    back, turned = (
        ss.casing_motion(profile, **places, lobes=2, backward=True),
        ss.casing_motion(profile, **places, speed=-1.0, lobes=2),
    )
    np.testing.assert_array_equal(back.velocity_per_omega, 0.5 * turned.velocity)
    np.testing.assert_array_equal(back.normal_sin[1], turned.normal_sin[1])
    with raises_fault("backward", statement="is given with a speed"):
        ss.casing_motion(profile, **places, speed=3.0, backward=True)


def test_a_profile_may_be_its_series_or_round():
    series, function = (
        ss.casing_motion(p, angles=0.3, radius=0.4, speed=1.0)
        for p in (
            {"cos": {0: 1e-4, 2: 3e-4}, "sin": {3: 2e-5}},
            lambda a: 1e-4 + 3e-4 * np.cos(2 * a) + 2e-5 * np.sin(3 * a),
        )
    )
    for part in ("normal_cos", "normal_sin"):
        own, other = getattr(series, part), getattr(function, part)
        assert own.keys() == other.keys()
        np.testing.assert_allclose([own[m] for m in own], [other[m] for m in own], atol=1e-17)
    assert ss.casing_motion({}, angles=0.3, radius=0.4).orders == ()
    for wrong in ({"cosine": {2: 1.0}}, {"cos": {2: "high"}}, {"cos": {-2: 1.0}}, {"cos": {2: [1.0, 2.0]}}):
        with pytest.raises(InputError, match="profile"):
            ss.casing_motion(wrong, angles=0.3, radius=0.4)


class _Wave:
    def __init__(self, engine_order: int) -> None:
        self.around = Around(12, engine_order, whole=False)


@pytest.mark.parametrize(("engine_order", "sign"), [(-4, 1.0), (4, -1.0)])
def test_a_wave_meets_lobes_with_its_own_symmetry(engine_order: int, sign: float) -> None:
    """Every blade's own motion is that of sector 0 with its delay; numbered with (E < 0) or against the rotation."""
    sectors, profile = 12, {"cos": {4: 2e-4, 8: 1e-4}, "sin": {4: -1e-4}}
    own = ss.casing_motion(profile, angles=0.0, radius=0.4, wave=_Wave(engine_order))
    every = 2 * np.pi * np.arange(sectors) / sectors  # angles grow with the numbers
    blades = ss.casing_motion(profile, angles=every, radius=0.4, lobes=4, backward=sign < 0)
    assert float(own.velocity_per_omega) == pytest.approx(sign * 0.1)
    for m in (1, 2):
        z0 = own.normal_cos[m] - 1j * own.normal_sin.get(m, 0.0)
        delayed = z0 * np.exp(-1j * m * 2 * np.pi * engine_order * np.arange(sectors) / sectors)
        found = np.asarray(blades.normal_cos[m]) - 1j * np.asarray(blades.normal_sin.get(m, 0.0))
        np.testing.assert_allclose(found, delayed, atol=1e-15)


@pytest.mark.parametrize(
    ("more", "fragments"),
    [
        ({"wave": _Wave(4)}, ("lobe numbers 2, 6", "multiples of 4")),
        ({"wave": _Wave(0)}, ("engine order 0",)),
        ({"wave": _Wave(2), "lobes": 2}, ("lobes", "together with wave")),
        ({"wave": _Wave(2), "speed": 3.0}, ("speed", "< 0")),
        ({"wave": 3}, ("wave", "travelling wave")),
    ],
)
def test_lobes_without_the_symmetry_of_a_wave(more: dict, fragments: tuple[str, ...]) -> None:
    """Refused in words."""
    with pytest.raises(InputError) as raised:
        ss.casing_motion({"cos": {2: 1e-4, 6: 1e-4, 8: 1e-4}}, angles=0.0, radius=0.4, **more)
    for fragment in fragments:
        assert fragment in str(raised.value)
