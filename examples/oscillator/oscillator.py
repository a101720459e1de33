"""The oscillator of Petrov (2012): one mass on a spring, rubbed by a friction contact under a constant normal load."""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import slipstick as ss


def oscillator(velocity=0.0, cos=None, force=100.0, harmonics=range(11)):
    """The problem; ``velocity`` and ``cos`` describe the rubbing motion, ``force`` the load p sin(omega t)."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    damper = ss.ContactPair(
        name="damper",
        contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0),
        tangential={"x": 1.0},
        rubbing=ss.RubbingMotion(velocity=velocity, cos=cos or {}),
    )
    loads = [ss.Load(dof="x", harmonic=1, sin=force)] if force else []
    return ss.Problem(structure, contacts=[damper], loads=loads, harmonics=ss.Harmonics(harmonics))


def draw(branches, name, legend, folder, *, mean=False, log=False):
    """Response curves of several branches by label, with the mean position below them if asked, as a PNG."""
    figure = Figure(figsize=(7, 8 if mean else 4.5), layout="constrained")
    axes = figure.subplots(2 if mean else 1, 1, sharex=True, squeeze=False)[:, 0]
    ss.plots.response(branches, "x", ax=axes[0], log=log)
    axes[0].get_legend().set_title(legend)
    if mean:
        ss.plots.mean(branches, "x", ax=axes[1])
        axes[1].get_legend().remove()
        axes[0].set_xlabel("")
    figure.savefig(folder / f"oscillator_{name}.png", dpi=120)


def main(compute, draw_into, label):
    """Run an example: peaks of every branch on the screen, called by the label, the figure in the folder given."""
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    branches = compute()
    for key, branch in branches.items():
        peaks = ", ".join(f"{amplitude:.3f} at {omega:.3f} rad/s" for omega, amplitude in branch.peaks("x"))
        print(f"{label} {key!s:>9}: {branch.dataset.sizes['point']:3d} points, peaks of x {peaks}")
    draw_into(branches, folder)
