"""A turbine blade with eight friction contacts on its shroud, rubbed by a spring-backed seal segment. SI units.

Everything the study, the convergence tables and the tests need to build the same blade; docs/blade.md says why the
numbers are what they are.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

import slipstick as ss
from slipstick.models.blade import INCONEL_718

LOSS_FACTOR = 0.001
PRESSURE = 300.0
"""Amplitude of the harmonic pressure on the concave side, Pa."""

KT = 12e3
"""Tangential stiffness of one contact, N/m: all eight are 0.75 times as stiff as the first mode at the shroud."""

KN = 40.0
"""Normal stiffness of one contact, N/m: its share of the springs behind the seal segment."""

FULL_LOAD = 0.30
"""Normal load of one contact that is called 100 %, N: near the one of least amplitude without rubbing (see
``one_mode_peak``)."""

CONTACTS = 8
RUBBING_DIRECTION = (0.0, 1.0, 0.0)
"""Circumferential; the first mode moves the shroud the same way."""

FILM = 200.0
"""Convection coefficient, W/(m2 K)."""

BACKGROUND = 25.0
HARDNESS = 4.0e9
"""Indentation hardness of aged alloy 718, Pa: normal load over hardness is the real area of contact."""

FRICTION = ss.FrictionCurve(
    temperature=[25, 200, 400, 600, 800], mu=[0.50, 0.45, 0.38, 0.31, 0.27], interpolation="cubic"
)
"""Friction coefficient of a nickel alloy over the contact temperature, degrees C (illustrative)."""

MU = 0.50
"""At the background temperature."""

RANGE = (2 * np.pi * 150.0, 2 * np.pi * 330.0)
"""Holds the first resonance both free and stuck, rad/s."""

OUTPUT = "c1y"
"""Motion of the first contact in the rubbing direction."""

DEFAULT_CACHE = Path("blade-study") / "cache"
"""Folder of the reduced blades, below the working directory."""


def reduced_blade(
    size="small", *, modes=128, contacts: int | Sequence[Sequence[float]] = CONTACTS, radius=None,
    cache=DEFAULT_CACHE, listener=None,
):  # fmt: skip
    """The finite element blade, "small", "medium" or "large", reduced to its contacts; kept in the folder ``cache``.

    ``contacts`` is their number or their positions, ``radius`` that of the patches.
    """
    return ss.reduced_blade(
        size,
        material=INCONEL_718,
        contacts=contacts,
        radius=radius,
        film=FILM,
        modes=modes,
        loss_factor=LOSS_FACTOR,
        cache=cache,
        listener=listener,
    )


def contact_load(percent):
    """Normal load of one contact, N."""
    return percent / 100.0 * FULL_LOAD


def flash_resistance(load):
    """Temperature of the spot where the metals touch, over the power put in there, K/W (Holm; Bowden and Tabor).

    One round spot of area load/hardness on a half space of the blade's alloy: 1 / (4 a conductivity).
    """
    radius = np.sqrt(load / (np.pi * HARDNESS))
    return 1.0 / (4.0 * radius * INCONEL_718.conductivity)


def heat(blade, percent):
    """Contact temperature: through the body by the finite element model, and at the spots themselves."""
    resistance = blade.points.resistance(own=flash_resistance(contact_load(percent)))
    return ss.ThermalModel(curve=FRICTION, background=BACKGROUND, resistance=resistance)


def rubbed(blade, percent, velocity, *, hot=False, harmonics=range(6)):
    """The blade under a normal load in percent, rubbed with a velocity in m/s; ``hot`` with mu of temperature."""
    pairs = ss.surface_contacts(
        blade,
        "shroud",
        contact=ss.FrictionContact(kt=KT, kn=KN, mu=MU, normal_load=contact_load(percent)),
        direction=RUBBING_DIRECTION,
        normal=True,
        rubbing=ss.RubbingMotion(velocity=velocity),
    )
    return ss.Problem(
        blade.structure,
        contacts=pairs,
        loads=[ss.Load(shape="pressure", cos=PRESSURE)],
        harmonics=ss.Harmonics(harmonics),
        outputs=[OUTPUT],
        thermal=heat(blade, percent) if hot else None,
    )


def highest(branch):
    """Largest amplitude of a branch: (Hz, m)."""
    data = branch.dataset
    amplitude = data.amplitude.sel(dof=OUTPUT).values
    at = int(np.argmax(amplitude))
    return float(data.omega[at]) / (2 * np.pi), float(amplitude[at])


def total_power(branch):
    """Power dissipated by all contacts at every point, W."""
    return branch.dataset.dissipated_power.sum("contact").values


def first_mode(blade):
    """The first mode as an oscillator at the mean of the contacts: stiffness (N/m), force (N), motion of OUTPUT."""
    structure, dofs = blade.structure, list(blade.structure.dofs)
    shape = structure.mode_shapes[:, 0] / np.mean(
        [structure.mode_shapes[dofs.index(f"c{k}y"), 0] for k in range(1, CONTACTS + 1)]
    )
    scale = structure.mode_shapes[0, 0] / shape[0]
    force = abs(structure.shapes["pressure"].participation[0] / scale) * PRESSURE
    return float((structure.omega[0] / scale) ** 2), float(force), float(shape[dofs.index(OUTPUT)])


def one_mode_peak(blade, percent):
    """Amplitude at resonance without rubbing as one mode and one energy balance give it, m.

    With s = mu N of all contacts: 4 s (x - s/kt) + pi eta k x^2 = pi F x (friction loop, structural loss, excitation).
    The least amplitude is at s = pi F/2 / (1 + pi eta k/kt), most dissipation at a quarter of it where kt is stiff.
    """
    stiffness, force, motion = first_mode(blade)
    s, kt = CONTACTS * MU * contact_load(percent), CONTACTS * KT
    a, b, c = np.pi * LOSS_FACTOR * stiffness, 4.0 * s - np.pi * force, -4.0 * s**2 / kt
    return motion * (-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)


def best_load(blade):
    """Normal load of a contact for the least amplitude without rubbing, by ``one_mode_peak``, N."""
    stiffness, force, _ = first_mode(blade)
    s = 0.5 * np.pi * force / (1.0 + np.pi * LOSS_FACTOR * stiffness / (CONTACTS * KT))
    return s / (CONTACTS * MU)
