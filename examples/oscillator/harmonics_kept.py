"""The effect of the harmonics kept, at rubbing velocity 10 (Petrov 2012, Fig. 8): even ones are needed."""

import sys
from pathlib import Path

from matplotlib.figure import Figure
from oscillator import oscillator

import slipstick as ss

SETS = {"0..3": range(4), "0..7": range(8), "0..10": range(11), "0 and odd": [0, 1, 3, 5, 7, 9]}


def compute(requested=()):
    """One branch for each set of harmonics, with points at exactly the requested frequencies."""
    return {
        name: ss.forced_response(oscillator(velocity=10.0, harmonics=kept), omega=(2.0, 15.0), requested=requested)
        for name, kept in SETS.items()
    }


def draw(branches, folder):
    figure = Figure(figsize=(7, 4.5), layout="constrained")
    ax = figure.subplots()
    for name, branch in branches.items():
        branch.plot.response("x", ax=ax, label=name)
    ax.legend(title="harmonics kept")
    figure.savefig(folder / "oscillator_harmonics_kept.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    branches = compute()
    for name, branch in branches.items():
        peaks = ", ".join(f"{a:.3f} at {w:.3f} rad/s" for w, a in branch.peaks("x"))
        print(f"harmonics {name:9s}: peaks {peaks}")
    draw(branches, folder)
