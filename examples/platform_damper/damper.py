"""Dampers under the platforms of 24 blades, each pressed against two neighbours by its centrifugal force.

A damper rubs on the right edge of the platform of its blade and on the left edge of the next one, ``left@next``. The
load at which it dissipates best is between a damper that slips freely and one that sticks.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slipstick as ss
from slipstick.plots.style import log_scale, styled
from slipstick.structure.cyclic import TravellingWave

SI = {"length": "m", "force": "N", "time": "s"}
SECTORS, ENGINE_ORDER = 24, 6
BLADE, PLATFORM, ROOT, BETWEEN = 4.0e4, 6.0e6, 6.0e5, 1.0e5  # N/m
KT, MU, LOADS = 2.0e5, 0.3, (1.0, 3.0, 10.0, 30.0, 100.0, 1000.0)  # N/m, -, N
OMEGA = (330.0, 420.0)


def wave() -> TravellingWave:
    """A blade with its tip, the two edges of its platform, and the platform on the disc, joined to the next one."""
    stay = BLADE + 2.0 * PLATFORM + ROOT + 2.0 * BETWEEN
    K0 = np.array(
        [
            [BLADE, 0.0, 0.0, -BLADE],
            [0.0, PLATFORM, 0.0, -PLATFORM],
            [0.0, 0.0, PLATFORM, -PLATFORM],
            [-BLADE, -PLATFORM, -PLATFORM, stay],
        ]
    )
    K1 = np.zeros((4, 4))
    K1[3, 3] = -BETWEEN
    sector = ss.CyclicStructure(
        M=np.diag([0.3, 0.05, 0.05, 1.0]),
        K=(K0, K1),
        dofs=["tip", "left", "right", "platform"],
        sectors=SECTORS,
        loss_factor=1e-3,
    )
    return sector.travelling_wave(ENGINE_ORDER)


def problem(normal_load: float) -> ss.Problem:
    """Under a load on the tips; ``normal_load`` presses the damper against both platforms."""
    damper = ss.ContactPair(
        name="damper",
        contact=ss.FrictionContact(kt=KT, mu=MU, normal_load=normal_load),
        tangential={"right": 1.0, "left@next": -1.0},
    )
    return ss.Problem(
        wave(), contacts=damper, loads=ss.Load(dof="tip", amplitude=1.0), harmonics=[0, 1, 3, 5], outputs=["tip"],
        title="under-platform dampers", units=SI,
    )  # fmt: skip


def compute() -> dict[float, ss.Branch]:
    """Curves by the load of the damper; almost none, and so much that it sticks, are among them."""
    return {load: ss.forced_response(problem(load), omega=OMEGA) for load in LOADS}


def peaks(branches: dict[float, ss.Branch]) -> dict[float, tuple[float, float]]:
    """Frequency and amplitude of the highest peak by the load."""
    return {load: max(branch.peaks("tip"), key=lambda peak: peak[1]) for load, branch in branches.items()}


def draw(branches: dict[float, ss.Branch], folder: Path) -> None:
    """Curves, and the highest amplitude over the load."""
    figure = Figure(figsize=(9.6, 3.8), layout="constrained")
    curves, best = figure.subplots(1, 2)
    ss.plots.response({f"{load:g} N": branch for load, branch in branches.items()}, "tip", ax=curves, log=True)
    found = peaks(branches)
    styled(best, "Normal load of the damper [N]", "Highest amplitude of the tips [m]")
    best.plot(list(found), [amplitude for _, amplitude in found.values()], "o-")
    log_scale(best, "x")
    log_scale(best, "y")
    figure.savefig(folder / "platform_damper.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    found = compute()
    for load, (omega, amplitude) in peaks(found).items():
        slip = float(found[load].dataset.slip_fraction.max())
        peak = f"peak {1e3 * amplitude:.6g} mm at {omega:.6g} rad/s"
        print(f"normal load {load:g} N: {peak}, slips {slip:.3f} of the period")
    draw(found, folder)
