"""Normal motion of contacts that run along the profile of a casing or disc."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.rubbing import RubbingMotion, amplitudes
from slipstick.errors import Fault, InputError
from slipstick.faults import (
    SMALLEST,
    Gathering,
    in_radians,
    number,
    number_or_numbers,
    numbers,
    same_length,
    truth,
    warn,
    whole,
    wrong,
)
from slipstick.trig.harmonics import HIGHEST, Harmonics
from slipstick.typing import Array, Frequency, Orders, Reals

Profile: TypeAlias = "Callable[[Any], Any] | Mapping[str, Mapping[int, float]] | Reals"

WARNED_PROFILE = 1e-2
"""Truncation error of a profile over its range, above which it is warned of."""

HIGHEST_LOBES = 360
"""Lobe numbers up to which the symmetry of a profile is checked for a wave."""

_FEWEST_SAMPLES = 8192
"""Angles at which a profile function is sampled, at least."""
_ZERO = 1e-13
"""Fourier coefficient, over the largest height, that is rounding."""
_NO_LOBES = 1e-9
"""Amplitude of a lobe number, over the range of the profile, that is rounding."""
_EXPECTED = (
    "a function of the angle (rad) with period 2 pi, a table of rows (angle, height) over one turn, or a series "
    'such as {"cos": {2: 3e-4}} by orders per turn'
)


@dataclass(frozen=True, kw_only=True)
class ProfileSeries:
    """``h(theta) = sum cos_m cos(m theta) + sin_m sin(m theta)``, m counted per turn.

    Attributes
    ----------
    orders, cos, sin
        The orders m and their coefficients, (n,) each, length.
    range
        Highest less lowest height of the profile itself, length.
    error
        Largest distance of the series from the profile, length.
    """

    orders: NDArray[np.int64]
    cos: Array
    sin: Array
    range: float
    error: float

    def height(self, angle: Reals) -> Array:
        """The series at angles (rad), same shape."""
        turned = np.asarray(angle, dtype=float)[..., None] * self.orders
        return np.asarray(np.cos(turned) @ self.cos + np.sin(turned) @ self.sin)


def profile_series(profile: Profile, orders: Iterable[int]) -> ProfileSeries:
    """Fourier series of a profile over one turn, with its error.

    A function is sampled at 8192 angles or more: finite Fourier series come out exactly. Between the rows of a table
    the profile is straight; its coefficients are those of that polygon, exactly.

    Parameters
    ----------
    profile
        As in ``casing_motion``.
    orders
        Whole orders per turn, >= 0.

    Raises
    ------
    InputError
        For a function without the period 2 pi, a table that is none, heights that are not finite.
    """
    m = np.array(sorted({whole("orders", order) for order in orders}), dtype=np.int64)
    profile = _summed(profile) if isinstance(profile, Mapping) else profile
    samples = max(_FEWEST_SAMPLES, 1 << int(16 * m.max(initial=1)).bit_length())
    angle = np.linspace(0.0, 2.0 * np.pi, samples, endpoint=False)
    if callable(profile):
        height = _sampled(profile, angle)
        coefficients = np.fft.rfft(height)[m] / samples
    else:
        at, corners = _corners(profile)
        coefficients = _of_polygon(at, corners, m)
        height = np.interp(angle, at, corners, period=2.0 * np.pi)
        angle, height = np.concatenate([angle, at]), np.concatenate([height, corners])
    coefficients = coefficients * np.where(m == 0, 1.0, 2.0)
    least = _ZERO * float(np.abs(height).max())
    cos, sin = (np.where(np.abs(c) > least, c, 0.0) for c in (coefficients.real, -coefficients.imag))
    series = ProfileSeries(orders=m, cos=cos, sin=sin, range=float(np.ptp(height)), error=0.0)
    missed = max(float(np.abs(series.height(a) - h).max()) for a, h in _slices(angle, height))
    return replace(series, error=missed)


def casing_motion(
    profile: Profile,
    *,
    angles: Reals,
    radius: Reals,
    speed: Frequency | None = None,
    orders: Orders = 10,
    lobes: int = 1,
    backward: bool = False,
    wave: Any = None,
) -> RubbingMotion:
    """Motion of a lobed, oval or eccentric opposing surface under the contacts of a rotor.

    A contact at ``angle`` runs along the profile with ``speed``: it meets the height ``h(angle + speed t)``, which
    moves the surface towards it, and slides with ``radius * speed``. The fundamental frequency ``omega`` is ``lobes *
    abs(speed)``; without a speed this is ``omega / lobes`` at every frequency, and the velocity grows with it.

    Parameters
    ----------
    profile
        Height towards the axis over the angle, length, positive where it closes the gap: a function of the angle in
        rad, of period 2 pi; a table of rows (angle, height) within one turn, straight in between; or a Fourier series
        ``{"cos": {2: 3e-4}, "sin": {}}`` by orders per turn. ``{}`` is a round one.
    angles
        Angular places of the contacts at t = 0 on the profile, rad; one, or (n_contacts,).
    radius
        Of the contacts about the axis, length > 0; one, or (n_contacts,).
    speed
        Of the contacts relative to the profile, rad/s, positive towards growing angles, not 0. The tangential
        directions of the contacts point towards growing angles too. A disc that turns under contacts at rest: its own
        speed with the opposite sign. None: it sweeps with the frequency.
    orders
        Orders of the fundamental frequency that are kept, as in ``Harmonics``.
    lobes
        Number of equal lobes, or the engine order of the fundamental frequency: with 2 that is twice the speed, and
        order 1 is the oval itself.
    backward
        Of a speed that sweeps: the contacts move towards falling angles.
    wave
        A travelling wave (``CyclicStructure.travelling_wave``), instead of ``lobes`` and ``backward``: the motion of
        the contact of its sector 0. With the engine order E of the fundamental frequency this is ``abs(E)`` times the
        speed, and sectors that are numbered in the sense of rotation (E < 0) move towards growing angles. The profile
        may have lobe numbers that are multiples of E alone: others do not repeat from sector to sector as the wave.

    Returns
    -------
    RubbingMotion
        With arrays (n_contacts,) where ``angles`` or ``radius`` are such.

    Raises
    ------
    InputError
        With one sentence for each argument that cannot be used.

    Warns
    -----
    SlipstickWarning
        Where the series misses the profile by more than a hundredth of its range (``profile_series`` gives the error).

    Examples
    --------
    >>> from math import cos, pi
    >>> rub = casing_motion(lambda a: 3e-4 * cos(2 * a), angles=[0.0, pi / 2], radius=0.4, speed=700.0, lobes=2)
    >>> rub.velocity, rub.normal_cos[1]
    (array([280., 280.]), array([ 0.0003, -0.0003]))
    >>> swept = casing_motion({"cos": {2: 3e-4}}, angles=0.0, radius=0.4, lobes=2)
    >>> float(swept.velocity_per_omega)
    0.2
    """
    if wave is not None:
        lobes, against = _of_wave(profile, wave, lobes, backward)
        backward = against and speed is None
    at, arm, turning, kept, count = _checked(angles, radius, speed, orders, lobes, backward)
    if wave is not None and (turning < 0.0) != against:
        expected = f"one {'< 0' if against else '> 0'}: angles grow with the numbers of the sectors"
        raise InputError(
            Fault("speed", found=f"{turning:g} with engine order {wave.around.engine_order}", expected=expected)
        )
    series = profile_series(profile, (count * order for order in kept.orders))
    _warn_of_error(series, count, kept)
    cos, sin = _in_time(series, at, float(np.sign(turning)))
    places = {int(m) // count: i for i, m in enumerate(series.orders) if series.cos[i] or series.sin[i]}
    slid = np.broadcast_to(arm * turning, np.broadcast_shapes(at.shape, arm.shape))
    return RubbingMotion(
        velocity=0.0 if speed is None else slid,
        velocity_per_omega=slid if speed is None else 0.0,
        normal_cos={order: cos[..., i] for order, i in places.items()},
        normal_sin={order: sin[..., i] for order, i in places.items() if order},
    )


def _of_wave(profile: Profile, wave: Any, lobes: int, backward: bool) -> tuple[int, bool]:
    """Engine order of the fundamental, and sense of rotation; InputError for a profile without the symmetry."""
    around = getattr(wave, "around", None)
    if around is None or around.whole:
        raise wrong("wave", wave, "a travelling wave, sector.travelling_wave(engine_order)")
    if lobes != 1 or backward:
        name = "lobes" if lobes != 1 else "backward"
        raise InputError(Fault(name, "is given together with wave", remedy="the engine order of the wave tells it"))
    E = around.engine_order
    if E == 0:
        raise InputError(Fault("wave", found="engine order 0", expected="one whose frequency is that of a rotation"))
    series = profile_series(profile, range(1, HIGHEST_LOBES + 1))
    size = np.hypot(series.cos, series.sin)
    others = series.orders[(size > _NO_LOBES * max(series.range, 1e-300)) & (series.orders % abs(E) != 0)].tolist()
    if others:
        some = ", ".join(map(str, others[:5])) + (", ..." if len(others) > 5 else "")
        found = f"lobe number{'s' if len(others) > 1 else ''} {some}"
        expected = f"multiples of {abs(E)}, which repeat from sector to sector as a wave of engine order {E}"
        remedy = "take a fundamental frequency of lower engine order, or the whole disc"
        raise InputError(Fault("profile", found=found, expected=expected, remedy=remedy))
    return abs(E), E > 0


def _checked(
    angles: Any, radius: Any, speed: Any, orders: Any, lobes: Any, backward: Any
) -> tuple[Array, Array, float, Harmonics, int]:
    """The checked arguments, with a sweeping speed for each rad/s; InputError with all faults."""
    checks = Gathering()
    at = checks.take(number_or_numbers, "angles", angles, "an angle in rad, or one for each contact")
    arm = checks.take(number_or_numbers, "radius", radius, "a length > 0, or one for each contact")
    kept = checks.take(Harmonics.of, orders)
    count = checks.take(whole, "lobes", lobes, 1, HIGHEST)
    turned = checks.take(truth, "backward", backward)
    if speed is None:
        turning: float | None = (-1.0 if turned else 1.0) / (count or 1)
    else:
        turning = checks.take(_turning, speed)
        if turned:
            checks.faults.append(Fault("backward", "is given with a speed", remedy="give a negative speed"))
    if arm is not None and np.any(np.asarray(arm) < SMALLEST):
        checks.faults.append(Fault("radius", found=f"{np.min(arm):g}", expected="a length > 0"))
    if turning is not None and abs(turning) < SMALLEST:
        checks.faults.append(Fault("speed", found="0", expected="a speed in rad/s other than 0"))
    checks.end()
    same_length("casing motion", {"angles": at, "radius": arm})
    assert kept is not None and count is not None and turning is not None  # noqa: PT018
    return np.asarray(at), np.asarray(arm), turning, kept, count


def _turning(speed: Any) -> float:
    return number("speed", in_radians("speed", speed), "a speed in rad/s other than 0, or None")


def _in_time(series: ProfileSeries, angle: Array, sign: float) -> tuple[Array, Array]:
    """Cosine and sine coefficients over time of ``h(angle + sign m t)``, (..., n)."""
    turned = angle[..., None] * series.orders
    c, s = np.cos(turned), np.sin(turned)
    return c * series.cos + s * series.sin, sign * (c * series.sin - s * series.cos)


def _warn_of_error(series: ProfileSeries, lobes: int, kept: Harmonics) -> None:
    if series.error <= WARNED_PROFILE * series.range:
        return
    equal = f", which have to be {lobes} equal lobes," if lobes > 1 else ""
    sentence = (
        f"profile: its Fourier series with orders up to {kept.highest}{equal} misses it by up to {series.error:.3g}, "
        f"{100.0 * series.error / series.range:.2g} % of its range {series.range:.3g}: keep more orders, or round off "
        "its edges"
    )
    warn([sentence])


def _summed(series: Mapping[Any, Any]) -> Callable[[Any], Any]:
    """The heights of a profile given by its Fourier series."""
    if set(series) - {"cos", "sin"}:
        raise wrong("profile", dict(series), _EXPECTED)
    checks = Gathering()
    parts = [(getattr(np, name), checks.take(amplitudes, ("profile", name), series.get(name, {}), 0))
             for name in ("cos", "sin")]  # fmt: skip
    checks.end()
    waves = [(wave, m, height) for wave, heights in parts for m, height in (heights or {}).items()]
    for _, m, height in waves:
        if m > HIGHEST or np.ndim(height):
            raise wrong("profile", dict(series), _EXPECTED)
    return lambda angle: sum((height * wave(m * np.asarray(angle)) for wave, m, height in waves), 0.0 * angle)


def _sampled(profile: Callable[[Any], Any], angle: Array) -> Array:
    """Heights (n,) of a function at angles (n,); InputError where they differ a turn later."""
    heights = _heights(profile, angle)
    probes = 0.123 + angle[:: max(1, angle.size // 16)]  # profiles have edges at round angles
    once, again = _heights(profile, probes), _heights(profile, probes + 2.0 * np.pi)
    differ = np.abs(again - once) > 1e-6 * max(float(np.ptp(heights)), 1e-6 * float(np.abs(heights).max()))
    if np.any(differ):
        at = int(np.argmax(differ))
        raise InputError(
            Fault(
                "profile",
                found=f"{once[at]:g} at angle {probes[at]:.4g} but {again[at]:g} a turn later",
                expected="a function with period 2 pi",
            )
        )
    return heights


def _heights(profile: Callable[[Any], Any], angle: Array) -> Array:
    try:
        returned = np.asarray(profile(angle))
    except Exception:  # a function of one number, such as math.cos
        returned = np.empty(0)
    if returned.shape != angle.shape:
        returned = np.asarray([profile(float(a)) for a in angle])
    heights = numbers("profile", returned, "a function of the angle with finite heights")
    if heights.shape != angle.shape:
        raise wrong("profile", returned, "a function with one height for each angle")
    return heights


def _corners(profile: Any) -> tuple[Array, Array]:
    """Angles in [0, 2 pi), increasing, and heights of a table."""
    table = numbers("profile", profile, _EXPECTED)
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < 3:
        raise InputError(
            Fault("profile", found=f"a table of shape {table.shape}", expected=f"{_EXPECTED}, at least 3 rows")
        )
    angle, height = table.T
    steps, turn = np.diff(angle), 2.0 * np.pi
    if np.any(steps <= 0.0):
        row = int(np.argmax(steps <= 0.0)) + 2
        raise InputError(
            Fault("profile", f"row {row} has an angle not above the one before", expected="growing angles")
        )
    if angle[-1] - angle[0] > turn * (1.0 + 1e-9):
        raise InputError(
            Fault("profile", f"its angles go from {angle[0]:g} to {angle[-1]:g}", expected="at most one turn, 2 pi rad")
        )
    if angle[-1] - angle[0] > turn * (1.0 - 1e-9):
        if abs(height[-1] - height[0]) > 1e-6 * np.ptp(height):
            raise InputError(
                Fault(
                    "profile",
                    found=f"{height[0]:g} in the first row but {height[-1]:g} a turn later in the last",
                    expected="the same height",
                )
            )
        angle, height = angle[:-1], height[:-1]
    order = np.argsort(angle % turn)
    return (angle % turn)[order], height[order]


def _of_polygon(angle: Array, height: Array, m: NDArray[np.int64]) -> NDArray[np.complex128]:
    """Complex coefficients of ``exp(i m theta)`` of a closed polygon, by the jumps of its slope."""
    width = np.diff(angle, append=angle[0] + 2.0 * np.pi)
    slope = np.diff(height, append=height[0]) / width
    jumps = slope - np.roll(slope, 1)
    positive = np.maximum(m, 1)
    coefficients = -(np.exp(-1j * positive[:, None] * angle) @ jumps) / (2.0 * np.pi * positive**2)
    mean = np.sum(width * (height + np.roll(height, -1))) / (4.0 * np.pi)
    return np.where(m == 0, mean, coefficients)


def _slices(angle: Array, height: Array, size: int = 1024) -> Iterable[tuple[Array, Array]]:
    """Parts of limited memory."""
    return ((angle[i : i + size], height[i : i + size]) for i in range(0, angle.size, size))
