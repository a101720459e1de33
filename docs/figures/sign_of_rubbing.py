"""Make sign_of_rubbing.svg: which way a contact slides, and which way friction pushes it (THEORY.md (1.5))."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

HERE = Path(__file__).parent
SIDE, SURFACE, FORCE = "#1f5fa8", "#555555", "#c03a2b"


def arrow(ax: Axes, start: float, end: float, y: float, colour: str, text: str) -> None:
    """An arrow along x with its meaning above it."""
    style = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.8}
    ax.annotate("", (end, y), (start, y), arrowprops=style)
    ax.text((start + end) / 2, y + 0.12, text, color=colour, ha="center", fontsize=9)


def structure(ax: Axes, place: float, name: str) -> None:
    """A wall, a spring and a mass in its mean position, against its place without friction."""
    x = np.linspace(-2.6, place - 0.6, 60)
    inner = (x > x[4]) & (x < x[-5])
    ax.plot(x, 0.55 + 0.14 * inner * np.sin(np.linspace(0, 12 * np.pi, 60)), color=SIDE, linewidth=1.2)
    ax.plot([-2.6, -2.6], [0.1, 1.0], color=SURFACE, linewidth=3)
    ax.add_patch(Rectangle((place - 0.6, 0.06), 1.2, 0.9, facecolor="#dbe7f5", edgecolor=SIDE))
    ax.text(place, 0.5, name, ha="center", va="center", color=SIDE, fontsize=9)
    ax.plot([0, 0], [-0.25, 1.25], ":", color="black", linewidth=0.9)
    ax.text(0, 1.3, "x = 0", ha="center", fontsize=8)


def draw() -> Figure:
    """A pad on a belt, and a blade in a casing."""
    figure = Figure(figsize=(9.6, 3.4), layout="constrained")
    belt, casing = figure.subplots(1, 2)
    structure(belt, 0.5, "pad")
    belt.plot([-2.2, 2.2], [0.02, 0.02], color=SURFACE, linewidth=2.5)
    belt.plot([-2.2, 2.2], [-0.7, -0.7], color=SURFACE, linewidth=2.5)
    for x in (-2.2, 2.2):
        belt.add_patch(Circle((x, -0.34), 0.36, facecolor="white", edgecolor=SURFACE, linewidth=2))
    arrow(belt, -0.9, 0.9, -0.42, SURFACE, "the belt moves at +V")
    belt.set_title("a pad that a belt carries along: velocity = -V", fontsize=10)
    arrow(belt, 1.2, 2.3, 0.55, FORCE, "friction")
    belt.text(0, -1.15, "mean x > 0: with the belt", ha="center", fontsize=9)

    structure(casing, -0.5, "blade")
    casing.add_patch(Rectangle((-2.4, -0.5), 4.8, 0.5, facecolor="#e8e8e8", edgecolor=SURFACE, hatch="//"))
    casing.text(0, -0.78, "casing at rest; seen from the rotor it moves at -V", color=SURFACE, ha="center", fontsize=9)
    arrow(casing, 0.5, 2.3, 1.05, SIDE, "the rotor runs at +V")
    arrow(casing, 1.7, 0.3, 0.35, FORCE, "friction")
    casing.set_title("a blade that runs in a casing: velocity = +V", fontsize=10)
    casing.text(0, -1.15, "mean x < 0: held back", ha="center", fontsize=9)
    for ax in (belt, casing):
        ax.annotate("", (-1.5, 1.5), (-2.4, 1.5), arrowprops={"arrowstyle": "-|>", "color": "black"})
        ax.text(-1.4, 1.5, "x", va="center", fontsize=9)
        ax.set(xlim=(-2.8, 2.8), ylim=(-1.3, 1.75), aspect="equal")
        ax.axis("off")
    figure.suptitle("w = x + u: side 1 slides by +u, the opposing surface itself moves by -u", fontsize=11)
    return figure


if __name__ == "__main__":
    with mpl.rc_context({"svg.hashsalt": "slipstick", "svg.fonttype": "none"}):
        draw().savefig(HERE / "sign_of_rubbing.svg", metadata={"Date": None})
