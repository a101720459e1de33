"""A compressor blade that rubs on two lobes of its casing: a gap closed by continuation.

The configuration of E. Piollet, F. Nyssen, A. Batailly, "Blade/casing rubbing interactions in aircraft engines:
Numerical benchmark and design guidelines based on NASA rotor 37", J. Sound Vib. 460 (2019) 114878, in the variant of
C. Monjaraz-Tec, J. Gross, M. Krack, Computers & Structures 260 (2022) 106698: two Gaussian lobes, 16 contacts. The
blade is our own, of about the same dimensions; it keeps 150 modes, which 24 harmonics need.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slipstick as ss
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.plots.style import styled

HUB, TIP = 0.455, 0.637  # m, radii
CHORD = 0.14  # m
STAGGER = (40.0, 62.0)  # degrees from the axis, at the hub and at the tip
THICKNESS = (0.0125, 0.0045)  # m, in the middle of the chord
EDGE = 0.4  # thickness of the edges over that
CAMBER = 0.02  # of the chord
STEEL = ss.Material(young=2.1e11, poisson=0.3, density=7850.0)
SPEED = 1344.0  # rad/s
LOBES, CONTACTS, MODES, HARMONICS = 2, 16, 150, 24
GAP = 0.356e-3  # m, between the tip and the casing away from the lobes; they reach as far beyond the tip
MU = 0.15
KN = 2.0e8  # N/m, a casing that gives; hard contacts: docs/rotor-rub.md
AXIS = {"point": (0.0, 0.0, 0.0), "direction": (0.0, 0.0, 1.0)}
OPEN = 2.1 * GAP  # no lobe reaches the tip
START = 0.5e-3  # m, where the tip rubs long enough for these harmonics
DOF = "c1y"  # circumferential motion of one corner of the tip
SI = {"length": "m", "force": "N", "time": "s"}


def placed(unit):
    """Nodes of the unit cube (along the chord, across it, along the span) in the blade: x radial, z the rotor axis."""
    s, n, span = unit.T
    s = s - 0.5
    stagger = np.radians(STAGGER[0] + span * (STAGGER[1] - STAGGER[0]))
    thickness = THICKNESS[0] + span * (THICKNESS[1] - THICKNESS[0])
    bulge = 1.0 - (1.0 - EDGE) * (2.0 * s) ** 2
    height = (n - 0.5) * thickness * bulge + CAMBER * CHORD * (1.0 - span) * (1.0 - (2.0 * s) ** 2)
    radius = HUB + span * (TIP - HUB)
    around = CHORD * s * np.sin(stagger) - height * np.cos(stagger)
    along = CHORD * s * np.cos(stagger) + height * np.sin(stagger)
    return np.column_stack([radius * np.cos(around / radius), radius * np.sin(around / radius), along])


def blade(fine=False):
    """The blade, clamped at the hub and reduced to 16 contacts on its tip."""
    cube = box((1.0, 1.0, 1.0), (16, 2, 20) if fine else (8, 1, 8), "hex20")
    mesh = MeshModel(mesh=replace(cube, nodes=placed(cube.nodes)))
    model = assemble_mesh(mesh, source="rotor blade", material=STEEL, fixed=["z0"])
    return ss.reduced_body(model, surface="z1", contacts=CONTACTS, radius=4e-3, modes=MODES, damping_ratio=0.03)


def lobes(angle):
    """Height of the casing towards the axis over the angle: two lobes, 2 GAP high."""
    return 2.0 * GAP * np.exp(-(((np.mod(angle, np.pi) / np.pi - 0.5) / 0.15) ** 2))


def problem(body, damping=0.03, gap=GAP):
    """The blade turning in the casing at rest, every contact with its own radius and angle."""
    tip = ss.surface_contacts(
        body,
        "tip",
        contact=ss.FrictionContact(kt=KN, mu=MU, kn=KN, gap=gap),
        direction="circumferential",
        normal="radial",
        axis=AXIS,
        rubbing=lambda radius, angles: ss.casing_motion(
            lobes, radius=radius, angles=angles, speed=SPEED, lobes=LOBES, orders=HARMONICS
        ),
    )
    whole = ss.Problem(body.structure, contacts=tip, harmonics=range(HARMONICS + 1), outputs=[DOF], units=SI)
    return whole.with_parameter("damping", damping / 0.03)


def closed(problem, gap=GAP, start=OPEN, **options):
    """From ``start``, by default a gap that no lobe reaches, where the blade is at rest, to the gap wanted."""
    return ss.parameter_response(
        problem.with_parameter("*.gap", start), "*.gap", (start, gap), omega=LOBES * SPEED, **options
    )


def compute(fine=False, dampings=(0.03,), start=START, **options):
    """The gap closed, at each damping."""
    body = blade(fine)
    return {f"{100 * damping:g} %": closed(problem(body, damping), start=start, **options) for damping in dampings}


def draw(branches, folder):
    """Motion of the corner of the tip while the gap closes, and the fraction of the period in which the tip touches."""
    figure = Figure(figsize=(9, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    styled(left, "Gap [mm]", "Amplitude of the corner of the tip [mm]")
    styled(right, "Gap [mm]", "Fraction of the period in contact")
    for name, branch in branches.items():
        data = branch.dataset
        gap = 1e3 * data.parameter
        (line,) = left.plot(gap, 1e3 * data.amplitude[:, 0], label=f"{name} damping")
        off = data.stable.values == 0 if "stable" in data else np.zeros(len(gap), dtype=bool)
        line.set_ydata(np.where(off, np.nan, line.get_ydata()))
        if off.any():
            unstable = np.where(off, 1e3 * data.amplitude[:, 0], np.nan)
            left.plot(gap, unstable, "--", color=line.get_color(), label=f"{name} damping, unstable")
        right.plot(gap, 1.0 - data.separation_fraction.min("contact"), color=line.get_color())
    left.legend()
    for axes in (left, right):
        axes.invert_xaxis()
    figure.savefig(folder / "rotor_rub.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    branches = compute(stability=True)
    for name, branch in branches.items():
        last = branch.dataset.isel(point=-1)
        check = branch.check_in_time(len(branch) - 1)
        share = 1.0 - float(last.separation_fraction.min())
        print(f"{name} damping, gap {1e3 * float(last.parameter):.3f} mm:")
        print(f"  amplitude {1e3 * float(last.amplitude[0]):.4f} mm about {1e3 * float(last['mean'][0]):.4f} mm,")
        print(f"  in contact for {share:.3f} of the period")
        print(f"  in time: {1e3 * check.amplitude_in_time[0]:.4f} mm, difference {check.relative_difference:.1e}")
        gaps = 1e3 * branch.dataset.parameter.values[branch.dataset.stable.values == 0]
        print(f"  unstable: {f'gaps from {gaps.min():.3f} to {gaps.max():.3f} mm' if gaps.size else 'nowhere'}")
    draw(branches, folder)
