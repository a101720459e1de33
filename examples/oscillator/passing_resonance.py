"""Passing through a resonance with rub.

The oscillator with a rubbing friction damper runs up: the faster, the later and the lower its peak.
"""

import sys
from pathlib import Path

import slipstick as ss

RATES = (0.2, 0.6)  # rad/s^2


def problem():
    """One mass, a damper with constant rubbing velocity, a unit load times 100."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    contact = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=300.0)
    damper = ss.ContactPair(name="damper", contact=contact, tangential="x", rubbing=ss.RubbingMotion(velocity=2.0))
    return ss.Problem(structure, contacts=damper, loads=ss.Load(dof="x", sin=100.0), harmonics=range(11))


def compute():
    """The steady curve, and runs up by rate."""
    case = problem()
    return ss.forced_response(case, omega=(4.0, 14.0)), {r: ss.runs.run_up(case, (4.0, 14.0), rate=r) for r in RATES}


def draw(steady, runs, folder):
    """Envelopes beside the steady curve, and spectra of the slow run."""
    for rate, run in runs.items():
        ax = ss.plots.run_up(run, "x", branch=steady)
        ax.set_title(f"{rate:g} rad/s^2")
        ax.figure.savefig(Path(folder) / f"passing_{rate:g}.png")
    ss.plots.spectrogram(runs[RATES[0]], "x").figure.savefig(Path(folder) / "passing_spectra.png")


if __name__ == "__main__":
    curve, passed = compute()
    for rate, run in passed.items():
        lag = run.lag(curve, "x")
        print(f"{rate:g} rad/s^2: {lag.amplitude:.3f} at {lag.omega:.3f}, steady {lag.steady_amplitude:.3f}")
    draw(curve, passed, sys.argv[1] if len(sys.argv) > 1 else ".")
