"""Petrov's study of a rubbed blade, 32 curves: results.csv, the curves as netCDF, and the figures of docs/blade.md.

    python examples/blade/study.py [small | medium | large] [--output FOLDER] [--cache FOLDER]

The first run of a size reduces the finite element model; later ones read it from the cache.
"""

import argparse
import csv
import time
from dataclasses import dataclass
from pathlib import Path

import blade_figures
import numpy as np
from shrouded_blade import DEFAULT_CACHE, OUTPUT, RANGE, highest, reduced_blade, rubbed, total_power

import slipstick as ss

LOADS = (10, 20, 40, 100, 200, 400, 1000)
RUBBED_LOADS = (40, 100, 400)
VELOCITIES = (0.0, 0.01, 0.1, 1.0, 2.0, 5.0, 10.0)
HOT_LOAD = 20
HOT_VELOCITIES = (0.0, 0.1, 2.0, 5.0)


@dataclass(frozen=True)
class Curve:
    """What sets one curve of the study apart: normal load in percent, velocity in m/s, mu of temperature or not."""

    load: float
    velocity: float
    hot: bool = False

    @property
    def name(self):
        return f"load-{self.load:g}_velocity-{self.velocity:g}" + ("_hot" if self.hot else "")


def curves():
    """All of them, each once."""
    wanted = [Curve(load, 0.0) for load in LOADS]
    wanted += [Curve(load, v) for load in RUBBED_LOADS for v in VELOCITIES]
    wanted += [Curve(HOT_LOAD, v, hot) for v in HOT_VELOCITIES for hot in (False, True)]
    return list(dict.fromkeys(wanted))


def respond(blade, curve):
    """One branch over the whole range."""
    return ss.forced_response(rubbed(blade, curve.load, curve.velocity, hot=curve.hot), omega=RANGE, peaks_of=OUTPUT)


def limits(blade):
    """Linear responses without contacts and with all of them stuck, refined around their resonances."""
    found = {}
    for state in ("free", "stuck"):
        problem, omega = rubbed(blade, 100, 0.0), np.linspace(RANGE[0], RANGE[1], 2001)
        for width in (0.01, 5e-4):
            amplitude = ss.linear_response(problem, omega=omega, state=state).dataset.amplitude.sel(dof=OUTPUT)
            peak = omega[int(np.argmax(amplitude.values))]
            omega = np.sort(np.append(omega, peak * (1 + width * np.linspace(-1, 1, 801))))
        found[state] = ss.linear_response(problem, omega=omega, state=state)
    return found


def row(curve, branch):
    """The numbers of one curve."""
    data, power = branch.dataset, total_power(branch)
    hertz, amplitude = highest(branch)
    numbers = {
        "normal_load_percent": curve.load,
        "velocity_m_per_s": curve.velocity,
        "mu_of_temperature": int(curve.hot),
        "peak_Hz": hertz,
        "peak_m": amplitude,
        "amplitude_at_start_m": float(data.amplitude.sel(dof=OUTPUT)[0]),
        "zero_harmonic_at_start_m": float(data["mean"].sel(dof=OUTPUT)[0]),
        "power_at_start_W": power[0],
        "highest_power_W": power.max(),
        "highest_temperature_C": float(data.temperature.max()) if curve.hot else "",
        "lowest_mu": float(data.friction_coefficient.min()),
        "points": len(branch),
        "evaluations": data.attrs["evaluations"],
        "seconds": data.attrs["seconds"],
    }
    return {k: f"{v:.6g}" if isinstance(v, float) else v for k, v in numbers.items()} | {"outcome": branch.outcome.name}


def run(size="small", *, output=Path("blade-study"), cache=DEFAULT_CACHE, report=print):
    """The whole study: reduction, curves, table, figures. Returns the branches by curve and the linear limits."""
    output.mkdir(parents=True, exist_ok=True)
    began = time.perf_counter()
    blade = reduced_blade(size, cache=cache)
    how = "read from the cache" if blade.reused else f"reduced with {blade.solver}"
    report(f"{size} blade, {blade.n_dofs} degrees of freedom, {how}: {time.perf_counter() - began:.1f} s")
    branches, rows = {}, []
    wanted = curves()
    for number, curve in enumerate(wanted, 1):
        branch = respond(blade, curve)
        branch.save(output / f"{curve.name}.nc")
        branches[curve] = branch
        rows.append(row(curve, branch))
        friction = "mu(T)" if curve.hot else ""
        report(
            f"{number:2d}/{len(wanted)}  {curve.load:4g} %  {curve.velocity:5g} m/s  {friction:5s}  "
            "peak {peak_m} m at {peak_Hz} Hz, {points} points, {evaluations} evaluations, "
            "{seconds} s, {outcome}".format(**rows[-1])
        )
    with open(output / "results.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    linear = limits(blade)
    blade_figures.draw(blade, size, branches, linear, output)
    report(f"{len(wanted)} curves, table and figures in {output}: {time.perf_counter() - began:.1f} s in all")
    return branches, linear


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Petrov's study of a rubbed turbine blade")
    parser.add_argument("size", nargs="?", default="small", choices=("small", "medium", "large"))
    parser.add_argument("--output", type=Path, default=Path("blade-study"))
    parser.add_argument("--cache", type=Path, default=DEFAULT_CACHE)
    given = parser.parse_args()
    run(given.size, output=given.output, cache=given.cache)
