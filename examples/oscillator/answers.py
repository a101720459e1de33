"""What an engineer asks of the oscillator: worst rubbing velocity, best normal load, stability, damping."""

import sys
import warnings
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slipstick as ss
from slipstick.plots.style import styled

VELOCITIES = (0.0, 1.0, 10.0, 50.0, 100.0)
CHECKED = (1.0, 4.0, 6.0, 7.0, 9.0, 10.0, 12.0, 14.5, 18.0, 21.0, 25.0, 50.0, 100.0, 150.0, 200.0, 250.0, 300.0)
LOADED = (100.0, 200.0, 400.0, 700.0, 1000.0)
DRAWN = np.geomspace(0.5, 300.0, 50)
JUMP = 0.1
"""Change of the frequency from one point to the next, relative, that is a jump to another peak."""
SMALLEST = {0.0: 2.0, 1.0: 0.1, 10.0: 0.5, 50.0: 2.0, 100.0: 2.0}
"""Amplitudes at which the damper sticks (at rest) or only slides: there the nonlinear mode begins."""


def problem(velocity=0.0):
    """The oscillator of Petrov (2012), rubbed at a constant velocity."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    damper = ss.ContactPair(
        name="damper",
        contact=ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0),
        tangential="x",
        rubbing=ss.RubbingMotion(velocity=velocity),
    )
    return ss.Problem(structure, contacts=damper, loads=ss.Load(dof="x", sin=100.0), harmonics=range(11))


def loci():
    """Both peaks over the rubbing velocity: the upper one from rest, the lower one from fast rubbing down.

    Exact points stand so near to each other that a line through them is the locus on logarithmic axes too.
    """
    return {
        label: ss.track_peak(
            problem(),
            "damper.velocity",
            span,
            omega=(3.0, 12.0),
            at=DRAWN[(min(span) < DRAWN) & (max(span) > DRAWN)],
        )
        for label, span in {"from 0 up": (0.0, 300.0), "from 100 down": (100.0, 0.5)}.items()
    }


def over_load():
    """The highest peak over the normal load, without rubbing."""
    return ss.track_peak(problem(), "damper.normal_load", (10.0, 1000.0), omega=(2.0, 15.0))


def stability():
    """Response curves with their Floquet multipliers."""
    return {
        f"v = {v:g}": ss.forced_response(problem(v), omega=(1.5, 15.0), stability=True)
        for v in (0.0, 1.0, 10.0, 50.0, 100.0, 250.0)
    }


def modes():
    """Free vibration over its amplitude."""
    return {v: ss.nonlinear_modes(problem(v), amplitude=(SMALLEST[v], 80.0)) for v in VELOCITIES}


def peaks_of_curves(changed, values):
    """``(value, omega, amplitude)`` of the peaks of whole response curves above 3 rad/s."""
    found = []
    for value in values:
        curve = ss.forced_response(changed(value), omega=(1.5, 15.0))
        found += [(value, omega, size) for omega, size in curve.peaks("x") if omega > 3.0]
    return np.array(found)


def peaks_alone(locus):
    """Parameter, amplitude and frequency of the peaks of a locus, with nan where one ends and another is followed on.

    Points at rest have no place on a logarithmic axis. Minima part two peaks, and so does a jump of the frequency.
    """
    data = locus.dataset
    rows = np.column_stack([data.parameter, data.amplitude[:, 0], data.omega])
    kept = (data.peak_dof.values >= 0) & (rows[:, 0] > 0.0)
    parted = np.diff(np.flatnonzero(kept)) > 1
    rows = rows[kept]
    jumps = np.abs(np.diff(rows[:, 2])) > JUMP * rows[1:, 2]
    return np.insert(rows, np.flatnonzero(parted | jumps) + 1, np.nan, axis=0).T


def draw_loci(followed, folder):
    """Height and frequency of both peaks; circles are peaks of whole curves."""
    figure = Figure(figsize=(10, 4.2), layout="constrained")
    checked = peaks_of_curves(problem, CHECKED)
    axes = figure.subplots(1, 2)
    for ax, column, name in zip(axes, (1, 2), ("Amplitude of the peak", "Frequency of the peak [rad/s]"), strict=True):
        styled(ax, "Rubbing velocity", name)
        for (label, locus), width in zip(followed.items(), (1.5, 4.0), strict=True):
            rows = peaks_alone(locus)
            wide = {"linewidth": width, "alpha": 1.0 if width < 2 else 0.4}
            ax.plot(rows[0], rows[column], "-", label=f"followed {label}", **wide)
        ax.plot(checked[:, 0], checked[:, 3 - column], "ko", mfc="none", ms=4, label="peaks of whole curves")
        ax.set(xscale="log", xlim=(0.5, 310.0))
    axes[0].set_yscale("log")
    axes[0].legend()
    figure.savefig(folder / "answers_velocity.png", dpi=120)


def draw_answers(curves, free, folder):
    """Best load, largest multiplier, damping and frequency over the amplitude."""
    figure = Figure(figsize=(10, 7.5), layout="constrained")
    (load, multipliers), (damping, frequency) = figure.subplots(2, 2)
    styled(load, "Normal load, v = 0", "Amplitude of the highest peak")
    styled(damping, "Amplitude of free vibration", "Damping ratio")
    styled(frequency, "Amplitude of free vibration", "Frequency [rad/s]")
    data = over_load().dataset
    load.plot(data.parameter, data.amplitude[:, 0])
    best = data.isel(point=data.kind.values == "optimum")
    load.plot(best.parameter, best.amplitude[:, 0], "o", label=f"best: {float(best.parameter[0]):.2f}")
    checked = peaks_of_curves(lambda value: problem().with_parameter("damper.normal_load", value), LOADED)
    load.plot(checked[:, 0], checked[:, 2], "ko", mfc="none", ms=4, label="whole curves")
    load.set_yscale("log")
    load.legend()
    ss.plots.stability(curves, ax=multipliers)
    multipliers.set_ylim(0.0, 1.05)
    multipliers.legend(loc="lower right", ncols=2, fontsize=8)
    for v, mode in free.items():
        data = mode.dataset
        damping.loglog(data.modal_amplitude, data.modal_damping, label=f"v = {v:g}")
        frequency.semilogx(data.modal_amplitude, data.omega, label=f"v = {v:g}")
    damping.legend()
    figure.savefig(folder / "answers_oscillator.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", ss.SlipstickWarning)
    followed, curves, free = loci(), stability(), modes()
    for label, locus in followed.items():
        worst = locus.dataset.isel(point=int(locus.dataset.amplitude[:, 0].argmax("point")))
        highest = f"{float(worst.amplitude[0]):.3f} at {float(worst.omega):.3f} rad/s, v = {float(worst.parameter):g}"
        print(f"{label}: {locus.message}; highest {highest}")
    best = ss.optimal(problem(), "damper.normal_load", omega=(2.0, 15.0))
    print(f"best normal load {best.value:.3f}: {best.amplitude:.5f} at {best.omega:.5f} rad/s")
    for label, curve in curves.items():
        print(f"{label}: largest multiplier {float(curve.dataset.multiplier_max.max()):.3f}")
    for v, mode in free.items():
        most = mode.dataset.isel(point=int(mode.dataset.modal_damping.argmax("point")))
        print(f"v = {v:g}: most damping {float(most.modal_damping):.3f} at amplitude {float(most.modal_amplitude):.2f}")
    draw_loci(followed, folder)
    draw_answers(curves, free, folder)
