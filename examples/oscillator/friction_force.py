"""How the friction force becomes periodic, and its loops (Petrov 2012, Figs. 2 to 5).

The contact is moved by x = A cos(tau) with constant and with varying normal load, for several rubbing velocities. The
force starts from zero; the periodic force of the element is drawn over it.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slipstick as ss
from slipstick.plots.style import legend, styled

H = ss.Harmonics([0, 1])
CONTACT = ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0)
LIMIT = 0.3 * 800.0
CASES = {  # name: (amplitude of x, amplitude of the normal motion y = Y sin(tau), rubbing velocities)
    "small amplitude": (1.5, 0.0, (0.0, 0.02, 0.1, 1.0)),
    "large amplitude": (6.0, 0.0, (0.0, 1.0, 4.0, 8.0)),
    "large amplitude, varying load": (6.0, 400.0, (0.0, 1.0, 4.0, 8.0)),
}


def starting_force(amplitude, normal, velocity, periods=6, steps=4000):
    """Friction force from rest over several periods: the clamped march of THEORY.md section 3, on a fine grid."""
    tau = np.linspace(0.0, 2 * np.pi * periods, periods * steps + 1)
    w = amplitude * np.cos(tau) + velocity * tau
    bound = 0.3 * np.maximum(800.0 + normal * np.sin(tau), 0.0)
    force = np.zeros_like(tau)
    for i in range(1, len(tau)):
        force[i] = min(max(force[i - 1] + 100.0 * (w[i] - w[i - 1]), -bound[i]), bound[i])
    return tau, force


def periodic_force(amplitude, normal, velocity):
    """Exact periodic force of the element: coefficients, states and mean."""
    X, Y = [0.0, amplitude, 0.0], [0.0, 0.0, normal]
    return ss.contact_forces(CONTACT, H, X, Y, omega=1.0, rubbing=ss.RubbingMotion(velocity=velocity))


def draw(folder):
    figure = Figure(figsize=(11, 9), layout="constrained")
    axes = figure.subplots(len(CASES), 2)
    for (name, (A, normal, velocities)), (history, loop) in zip(CASES.items(), axes, strict=True):
        styled(history, "Cycles", "Friction force").set_title(name)
        styled(loop, "Vibration x", "Friction force").set_title(name)
        for v in velocities:
            tau, force = starting_force(A, normal, v)
            (line,) = history.plot(tau / (2 * np.pi), force, label=f"v = {v:g}", lw=1.2)
            last = tau >= tau[-1] - 2 * np.pi
            loop.plot(A * np.cos(tau[last]), force[last], color=line.get_color(), lw=1.2)
        legend(history)
    figure.savefig(folder / "friction_force.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    for name, (A, normal, velocities) in CASES.items():
        for v in velocities:
            f = periodic_force(A, normal, v)
            states = ", ".join(state for _a, _b, state in f.states)
            print(f"{name}, v = {v:g}: mean force {f.Fx[0]:8.3f}, power {f.power:9.3f}, states: {states}")
    draw(folder)
