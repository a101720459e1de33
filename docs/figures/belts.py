"""Make belts.svg: a mass on a belt against what was published of it (falling-friction.md)."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from slipstick.verify import belt_checks as belts

HERE = Path(__file__).parent
AVERAGED, COMPUTED, COUNTED = "#555555", "#1f5fa8", "#c03a2b"


def draw() -> Figure:
    """Amplitude against averaging, shares against counts."""
    figure = Figure(figsize=(9.6, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    V1 = belts.averaged_onset()
    V = np.linspace(np.sqrt(0.8) * V1, V1, 200)
    left.plot(V, [belts.averaged_amplitude(v) for v in V], color=AVERAGED, label="averaged: it slides")
    left.plot([0.2, V[0]], [0.2, V[0]], "--", color=AVERAGED, label="amplitude = V: it sticks")
    for N, style in ((1.0, ":"), (0.2, "-")):
        d = belts.cubic_cycles(N, 0.2, 11).dataset
        d = d.isel(point=np.flatnonzero(d["branch_part"] == 1))
        x = np.asarray(d["displacement"])[:, 0]
        left.plot(-d["parameter"], np.hypot(x[:, 1], x[:, 2]), style, color=COMPUTED, label=f"computed, N = {N:g}")
    left.set(xlabel="belt velocity V", ylabel="first harmonic of x", title="cubic law (Thomsen and Fidlin 2003)")
    left.legend(fontsize=8, frameon=False)

    found = belts.shares(belts.exponential_cycles())
    counts = belts.COUNTED
    right.plot(list(found), list(found.values()), color=COMPUTED, label="within the computed cycle")
    right.errorbar(
        list(counts), [share for share, _ in counts.values()], [2.0 * error for _, error in counts.values()],
        fmt="o", markersize=4, capsize=3, color=COUNTED, label="counted, two standard errors",
    )  # fmt: skip
    right.plot([0.95, 1.025, 1.1], [0.0, 0.0, 0.0], "o", markersize=4, color=COUNTED)
    right.plot([1.85, 1.925, 2.0], [1.0, 1.0, 1.0], "o", markersize=4, color=COUNTED)
    for velocity, name in (
        (belts.onset(belts.exponential_cycles()), "onset"),
        (belts.fastest(belts.exponential_cycles()), "cycles end"),
    ):
        right.axvline(velocity, linestyle="--", linewidth=0.9, color=COMPUTED)
        right.text(velocity - 0.015, 0.6, name, color=COMPUTED, fontsize=8, ha="right", rotation=90)
    right.set(
        xlabel="belt velocity V", ylabel="share of starts", title="starts that end in steady sliding (bSTAB 2021)"
    )
    right.legend(fontsize=8, loc="upper left", framealpha=1.0)
    return figure


if __name__ == "__main__":
    with mpl.rc_context({"svg.hashsalt": "slipstick", "svg.fonttype": "none"}):
        draw().savefig(HERE / "belts.svg", metadata={"Date": None})
