"""Vibration excited by the rub alone: no load, u = a cos(omega t), a = 1 .. 50 (Petrov 2012, Fig. 11)."""

import sys
from pathlib import Path

from matplotlib.figure import Figure
from oscillator import oscillator

import slipstick as ss

AMPLITUDES = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)


def compute():
    """One branch for each amplitude of the rubbing motion."""
    return {a: ss.forced_response(oscillator(cos={1: a}, force=0.0), omega=(2.0, 15.0)) for a in AMPLITUDES}


def draw(branches, folder):
    figure = Figure(figsize=(7, 4.5), layout="constrained")
    ax = figure.subplots()
    for a, branch in branches.items():
        branch.plot.response("x", ax=ax, label=f"a = {a:g}")
    ax.legend(title="u = a cos(omega t)")
    figure.savefig(folder / "oscillator_rub_excited.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    branches = compute()
    for a, branch in branches.items():
        peaks = ", ".join(f"{x:.3f} at {w:.3f} rad/s" for w, x in branch.peaks("x"))
        print(f"a = {a:5g}: peaks {peaks}")
    draw(branches, folder)
