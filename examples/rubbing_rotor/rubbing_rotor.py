"""A rotor rubs on its stator: whirl frequencies over the speed, and the unbalance response with and without contact.

A steel shaft of 1.5 m with two discs on two bearings (the rotor of ROSS's examples, github.com/petrobras/ross), damped
lightly; the first disc turns in a ring with 0.5 mm of clearance.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import slipstick as ss

STEEL = ss.Material(young=211e9, poisson=211e9 / (2 * 81.2e9) - 1.0, density=7810.0)
RADIUS, CLEARANCE, UNBALANCE = 0.14, 0.5e-3, 0.01
SPEEDS = (60.0, 110.0)


def rotor(speed: float | None = None, engine_order: int | None = None) -> ss.MatrixStructure:
    """At a ``speed`` or tied to the frequency by an ``engine_order``."""
    discs = [
        ss.models.Disc.of(node=node, material=STEEL, width=0.07, outer=outer, inner=0.05)
        for node, outer in ((2, 0.28), (4, 0.35))
    ]
    bearings = [ss.models.Bearing(node=node, kxx=1e6, kyy=0.8e6, cxx=400.0) for node in (0, 6)]
    shaft = ss.models.Shaft(length=1.5, outer=0.05, elements=6)
    return ss.models.beam_rotor(
        [shaft], material=STEEL, discs=discs, bearings=bearings, speed=speed, engine_order=engine_order
    )


def problem(mu: float | None) -> ss.Problem:
    """Unbalance of the first disc at the frequency of turning; ``mu`` of the stator, None without one."""
    loads = [
        ss.Load(dof="n2x", motion="unbalance", cos=UNBALANCE),
        ss.Load(dof="n2y", motion="unbalance", sin=UNBALANCE),
    ]
    stator = []
    if mu is not None:
        law = ss.models.StatorContact(kn=2e6, gap=CLEARANCE, mu=mu, cn=100.0, slip_velocity=0.01)
        surface = ss.RubbingMotion(velocity_per_omega=RADIUS)
        stator = [ss.ContactPair(name="stator", contact=law, ports={"x": "n2x", "y": "n2y"}, rubbing=surface)]
    return ss.Problem(
        rotor(engine_order=1), contacts=stator, loads=loads, harmonics=range(6), outputs=["n2x", "n2y"],
        title="a rotor that rubs on its stator", units={"length": "m", "force": "N", "time": "s"},
    )  # fmt: skip


def compute() -> dict[str, ss.Branch]:
    """Curves over the speed, which is the frequency."""
    free = ss.linear_response(problem(None), omega=np.linspace(*SPEEDS, 401))
    return {"no stator": free} | {f"mu = {mu:g}": ss.forced_response(problem(mu), omega=SPEEDS) for mu in (0.0, 0.1)}


def draw(branches: dict[str, ss.Branch], folder: Path) -> None:
    """Campbell diagram, and the response of the disc."""
    diagram = ss.models.campbell(rotor(speed=0.0), np.linspace(0.0, 400.0, 81), engine_orders=[1, 2], modes=6)
    ss.plots.save_figure(ss.plots.campbell(diagram), folder / "rotor_campbell", formats=("png",))
    ax, *_ = ss.plots.compare(branches, dof="n2x")
    ax.axhline(CLEARANCE, color="0.6", linewidth=0.8)
    ss.plots.save_figure(ax, folder / "rubbing_rotor", formats=("png",))


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    branches = compute()
    for name, branch in branches.items():
        sizes = branch.dataset.amplitude.sel(dof="n2x")
        at = float(branch.dataset.omega[int(sizes.values.argmax())])
        largest = f"largest amplitude {1e3 * float(sizes.max()):.4g} mm of the disc at {at:.5g} rad/s"
        print(f"{name}: {largest}, clearance {1e3 * CLEARANCE:g} mm")
    draw(branches, folder)
