"""A brake that squeals by itself: steady sliding, its Hopf point, and the limit cycles beyond."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slipstick as ss
from slipstick.plots.style import styled

FRICTION = (0.3, 0.8)
SHOWN = (0.55, 0.6, 0.7)


def problem(mu=0.4):
    """A block with coupled modes along and across a surface that moves towards -x at 1, pressed on by 50."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.5 * np.eye(2), K=[[100.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"])
    contact = ss.FrictionContact(kt=200.0, mu=mu, kn=40.0, gap=0.0)
    pad = ss.ContactPair(
        name="pad", tangential="x", normal="y", contact=contact, rubbing=ss.RubbingMotion(velocity=1.0)
    )
    load = ss.Load(dof="y", harmonic=0, cos=50.0)
    return ss.Problem(structure, contacts=pad, loads=load, harmonics=range(11), title="Brake squeal")


def compute():
    """Limit cycles over the friction coefficient."""
    return ss.limit_cycles(problem(), "pad.mu", FRICTION, at=SHOWN)


def draw(branch, folder):
    """Amplitude and free frequency over the friction coefficient; the vibration over its velocity."""
    figure = Figure(figsize=(10, 7.5), layout="constrained")
    axes = figure.subplots(2, 2)
    branch.plot.response("y", ax=axes[0, 0])
    branch.plot.stability(ax=axes[0, 1])
    styled(axes[1, 0], "pad.mu", "Free frequency [rad/s]")
    styled(axes[1, 1], "x", "dx/dt")
    for part, name in ((2, "steady sliding"), (1, "limit cycles")):
        data = branch.dataset.isel(point=branch.dataset.branch_part.values == part)
        axes[1, 0].plot(data.parameter, data.omega, label=name)
    axes[1, 0].legend()
    tau = np.linspace(0.0, 2.0 * np.pi, 721)
    h = branch.harmonics
    for mu in SHOWN:
        data = branch.dataset.isel(point=branch.at(mu))
        X = data.displacement.sel(dof="x").values
        motion, velocity = h.H_minus(tau) @ X, float(data.omega) * (h.H_minus(tau) @ h.derivative(X))
        axes[1, 1].plot(motion, velocity, label=f"mu = {mu:g}")
    axes[1, 1].axhline(-1.0, color="grey", linewidth=0.8, label="velocity of the opposing surface")
    axes[1, 1].legend()
    figure.savefig(folder / "brake_squeal.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    branch = compute()
    for found in branch.bifurcations():
        print(f"{found.kind} at mu = {found.value:.5f}, {found.omega:.5f} rad/s")
    for mu in SHOWN:
        data = branch.dataset.isel(point=branch.at(mu))
        print(f"mu = {mu}: {float(data.omega):.5f} rad/s, y {float(data.amplitude.sel(dof='y')):.4f}")
    check = branch.check_in_time(branch.at(SHOWN[-1]))
    print(f"in time: y {check.amplitude_in_time[1]:.4f}, difference {check.relative_difference:.1e}")
    draw(branch, folder)
