"""Make first_screen.svg and paper/figure.png: a contact, its friction loop by state, a blade's peak under rubbing."""

import warnings
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import slipstick as ss
from slipstick.plots.style import COLOURS, STATE_COLOURS, styled

HERE = Path(__file__).parent
BLADE = HERE.parent.parent / "examples" / "blade_reduced" / "blade_reduced.toml"
HERTZ = 2.0 * np.pi
CHECKED = {
    0.0: (205.0, 250.0, 292.0, 302.0, 320.0),
    1.0: (200.0, 208.0, 211.0, 213.2, 216.0, 235.0, 280.0),
    5.0: (202.0, 209.5, 218.0, 245.0, 300.0),
}
"""Velocity in m/s, and Hz at which the motion is integrated in time, besides the highest peak."""
CLOSE = (209.0, 215.0)
"""Hz around both rubbed peaks."""


def arrow(ax: Axes, start: tuple[float, float], end: tuple[float, float], colour: str) -> None:
    ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 1.8})


def spring(ax: Axes, start: float, end: float, y: float) -> None:
    x = np.linspace(start, end, 81)
    coils = (x > start + 0.15 * (end - start)) & (x < end - 0.15 * (end - start))
    ax.plot(x, y + 0.16 * coils * np.sin(np.linspace(0.0, 14.0 * np.pi, 81)), color="#333333", linewidth=1.2)


def sketch(ax: Axes) -> None:
    """A structure, the contact under it, and the surface that moves."""
    ax.add_patch(Rectangle((-1.3, 1.5), 2.6, 1.1, facecolor="#dbe7f5", edgecolor=COLOURS[0], linewidth=1.4))
    ax.text(0.0, 2.05, "structure:\na mass, a blade,\na finite element model", ha="center", va="center", fontsize=8)
    ax.plot([-3.2, -3.2], [1.4, 2.7], color="#555555", linewidth=3)
    spring(ax, -3.2, -1.3, 2.05)
    arrow(ax, (1.4, 2.25), (2.5, 2.25), COLOURS[0])
    ax.text(2.0, 2.42, "vibration x", color=COLOURS[0], ha="center", fontsize=8)
    arrow(ax, (0.0, 3.45), (0.0, 2.65), COLOURS[1])
    ax.text(0.12, 3.15, "normal load, constant or from motion and gap", color=COLOURS[1], fontsize=8, ha="left")
    ax.plot([-0.9, -0.9], [1.5, 0.85], color="#333333", linewidth=1.2)
    spring(ax, -0.9, 0.9, 0.85)
    ax.plot([0.9, 0.9], [0.85, 0.35], color="#333333", linewidth=1.2)
    ax.add_patch(Rectangle((0.5, 0.14), 0.8, 0.24, facecolor=STATE_COLOURS["slip-"], edgecolor="#333333"))
    ax.text(-0.3, 0.4, "stick: kt", color=STATE_COLOURS["stick"], fontsize=8, ha="center")
    ax.text(1.45, 0.32, "slip: mu N", color=STATE_COLOURS["slip-"], fontsize=8)
    ax.add_patch(Rectangle((-3.2, -0.4), 6.4, 0.5, facecolor="#e8e8e8", edgecolor="#555555", hatch="//"))
    arrow(ax, (-1.2, -0.75), (1.2, -0.75), "#555555")
    surface = "opposing surface: at rest, or rubbing at a velocity,\nround or lobed, cold or hot"
    ax.text(0.0, -1.25, surface, ha="center", va="center", fontsize=8, color="#555555")
    ax.set(xlim=(-3.4, 3.4), ylim=(-1.6, 3.7))
    ax.axis("off")


def oscillator() -> ss.Branch:
    """The oscillator of the examples under slow rubbing."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    damper = ss.ContactPair(
        name="damper", contact=ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0), tangential="x",
        rubbing=ss.RubbingMotion(velocity=1.0),
    )  # fmt: skip
    problem = ss.Problem(structure, contacts=damper, loads=ss.Load(dof="x", sin=100.0), harmonics=range(11))
    return ss.forced_response(problem, omega=(2.0, 15.0))


def loop(ax: Axes, branch: ss.Branch, omega: float) -> None:
    """The friction force over the vibration, in the colours of the states."""
    point = branch.at(omega)
    period, states = branch.loop(point, samples=3601), branch.states(point)["damper"]
    styled(ax, "Vibration x", "Friction force")
    named = set()
    for start, end, state in states:
        tau = period["tau"] + HERTZ * np.arange(-1, 2)[:, None]
        inside = np.any((tau >= start) & (tau <= end), axis=0)
        force = np.where(inside, period["friction"], np.nan)
        label = None if state in named else state
        named.add(state)
        ax.plot(period["motion"], force, color=STATE_COLOURS[state], linewidth=2.4, linestyle="-", label=label)
    ax.legend(frameon=False, fontsize=8)


def peaks(ax: Axes) -> None:
    """The blade at rest and rubbed: lines are the balance, dots integration in time."""
    blade = ss.load_case(BLADE)
    styled(ax, "Frequency [Hz]", "Amplitude [mm]")
    close = styled(ax.inset_axes((0.29, 0.36, 0.31, 0.6)), "", "")
    for velocity, colour in zip(CHECKED, COLOURS, strict=False):
        problem = blade.with_parameter("*.velocity", velocity)
        curve = ss.forced_response(
            problem,
            omega=(195.0 * HERTZ, 330.0 * HERTZ),
            at=np.array(CHECKED[velocity]) * HERTZ,
            peaks_of=["n1y"],
        )
        data = curve.dataset
        amplitude = 1e3 * data.amplitude.sel(dof="n1y")
        for axes in (ax, close):
            axes.plot(data.omega / HERTZ, amplitude, color=colour, linestyle="-", label=f"{velocity:g} m/s")
        dof = list(data.dof.values).index("n1y")
        for point in (int(amplitude.argmax("point")), *(curve.at(hertz * HERTZ) for hertz in CHECKED[velocity])):
            check, hertz = curve.check_in_time(point), float(data.omega[point]) / HERTZ
            print(f"{velocity:g} m/s, {hertz:g} Hz: {check.amplitude[dof]:.4e} {check.amplitude_in_time[dof]:.4e} m")
            for axes in (ax, close):
                axes.plot(hertz, 1e3 * check.amplitude_in_time[dof], "o", color=colour, markersize=4)
    ax.plot([], [], "o", color="#666666", markersize=4, label="integration in time")
    for axes in (ax, close):
        axes.set_yscale("log")
        axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    close.set(xlim=CLOSE, ylim=(0.05, 5.0))
    close.tick_params(labelsize=8)
    ax.indicate_inset_zoom(close, edgecolor="#999999")
    ax.legend(frameon=False, fontsize=8, loc="upper right", bbox_to_anchor=(1.03, 1.0), handlelength=1.2)


def draw() -> Figure:
    figure = Figure(figsize=(13.0, 3.9), layout="constrained")
    contact, hysteresis, response = figure.subplots(1, 3, width_ratios=(1.15, 0.9, 1.15))
    sketch(contact)
    loop(hysteresis, oscillator(), 10.773)
    peaks(response)
    for ax, title in ((contact, "A vibrating structure rubs"), (hysteresis, "Stick and slip within a period, exactly"),
                      (response, "A turbine blade: rubbing removes its damping")):  # fmt: skip
        ax.set_title(title, fontsize=11)
    return figure


if __name__ == "__main__":
    warnings.simplefilter("ignore", ss.SlipstickWarning)
    with mpl.rc_context({"svg.hashsalt": "slipstick"}):
        figure = draw()
        figure.savefig(HERE / "first_screen.svg", metadata={"Date": None})
        figure.savefig(HERE.parent.parent / "paper" / "figure.png", dpi=150)
