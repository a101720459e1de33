"""Make engine_order.svg: which sign the engine order of a wave has (THEORY.md (24.1))."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

HERE = Path(__file__).parent
DISC, PATTERN, ARROW = "#1f5fa8", "#c03a2b", "#555555"
SECTORS, ENGINE_ORDER = 12, 2


def disc(ax: Axes, sense: int, title: str) -> None:
    """A disc that turns anticlockwise in a pattern fixed in space; blades numbered that way (1) or against (-1)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 400)
    height = 1.75 + 0.16 * np.cos(ENGINE_ORDER * angle)
    ax.plot(height * np.cos(angle), height * np.sin(angle), color=PATTERN, linewidth=1.6)
    ax.plot(0.7 * np.cos(angle), 0.7 * np.sin(angle), color=DISC)
    for s in range(SECTORS):
        at = sense * 2.0 * np.pi * s / SECTORS
        c, sn = np.cos(at), np.sin(at)
        ax.plot([0.7 * c, 1.3 * c], [0.7 * sn, 1.3 * sn], color=DISC, linewidth=3.0 if s < 2 else 1.6)
        ax.text(1.44 * c, 1.44 * sn, str(s), ha="center", va="center", fontsize=8, color=DISC)
    style = {"arrowstyle": "-|>", "mutation_scale": 12, "color": ARROW, "connectionstyle": "arc3,rad=0.35"}
    ax.add_patch(FancyArrowPatch((0.42, -0.1), (0.0, 0.42), **style))
    ax.text(0.0, -0.12, "rotation", ha="center", fontsize=8, color=ARROW)
    ax.set(aspect="equal", xlim=(-2.0, 2.0), ylim=(-2.0, 2.0), title=title)
    ax.axis("off")


def in_time(ax: Axes, sense: int) -> None:
    """What the first blades meet over time."""
    tau = np.linspace(0.0, 4.0 * np.pi, 300)
    engine_order = -sense * ENGINE_ORDER
    for s in range(3):
        delay = s * 2.0 * np.pi * engine_order / SECTORS
        ax.plot(tau, np.cos(tau - delay) - 2.4 * s, color=PATTERN, linewidth=1.3)
        ax.plot(2.0 * np.pi + delay, 1.0 - 2.4 * s, "o", color=ARROW, markersize=4)
        ax.text(-0.5, -2.4 * s, f"blade {s}", ha="right", va="center", fontsize=8, color=DISC)
    meets = "earlier" if sense > 0 else "later"
    ax.set(
        xlabel=r"$\tau$", yticks=[], xticks=[0.0, 2.0 * np.pi, 4.0 * np.pi], title=f"the next blade meets it {meets}"
    )
    ax.set_xticklabels(["0", r"$2\pi$", r"$4\pi$"])
    for side in ("left", "right", "top"):
        ax.spines[side].set_visible(False)


def draw() -> Figure:
    """Both ways of numbering."""
    figure = Figure(figsize=(9.6, 5.4), layout="constrained")
    axes = figure.subplots(2, 2, height_ratios=(2.0, 1.0))
    disc(axes[0, 0], 1, f"numbered in the sense of rotation: E = -EO = -{ENGINE_ORDER}")
    disc(axes[0, 1], -1, f"numbered against it: E = +EO = {ENGINE_ORDER}")
    in_time(axes[1, 0], 1)
    in_time(axes[1, 1], -1)
    return figure


if __name__ == "__main__":
    with mpl.rc_context({"svg.hashsalt": "slipstick", "svg.fonttype": "none"}):
        draw().savefig(HERE / "engine_order.svg", metadata={"Date": None})
