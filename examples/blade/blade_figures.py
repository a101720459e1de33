"""Figures of the blade study: the mesh with its contacts, and the counterparts of Petrov (2012), Figs. 13 to 21."""

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.proj3d import proj_transform
from shrouded_blade import FULL_LOAD, OUTPUT, highest, one_mode_peak, total_power

from slipstick.models.blade_mesh import blade_mesh, blade_shape
from slipstick.plots.style import COLOURS, GREY, styled

COLOURED = {"shroud_top": "#009E73", "concave": "#E69F00", "root": "#666666", "root_sides": "#999999"}


def draw(blade, size, branches, linear, folder):
    """All figures, as png files in a folder."""
    for name, figure in (
        ("mesh", mesh(blade, size)),
        ("no_rub", no_rub(branches, linear)),
        ("loads", loads(blade, branches)),
        ("rub", rub(branches, linear)),
        ("heat", heat(branches)),
    ):
        figure.savefig(folder / f"blade_{name}.png", dpi=110)


def hertz(branch):
    return branch.dataset.omega.values / (2 * np.pi)


def amplitude(branch):
    """Millimetres."""
    return 1e3 * branch.dataset.amplitude.sel(dof=OUTPUT).values


def mesh(blade, size):
    """The finite element mesh: root, concave side, top of the shroud, contacts and rubbing direction."""
    body = blade_mesh(blade_shape(size))
    figure = Figure(figsize=(8, 5.5))
    # larger than its half of the figure: axes in space keep much room around what they show
    whole = Axes3D(figure, (-0.3, -0.1, 1.0, 1.15))
    tip = Axes3D(figure, (0.42, 0.0, 0.58, 0.94))
    for axes in (whole, tip):
        figure.add_axes(axes)
    low, high = 1e3 * body.nodes.min(axis=0), 1e3 * body.nodes.max(axis=0)
    show(whole, body, list(body.surfaces), low, high, 0.72)
    shroud = [name for name in body.surfaces if name.startswith("shroud")]
    nodes = 1e3 * body.nodes[np.unique(np.concatenate([body.surfaces[name].nodes for name in shroud]))]
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    show(tip, body, shroud, low, high, 1.15)
    # drawn above the surface: the depth sorting of matplotlib would hide half of the contacts
    tip.plot(*(1e3 * blade.points.positions).T, "o", color="#D55E00", markersize=6, zorder=100)
    whole.view_init(20, -65)
    tip.view_init(60, -75)
    ends = [proj_transform(high[0], low[1] + y, high[2], tip.get_proj())[:2] for y in (2.0, 18.0)]
    tip.annotate("", ends[1], ends[0], arrowprops={"arrowstyle": "-|>", "color": "#D55E00", "linewidth": 2.5})
    figure.text(0.21, 0.95, "root fixed (grey), pressure on the concave side", ha="center", fontsize=9)
    figure.text(0.71, 0.95, "top of the shroud: eight contacts, rubbing direction", ha="center", fontsize=9)
    return figure


def show(ax, body, names, low, high, zoom):
    """Faces of some surfaces in one collection, so that they are sorted by depth together."""
    groups = [(name, faces[:, :4]) for name in names for faces in body.surfaces[name].faces.values()]
    colours = [COLOURED.get(name, "#D8DEE6") for name, faces in groups for _ in faces]
    corners = 1e3 * body.nodes[np.concatenate([faces for _, faces in groups])]
    ax.add_collection3d(Poly3DCollection(corners, facecolors=colours, edgecolor="#555555", linewidth=0.3))
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    ax.set_box_aspect(high - low, zoom=zoom)
    ax.set_axis_off()


def limit_lines(ax, linear):
    for (state, branch), dashes in zip(linear.items(), (":", "-."), strict=True):
        label = {"free": "without contacts", "stuck": "fully stuck"}[state]
        ax.plot(hertz(branch), amplitude(branch), color=GREY, linestyle=dashes, linewidth=1.0, label=label, zorder=1)


def no_rub(branches, linear):
    """Figs. 13 and 14: amplitude and dissipated power without rubbing."""
    figure = Figure(figsize=(7, 7.5), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    styled(top, "", "Amplitude [mm]")
    styled(bottom, "Frequency [Hz]", "Dissipated power [W]")
    limit_lines(top, linear)
    for (curve, branch), colour in zip(still(branches), COLOURS, strict=False):
        top.plot(hertz(branch), amplitude(branch), color=colour, linestyle="-", label=f"{curve.load:g} %")
        bottom.plot(hertz(branch), np.maximum(total_power(branch), 1e-9), color=colour, linestyle="-")
    for ax in (top, bottom):
        ax.set_yscale("log")
        plain(ax)
    bottom.set_ylim(1e-4, 2)
    top.legend(title="normal load", loc="upper left", fontsize=8)
    return figure


def still(branches):
    """Curves without rubbing and heat, by load."""
    return sorted(((c, b) for c, b in branches.items() if c.velocity == 0 and not c.hot), key=lambda pair: pair[0].load)


def loads(blade, branches):
    """Highest amplitude and highest dissipated power over the normal load, without rubbing."""
    figure = Figure(figsize=(7, 4.2), layout="constrained")
    ax = styled(figure.subplots(), f"Normal load [%], 100 % = {FULL_LOAD:g} N a contact", "Highest amplitude [mm]")
    load = [curve.load for curve, _ in still(branches)]
    ax.loglog(load, [1e3 * highest(b)[1] for _, b in still(branches)], "o", color=COLOURS[0], label="amplitude")
    fine = np.geomspace(load[0], load[-1], 400)
    energy = [1e3 * one_mode_peak(blade, percent) for percent in fine]
    ax.plot(fine, energy, "-", color=COLOURS[0], linewidth=0.9, label="amplitude, energy balance of one mode")
    right = ax.twinx()
    right.loglog(load, [total_power(b).max() for _, b in still(branches)], "s-", color=COLOURS[1], label="power")
    right.set_ylabel("Highest dissipated power [W]", color=COLOURS[1])
    right.set_ylim(8e-3, 1)
    ax.yaxis.label.set_color(COLOURS[0])
    ax.set_xticks(load, [f"{value:g}" for value in load])
    for axes in (ax, right):
        axes.minorticks_off()
        plain(axes)
        axes.spines["top"].set_visible(False)
    figure.legend(loc="upper right", bbox_to_anchor=(0.88, 0.98), fontsize=8)
    return figure


def plain(ax):
    """Numbers instead of powers of ten on a logarithmic axis."""
    ax.yaxis.set_major_formatter(lambda value, _: f"{value:g}")


def rub(branches, linear):
    """Figs. 15 to 17: amplitude under rubbing for three normal loads, and the same around the free resonance."""
    chosen = sorted({c.load for c in branches if c.velocity == 10})
    figure = Figure(figsize=(9, 10), layout="constrained")
    rows = figure.subplots(len(chosen), 2, sharey=True, width_ratios=(3, 2))
    centre = highest(linear["free"])[0]
    for (left, right), load in zip(rows, chosen, strict=True):
        styled(left, "Frequency [Hz]", "Amplitude [mm]")
        styled(right, "Frequency [Hz]", "")
        left.set_title(f"normal load {load:g} %", fontsize=10)
        for ax in (left, right):
            limit_lines(ax, linear)
            at = sorted((c.velocity, c) for c in branches if c.load == load and not c.hot)
            for (velocity, curve), colour in zip(at, COLOURS, strict=False):
                ax.plot(
                    hertz(branches[curve]), amplitude(branches[curve]), color=colour, linestyle="-",
                    label=f"{velocity:g} m/s",
                )  # fmt: skip
            ax.set_yscale("log")
            plain(ax)
        left.set_ylim(2e-3, 8)
        right.set_xlim(centre - 1.5, centre + 1.5)
        right.set_title("around the free resonance", fontsize=10)
    rows[0][0].legend(loc="upper right", fontsize=7)
    return figure


def heat(branches):
    """Figs. 18 to 21: amplitude, mean, power, friction coefficient and temperature with and without heat."""
    figure = Figure(figsize=(9.5, 11), layout="constrained")
    (a, zoom), (zero, power), (mu, temperature) = figure.subplots(3, 2)
    load = next(c.load for c in branches if c.hot)
    velocities = sorted(c.velocity for c in branches if c.hot)
    chosen = {(c.velocity, c.hot): b for c, b in branches.items() if c.load == load and c.velocity in velocities}
    labels = ("Amplitude [mm]", "Amplitude [mm]", "Mean [µm]", "Dissipated power [W]",
              "Friction coefficient", "Contact temperature [°C]")  # fmt: skip
    for ax, label in zip((a, zoom, zero, power, mu, temperature), labels, strict=True):
        styled(ax, "Frequency [Hz]", label)
    for velocity, colour in zip(velocities, COLOURS, strict=False):
        for hot in (False, True):
            branch = chosen[velocity, hot]
            data, x = branch.dataset, hertz(branch)
            look = {"color": colour, "linestyle": "-" if hot else ":", "linewidth": 1.6 if hot else 1.0}
            label = f"{velocity:g} m/s, {'mu(T)' if hot else 'mu constant'}"
            a.plot(x, amplitude(branch), label=label, **look)
            zoom.plot(x, amplitude(branch), **look)
            zero.plot(x, 1e6 * data["mean"].sel(dof=OUTPUT).values, **look)
            power.plot(x, total_power(branch), **look)
            mu.plot(x, data.friction_coefficient.mean("contact").values, **look)
            if hot:
                temperature.plot(x, data.temperature.mean("contact").values, **look)
    a.set_yscale("log")
    plain(a)
    a.legend(fontsize=7)
    centre = highest(chosen[0.0, False])[0]
    zoom.set_xlim(centre - 0.8, centre + 0.8)
    for ax in (zero, power, mu, temperature):
        ax.set_xlim(centre - 15, centre + 15)
    return figure
