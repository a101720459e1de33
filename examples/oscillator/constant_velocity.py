"""Constant rubbing velocity from 0 to 250: amplitude and mean position (Petrov 2012, Figs. 6 and 7)."""

import sys
from pathlib import Path

from matplotlib.figure import Figure
from oscillator import oscillator

import slipstick as ss

VELOCITIES = (0.0, 1.0, 10.0, 20.0, 50.0, 100.0, 250.0)


def compute():
    """One branch for each velocity, from omega = 2 to 15 rad/s."""
    return {v: ss.forced_response(oscillator(velocity=v), omega=(2.0, 15.0)) for v in VELOCITIES}


def draw(branches, folder):
    figure = Figure(figsize=(7, 8), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    for v, branch in branches.items():
        branch.plot.response("x", ax=top, label=f"v = {v:g}")
        branch.plot.mean("x", ax=bottom, label=f"v = {v:g}")
    top.set_yscale("log")
    top.legend(title="rubbing velocity")
    figure.savefig(folder / "oscillator_constant_velocity.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    branches = compute()
    for v, branch in branches.items():
        peaks = ", ".join(f"{a:.3f} at {w:.3f} rad/s" for w, a in branch.peaks("x"))
        print(f"v = {v:5g}: {branch.dataset.sizes['point']:3d} points, peaks {peaks}")
    draw(branches, folder)
