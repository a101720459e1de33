"""A reduced turbine blade with 8 contacts at its shroud: with and without rubbing, contacts opening.

100 % normal load is 3.969 N at each node before the structure yields. Units: m, N, kg, s.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slipstick as ss
from slipstick.plots.style import show_lengths

ARRAYS = Path(__file__).with_name("blade_reduced.npz")
STIFFNESS = 27450.33
FULL_LOAD = 3.96918
CASES = {  # name: (normal load in %, rubbing velocity in m/s, frequency range in Hz)
    "100 %, no rubbing": (100.0, 0.0, (290.0, 325.0)),
    "400 %, no rubbing": (400.0, 0.0, (300.0, 320.0)),
    "100 %, 1 m/s": (100.0, 1.0, (195.0, 240.0)),
    "100 %, 5 m/s": (100.0, 5.0, (195.0, 240.0)),
}


def blade(load, velocity, harmonics=range(6)):
    """The blade under a normal load in percent, rubbed with a velocity in m/s."""
    structure = ss.ModalStructure.load(ARRAYS, loss_factor=0.001)
    contact = ss.FrictionContact(kt=STIFFNESS, kn=STIFFNESS, mu=0.3, gap=-load / 100.0 * FULL_LOAD / STIFFNESS)
    pairs = [
        ss.ContactPair(
            name=f"node {i}",
            contact=contact,
            tangential={f"n{i}y": 1.0},
            normal={f"n{i}z": 1.0},
            rubbing=ss.RubbingMotion(velocity=velocity),
        )
        for i in range(1, 9)
    ]
    pressure = ss.Load(shape="pressure", harmonic=1, cos=2.0)
    return ss.Problem(
        structure,
        contacts=pairs,
        loads=[pressure],
        harmonics=ss.Harmonics(harmonics),
        outputs=["n1y", "n1z"],
        units={"length": "m", "force": "N", "time": "s"},
    )


def compute():
    """One branch for each case."""
    return {
        name: ss.forced_response(blade(load, velocity), omega=tuple(2 * np.pi * np.array(hertz)), peaks_of=["n1y"])
        for name, (load, velocity, hertz) in CASES.items()
    }


def draw(branches, folder):
    figure = Figure(figsize=(9, 8), layout="constrained")
    axes = figure.subplots(2, 2)
    largest = max(float(branch.dataset.amplitude.max()) for branch in branches.values())
    for (name, branch), ax in zip(branches.items(), axes.flat, strict=True):
        branch.plot.response("n1y", ax=ax, frequency="Hz", log=True)
        show_lengths(ax.yaxis, largest=largest)  # all four in one unit
        ax.set_title(name)
    figure.savefig(folder / "blade_reduced.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    branches = compute()
    for name, branch in branches.items():
        omega, amplitude = max(branch.peaks("n1y"), key=lambda peak: peak[1])
        open_time = float(branch.dataset.separation_fraction.max())
        print(
            f"{name:18s}: {branch.dataset.sizes['point']:3d} points, peak {1e3 * amplitude:.5f} mm at "
            f"{omega / (2 * np.pi):.2f} Hz, contacts open for at most {100 * open_time:.1f} % of the period"
        )
    draw(branches, folder)
