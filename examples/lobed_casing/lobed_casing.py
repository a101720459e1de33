"""A rotor blade that rubs on an oval casing: the rub comes twice a turn and meets the first bending mode."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slipstick as ss
from slipstick.plots.style import styled

LENGTH, WIDTH, THICKNESS = 0.12, 0.05, 0.004  # m
YOUNG, DENSITY = 2.0e11, 7800.0  # Pa, kg/m3
RADIUS, CLEARANCE = 0.40, 0.25e-3  # m, of the tip; between the tip and the round casing
SPEED = 720.0  # rad/s
LOBES = 2
SI = {"length": "m", "force": "N", "time": "s"}
_CLAMPED_FREE = np.array([1.8751040687, 4.6940911330, 7.8547574382, 10.9955407349])


def oval(height):
    """Height of the casing towards the axis over the angle."""
    return lambda angle: height * np.cos(LOBES * angle)


def blade():
    """A cantilever: dof y bends around the axis, dof r is radial. Mass-normalised modes at the tip."""
    area, inertia = WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12
    mass = DENSITY * area * LENGTH
    bending = (_CLAMPED_FREE / LENGTH) ** 2 * np.sqrt(YOUNG * inertia / (DENSITY * area))
    radial = (np.arange(1, 5, 2) * np.pi / 2 / LENGTH) * np.sqrt(YOUNG / DENSITY)
    shapes = np.zeros((2, bending.size + radial.size))
    shapes[0, : bending.size] = 2 * (-1.0) ** np.arange(bending.size) / np.sqrt(mass)
    shapes[1, bending.size :] = np.array([1.0, -1.0]) * np.sqrt(2 / mass)
    return ss.ModalStructure(
        omega=np.concatenate([bending, radial]),
        mode_shapes=shapes,
        static_compliance=np.diag([LENGTH**3 / (3 * YOUNG * inertia), LENGTH / (YOUNG * area)]),
        dofs=["y", "r"],
        damping_ratio=0.01,
    )


def problem(height=0.3e-3):
    """The tip on a casing ``height`` out of round; a leaning blade comes nearer to it where it bends."""
    tip = ss.ContactPair(
        name="tip",
        contact=ss.FrictionContact(kt=1e6, mu=0.15, kn=2e5, gap=CLEARANCE),
        tangential={"y": 1.0},
        normal={"r": 1.0, "y": 0.1},
        rubbing=ss.casing_motion(oval(height), angles=0.0, radius=RADIUS, speed=SPEED, lobes=LOBES),
    )
    return ss.Problem(blade(), contacts=[tip], harmonics=range(21), title="Blade on an oval casing", units=SI)


def compute():
    """Over the speed, as the fundamental frequency (twice the speed); and over the height of the lobes."""
    return {
        "versus speed": ss.forced_response(problem(), omega=(1250.0, 1650.0), peaks_of="y"),
        "versus height": ss.parameter_response(problem(), "tip.normal_cos1", (0.2e-3, 0.4e-3), omega=LOBES * SPEED),
    }


def draw(branches, folder):
    """Bending of the tip over speed and over the height of the lobes, and how long it touches."""
    figure = Figure(figsize=(9, 6), layout="constrained")
    axes = figure.subplots(2, 2, sharex="col")
    for column, (name, branch) in zip(axes.T, branches.items(), strict=True):
        branch.plot.response("y", ax=column[0])
        column[0].set_title(name)
        column[0].xaxis.label.set_visible(False)
        data = branch.dataset
        styled(column[1], column[0].get_xlabel(), "Fraction of the period in contact")
        column[1].plot(data[branch.followed], 1.0 - data.separation_fraction.sel(contact="tip"))
    figure.savefig(folder / "lobed_casing.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    branches = compute()
    over_speed = branches["versus speed"]
    omega, amplitude = max(over_speed.peaks("y"), key=lambda peak: peak[1])
    print(f"versus speed: peak {1e3 * amplitude:.5f} mm at {omega:.1f} rad/s, {omega / LOBES * 30 / np.pi:.0f} rpm")
    check = over_speed.check_in_time(over_speed.at(omega))
    print(f"in time: {1e3 * check.amplitude_in_time[0]:.5f} mm, relative difference {check.relative_difference:.1e}")
    touched = branches["versus height"].dataset
    first = float(touched.parameter[int(np.argmax(touched.separation_fraction.values[:, 0] < 1.0))])
    print(f"versus height: touches from {1e3 * first:.5f} mm on, clearance {1e3 * CLEARANCE:g} mm")
    draw(branches, folder)
