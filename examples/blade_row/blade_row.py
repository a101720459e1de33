"""A row of 30 blades turns in an oval casing: every blade rubs twice a turn, one after the other, as a wave.

One sector in a wave of engine order 2 tells all 30. Blades are numbered in the sense of rotation, so the wave has the
engine order -2: with an oval fixed in space the next blade in that sense meets it earlier.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slipstick as ss
from slipstick.structure.cyclic import TravellingWave

SI = {"length": "m", "force": "N", "time": "s"}
SECTORS, LOBES = 30, 2
RADIUS, CLEARANCE = 0.40, 0.25e-3  # m, of the tips; between them and a round casing
SPEEDS = (690.0, 740.0)  # rad/s
BLADE, ROOT, BETWEEN, RADIAL = 1.0e5, 1.5e6, 4.0e5, 4.0e6  # N/m


def wave() -> TravellingWave:
    """Bending y of the tip about the axis, its radial motion r, and a piece of the disc, joined to the next one."""
    K0 = np.array([[BLADE, 0.0, -BLADE], [0.0, RADIAL, 0.0], [-BLADE, 0.0, BLADE + ROOT + 2.0 * BETWEEN]])
    K1 = np.zeros((3, 3))
    K1[2, 2] = -BETWEEN
    sector = ss.CyclicStructure(
        M=np.diag([0.045, 0.045, 0.5]), K=(K0, K1), dofs=["y", "r", "disc"], sectors=SECTORS, loss_factor=5e-3
    )
    return sector.travelling_wave(-LOBES)


def problem(height: float = 0.3e-3) -> ss.Problem:
    """The tip in a casing ``height`` out of round; a blade that leans comes nearer to it where it bends."""
    own = wave()
    rubbing = ss.casing_motion({"cos": {LOBES: height}}, angles=0.0, radius=RADIUS, wave=own)
    tip = ss.ContactPair(
        name="tip",
        contact=ss.FrictionContact(kt=1e5, mu=0.15, kn=1e5, gap=CLEARANCE),
        tangential={"y": 1.0},
        normal={"r": 1.0, "y": 0.1},
        rubbing=rubbing,
    )
    return ss.Problem(
        own, contacts=tip, harmonics=range(13), outputs=["y"], title="Blade row in an oval casing", units=SI
    )


def compute() -> dict[str, ss.Branch]:
    """Over the frequency, which is twice the speed, for two heights of the lobes."""
    omega = LOBES * SPEEDS[0], LOBES * SPEEDS[1]
    return {f"{1e3 * h:.2g} mm": ss.forced_response(problem(h), omega=omega) for h in (0.27e-3, 0.3e-3)}


def draw(branches: dict[str, ss.Branch], folder: Path) -> None:
    """Bending of the tips over the frequency, and the whole row at the highest peak."""
    figure = Figure(figsize=(9.6, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    ss.plots.response(branches, "y", ax=left)
    row = list(branches.values())[-1]
    row.plot.disc(int(np.argmax(row.dataset.amplitude.sel(dof="y").values)), "y", ax=right)
    figure.savefig(folder / "blade_row.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    found = compute()
    for name, branch in found.items():
        omega, amplitude = max(branch.peaks("y"), key=lambda peak: peak[1])
        contact = 1.0 - branch.dataset.separation_fraction.to_numpy().min()
        peak = f"peak {1e3 * amplitude:.6g} mm at {omega:.6g} rad/s"
        print(f"lobe height {name}: {peak}, touches {contact:.3f} of the period")
    draw(found, folder)
