"""What an engineer asks of the oscillator: worst velocity, best normal load, stability, damping over amplitude."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slipstick as ss

OMEGA, VELOCITIES = (2.0, 15.0), (1.0, 300.0)
FINE = {"max_step": 0.03}


def problem(velocity=0.0):
    """Petrov's oscillator under its load; the contact rubs at a velocity."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    contact = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    damper = ss.ContactPair(name="damper", tangential="x", contact=contact, rubbing=ss.RubbingMotion(velocity=velocity))
    load = ss.Load(dof="x", sin=100.0)
    return ss.Problem(structure, contacts=damper, loads=load, harmonics=range(11), title="One oscillator, its answers")


def compute():
    """The two peaks over the rubbing velocity, each from where it is the highest; curves; loads; the free vibration."""
    return {
        "from fast": ss.track_peak(problem(), "damper.velocity", VELOCITIES[::-1], omega=OMEGA, options=FINE),
        "from slow": ss.track_peak(problem(), "damper.velocity", VELOCITIES, omega=OMEGA, options=FINE),
        "curves": {v: ss.forced_response(problem(v), omega=OMEGA, stability=True) for v in (0.0, 10.0, 50.0, 250.0)},
        "loads": ss.track_peak(problem(), "damper.normal_load", (300.0, 800.0), omega=OMEGA, options=FINE),
        "free": ss.nonlinear_modes(problem(), amplitude=(2.0, 80.0)),
    }


def draw(found, folder):
    """One figure of four."""
    figure = Figure(figsize=(10, 7.5), layout="constrained")
    axes = figure.subplots(2, 2)
    for name in ("from fast", "from slow"):
        data = found[name].dataset
        axes[0, 0].plot(data.parameter, data.amplitude.sel(dof="x"), label=name)
    axes[0, 0].set(xlabel="rubbing velocity", ylabel="peak amplitude", xscale="log", yscale="log")
    axes[0, 0].legend()
    ss.plots.stability({f"v = {v:g}": curve for v, curve in found["curves"].items()}, ax=axes[0, 1])
    found["loads"].plot.response("x", ax=axes[1, 0])
    ss.plots.damping(found["free"], ax=axes[1, 1])
    for axis, ticks in (
        (axes[0, 0].xaxis, (1, 3, 10, 30, 100, 300)), (axes[0, 0].yaxis, (2, 4, 10, 20, 40)),
        (axes[1, 1].xaxis, (2, 5, 10, 20, 50)),
    ):  # fmt: skip
        axis.set_ticks(ticks, labels=[str(tick) for tick in ticks])
        axis.set_ticks([], minor=True)
    figure.savefig(folder / "oscillator_answers.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    found = compute()
    fast = found["from fast"].dataset
    worst = fast.isel(point=int(np.argmax(fast.amplitude.sel(dof="x").values)))
    print(f"worst: {float(worst.amplitude[0]):.3f} at {float(worst.omega):.3f} rad/s")
    best = ss.optimal(problem(), "damper.normal_load", omega=OMEGA)
    print(f"best normal load {best.value:.3f}: {best.amplitude:.5f} at {best.omega:.5f} rad/s")
    for v, curve in found["curves"].items():
        print(f"velocity {v:g}: largest multiplier {float(curve.dataset.multiplier_max.max()):.3f}")
    free = found["free"].dataset
    most = free.isel(point=int(np.argmax(free.modal_damping.values)))
    print(f"most damping {float(most.modal_damping):.3f} at amplitude {float(most.modal_amplitude):.2f}")
    draw(found, folder)
