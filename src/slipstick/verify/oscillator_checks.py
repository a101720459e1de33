"""Rows: the claims of Petrov 2012 about the oscillator (C1 to C16), as numbers, and the order of truncation."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np

from slipstick.results.contacts import states_at
from slipstick.typing import Array
from slipstick.verify import closed_forms as cf
from slipstick.verify.cases import DAMPING, EXACT_OSCILLATOR, LOAD, MASS, SLIP_OFFSET, STIFFNESS, oscillator
from slipstick.verify.checks import Check, ExpectedFound

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions


RANGE = (2.0, 15.0)
RESONANCE = float(np.sqrt(STIFFNESS))
GRID = tuple(np.round(np.arange(2.0, 15.001, 0.05), 10))


@cache
def curve(velocity: float, harmonics: tuple[int, ...] = tuple(range(11)), drive: float = 0.0) -> Solutions:
    """The response curve; with ``drive``, ``u = drive cos(omega t)`` instead of the load."""
    from slipstick.analysis.curve.response import forced_response

    problem = oscillator(
        velocity=velocity, harmonics=harmonics, load=0.0 if drive else LOAD, cos={1: drive} if drive else None
    )
    solved = {"max_step": 1 / 120, "output_step": 1.0}
    return forced_response(problem, omega=RANGE, at=GRID if velocity == 10.0 else (), options=solved)


@cache
def point(velocity: float, omega: float, highest: int = 10) -> tuple[float, float, float]:
    """Mean, amplitude and stick fraction at one frequency."""
    from slipstick.analysis.curve.response import forced_response

    problem = oscillator(velocity=velocity, harmonics=range(highest + 1))
    branch = forced_response(problem, omega=(omega, omega * 1.001))
    d = branch.dataset.isel(point=0)
    return float(d["mean"][0]), float(d["amplitude"][0]), float(d["stick_fraction"][0])


def peaks(velocity: float, drive: float = 0.0) -> list[tuple[float, float]]:
    """Peaks (omega, amplitude) of a curve, the largest first."""
    return sorted(curve(velocity, drive=drive).peaks("x"), key=lambda peak: -peak[1])


def _values(name: str, velocity: float, drive: float = 0.0) -> Array:
    return np.asarray(curve(velocity, drive=drive).dataset[name])[:, 0]


def _slip_offset() -> ExpectedFound:
    return SLIP_OFFSET, float(_values("mean", 250.0).max())


def _most_stick() -> ExpectedFound:
    return 0.0, float(_values("stick_fraction", 250.0).max())


def _undamped_by_friction() -> ExpectedFound:
    """Largest difference of the v = 250 curve from the oscillator without damper."""
    omega, amplitude = _values_over_omega(250.0)
    exact = np.array([cf.slip_threshold(MASS, DAMPING, STIFFNESS, LOAD, w) / w for w in omega])
    return 0.0, float(np.abs(amplitude - exact).max())


def _values_over_omega(velocity: float) -> tuple[Array, Array]:
    return np.asarray(curve(velocity).dataset["omega"]), _values("amplitude", velocity)


def _threshold(velocity: float) -> ExpectedFound:
    return 0.0, point(velocity, RESONANCE)[2]


def _largest_mean(velocity: float, drive: float = 0.0) -> ExpectedFound:
    return 0.0, float(np.abs(_values("mean", velocity, drive)).max())


def _mean_at_peak() -> ExpectedFound:
    d = curve(1.0).dataset
    at = int(np.argmax(np.asarray(d["amplitude"])[:, 0]))
    return -0.19, float(d["mean"][at, 0])


def _peak(velocity: float, index: int, part: int, expected: float) -> ExpectedFound:
    return expected, peaks(velocity)[index][part]


def _mean(velocity: float, omega: float, expected: float) -> ExpectedFound:
    return expected, point(velocity, omega)[0]


def _deviation(harmonics: tuple[int, ...]) -> Array:
    """Relative difference of the amplitude from that with harmonics 0..10 on the common grid, v = 10."""
    reference, other = (_on_grid(curve(10.0, h)) for h in (tuple(range(11)), harmonics))
    return np.abs(other / reference - 1.0)


def _on_grid(branch: Solutions) -> Array:
    return np.array([float(branch.dataset["amplitude"][branch.at(w), 0]) for w in GRID])


def _seven_harmonics() -> ExpectedFound:
    return 1e-3, float(_deviation(tuple(range(8))).max())


def _three_harmonics() -> ExpectedFound:
    """Distance from 4 rad/s of the farthest frequency at which harmonics 0..3 differ by more than 2 %."""
    differing = np.array(GRID)[_deviation(tuple(range(4))) > 0.02]
    return 0.5, float(np.abs(differing - 4.0).max(initial=0.0))


def _odd_harmonics() -> ExpectedFound:
    return 0.3, float(_deviation((0, 1, 3, 5, 7, 9)).max())


def _drive_falls(index: int) -> ExpectedFound:
    """Largest step of the resonance frequency (0), or of amplitude over drive (1), from one drive to the next."""
    resonances = [peaks(0.0, drive=a)[0] for a in (1.0, 2.0, 5.0, 10.0, 20.0)]
    values = [
        w if index == 0 else size / a for (w, size), a in zip(resonances, (1.0, 2.0, 5.0, 10.0, 20.0), strict=True)
    ]
    return 0.0, float(np.diff(values).max())


def _odd_sticks(velocity: float) -> ExpectedFound:
    """How many points of a curve have an odd number of stick intervals a period (stuck all period not counted)."""
    branch = curve(velocity)
    sequences = ([name for *_, name in states_at(branch, k)["damper"]] for k in range(len(branch)))
    return 0.0, float(sum(names.count("stick") % 2 for names in sequences if len(names) > 1))


def _always_slips() -> ExpectedFound:
    return 1.0, max(float(_values("stick_fraction", v).max()) for v in (1.0, 10.0, 50.0))


def _best_loads() -> tuple[float, float]:
    """Normal loads of least resonance amplitude and of most dissipated power at resonance, v = 0."""
    from slipstick.analysis.curve.response import forced_response

    loads = np.geomspace(60.0, 1200.0, 14)
    amplitude, power = [], []
    for N in loads:
        branch = forced_response(oscillator(normal_load=float(N)), omega=(4.0, 15.0))
        at = int(np.argmax(np.asarray(branch.dataset["amplitude"])[:, 0]))
        amplitude.append(float(branch.dataset["amplitude"][at, 0]))
        power.append(float(branch.dataset["dissipated_power"][:, 0].max()))
    return float(loads[int(np.argmin(amplitude))]), float(loads[int(np.argmax(power))])


def _load_of_least_amplitude() -> ExpectedFound:
    least, most = _best_loads()
    return most, least


def _exact(velocity: float, omega: float, which: int, expected: float) -> ExpectedFound:
    return expected, point(velocity, omega)[which]


def truncation_error(velocity: float, omega: float, highest: Array) -> Array:
    """Largest error of x over the period, relative to the amplitude, for each highest harmonic kept."""
    from slipstick.analysis.curve.response import forced_response
    from slipstick.analysis.time_domain.transient import transient

    exact = transient(oscillator(velocity=velocity), omega, tolerance=1e-12)
    errors = []
    for h in highest:
        problem = oscillator(velocity=velocity, harmonics=range(int(h) + 1))
        X = forced_response(problem, omega=(omega, omega * 1.001)).dataset["displacement"].to_numpy()[0, 0]
        x = problem.harmonics.H_minus(omega * exact.time) @ X
        errors.append(np.abs(x - exact.displacement[:, 0]).max() / exact.amplitude[0])
    return np.array(errors)


def _truncation_order() -> ExpectedFound:
    """Order in the highest harmonic of the largest error over the period, of all exact cases together.

    The friction force has kinks: its coefficients fall like m^-2, those of the motion like m^-4, their sum like m^-3.
    """
    highest = np.array([7.0, 10.0, 14.0, 20.0, 28.0, 40.0])
    errors = np.max([truncation_error(v, w, highest) for v, w in EXACT_OSCILLATOR], axis=0)
    return -3.0, float(np.polyfit(np.log(highest), np.log(errors), 1)[0])


def _checks() -> Iterator[Check]:
    def row(
        name: str, what: str, compute: partial[ExpectedFound], tolerance: float = 0.0, relation: str = "="
    ) -> Check:
        return Check(name=name, what=what, compute=compute, tolerance=tolerance, relation=relation)

    drive = "u = 2 cos(omega t) alone"
    yield row("C1", "v = 250: mean -mu N0/k at all frequencies", partial(_slip_offset), 1e-9)
    yield row("C2", "v = 250: no stick at any frequency", partial(_most_stick), 1e-12)
    yield row("C2", "v = 250: amplitude as without damper", partial(_undamped_by_friction), 1e-6)
    yield row("C2", "v = 249.9 sticks at the natural frequency", partial(_threshold, 249.9), 0.0, ">")
    yield row("C3", "v = 250: amplitude at resonance", partial(_peak, 250.0, 0, 1, 39.548), 1e-3)
    yield row("C3", "v = 250: resonance frequency", partial(_peak, 250.0, 0, 0, 6.3182), 1e-4)
    yield row("C4", "v = 0: mean at all frequencies", partial(_largest_mean, 0.0), 1e-9)
    yield row("C5", "v = 1: mean at resonance", partial(_mean_at_peak), 0.005)
    yield row("C5", "v = 1: amplitude at resonance", partial(_peak, 1.0, 0, 1, 3.362), 0.003)
    yield row("C5", "v = 0: amplitude at resonance", partial(_peak, 0.0, 0, 1, 3.340), 0.003)
    yield row("C6", "v = 1: mean at omega = 1.5", partial(_mean, 1.0, 1.5, -5.04), 0.005)
    for v, k, w, a in (
        (10.0, 0, 4.25, 4.820),
        (10.0, 1, 9.84, 3.675),
        (50.0, 0, 5.82, 10.034),
        (100.0, 0, 6.14, 18.249),
    ):
        # frequencies of flat peaks were read from grids
        yield row("C7", f"v = {v:g}: amplitude of peak {k + 1}", partial(_peak, v, k, 1, a), 1e-3 * a)
        yield row("C7", f"v = {v:g}: frequency of peak {k + 1}", partial(_peak, v, k, 0, w), 4e-3 * w)
    yield row("C9", "v = 10: harmonics 0..7 as 0..10, largest difference", partial(_seven_harmonics), 0.0, "<")
    yield row("C10", "v = 10: harmonics 0..3 differ by 2 % only near 4 rad/s", partial(_three_harmonics), 0.0, "<")
    yield row("C11", "v = 10: zero and odd harmonics, largest difference", partial(_odd_harmonics), 0.0, ">")
    yield row("C12", f"{drive}: mean", partial(_largest_mean, 0.0, 2.0), 1e-12)
    yield row("C13", "drive alone: resonance falls with its amplitude", partial(_drive_falls, 0), 0.0, "<")
    yield row("C13", "drive alone: amplitude / drive falls", partial(_drive_falls, 1), 0.0, "<")
    yield row("C14", "v = 10: points with an odd number of sticks a period", partial(_odd_sticks, 10.0), 0.0, ">")
    yield row("C14", "v = 0: points with an odd number of sticks a period", partial(_odd_sticks, 0.0))
    yield row("C15", "v = 1, 10, 50: never stuck all period", partial(_always_slips), 0.0, "<")
    yield row(
        "C16", "v = 0: load of least amplitude over that of most power", partial(_load_of_least_amplitude), 0.0, ">"
    )
    for (v, w), (mean, amplitude) in EXACT_OSCILLATOR.items():
        for which, name, value in ((0, "mean", mean), (1, "amplitude", amplitude)):
            what = f"balance, v = {v:g}, omega = {w:g}: {name}"
            yield row("exact", what, partial(_exact, v, w, which, value), 1e-3 * max(abs(value), 1.0))
    yield row("order", "truncation error over the highest harmonic, order", partial(_truncation_order), 0.4)


OSCILLATOR_CHECKS = tuple(_checks())
