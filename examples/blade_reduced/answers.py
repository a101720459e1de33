"""What an engineer asks of the reduced blade: is it stable, what matters, where does the peak go, how much damping."""

import sys
import time
import warnings
from pathlib import Path

import numpy as np
from blade import blade
from matplotlib.figure import Figure

import slipstick as ss
from slipstick.plots.style import styled

HERTZ = (195.0, 240.0)
RANGE = (2 * np.pi * HERTZ[0], 2 * np.pi * HERTZ[1])
CHECKED = (0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 8.0)
PARAMETERS = ("*.mu", "*.kt", "*.kn", "*.gap", "*.velocity", "loss_factor", "load.pressure.1.amplitude")


def answers(problem):
    """Curve with stability, derivatives by every parameter, locus of the peak over the velocity; seconds of each."""
    clock = [time.process_time()]
    branch = ss.forced_response(problem, omega=RANGE, peaks_of=["n1y"], stability=True)
    clock.append(time.process_time())
    slopes = branch.sensitivity(dof="n1y")
    clock.append(time.process_time())
    locus = ss.track_peak(problem, "*.velocity", (0.1, 10.0), omega=RANGE, dof="n1y")
    clock.append(time.process_time())
    return branch, slopes, locus, np.diff(clock)


def modes():
    """Free vibration in the first mode at rest, under slow and under fast rubbing."""
    return {v: ss.nonlinear_modes(blade(100.0, v), amplitude=(1e-6, 1e-2), dof="n1y") for v in (0.0, 1.0, 5.0)}


def highest(velocity):
    """Amplitude of the highest peak of a whole curve."""
    curve = ss.forced_response(blade(100.0, velocity), omega=RANGE, peaks_of=["n1y"])
    return max(amplitude for _, amplitude in curve.peaks("n1y"))


def draw(branch, locus, damped, folder):
    figure = Figure(figsize=(11, 8), layout="constrained")
    (curve, tornado), (moving, damping) = figure.subplots(2, 2)
    styled(moving, "Rubbing velocity [m/s]", "Highest amplitude of n1y [mm]")
    styled(damping, "Amplitude of free vibration of n1y [mm]", "Damping ratio, first mode")
    branch.plot.response("n1y", ax=curve, frequency="Hz", log=True)
    curve.set_xlim(208.0, 216.0)
    curve.set_title("100 % normal load, 1 m/s: solid is stable")
    branch.plot.tornado(dict.fromkeys(PARAMETERS, 0.1), dof="n1y", ax=tornado)
    tornado.set_title("what its peak depends on")
    data = locus.dataset
    moving.plot(data.parameter, 1e3 * data.amplitude.sel(dof="n1y"), label="locus")
    moving.plot(CHECKED, [1e3 * highest(v) for v in CHECKED], "ko", mfc="none", label="whole curves")
    moving.legend()
    for v, mode in damped.items():
        free = mode.dataset
        damping.loglog(1e3 * free.modal_amplitude, free.modal_damping, label=f"{v:g} m/s")
    damping.legend()
    figure.savefig(folder / "answers_blade.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", ss.SlipstickWarning)
    branch, slopes, locus, seconds = answers(blade(100.0, 1.0))
    largest = float(branch.dataset.multiplier_max.max())
    print(f"largest multiplier {largest:.4f}, {slopes.sizes['parameter']} parameters")
    print("seconds for stability, sensitivities, locus: {:.2f}, {:.2f}, {:.2f}".format(*seconds))
    best = ss.optimal(blade(10.0, 0.0), "*.gap", omega=(2 * np.pi * 195.0, 2 * np.pi * 330.0), dof="n1y")
    print(f"best gap without rubbing {best.value:.4e} m: {best.amplitude:.4e} m, {best.factorisations} factorisations")
    draw(branch, locus, modes(), folder)
