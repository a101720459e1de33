"""Two leaves in contact, clamped together and shaken across, at two frequencies: made once."""

from __future__ import annotations

import functools
import warnings

import slipstick as ss
from slipstick.fem.box import box
from slipstick.fem.mesh import together
from slipstick.fem.model import elastic_model

SIZE = (0.06, 0.04, 0.004)


@functools.cache
def shaken_joint(points: int = 12) -> ss.Branch:
    """Slip at some contacts; results in m, N, s."""
    low, high = box(SIZE, (4, 2, 1), "hex20"), box(SIZE, (3, 3, 1), "tet10", at=(0.0, 0.0, SIZE[2]))
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    model = elastic_model(together({"lower": low, "upper": high}), steel, ["lower.x0", "upper.x0"])
    law = ss.PlanarFrictionContact(kt=1e11, kn=1e12, mu=0.3, gap=0.0)
    joint = ss.surface_pair(model, "lower.z1", "upper.z0", contact=law, points=points)
    pressed = {"below": "lower.z0", "above": "upper.z1"}
    body = ss.reduced_body(model, pairs=joint, base="z", modes=24, loss_factor=0.01, pressure=pressed)
    loads = [ss.Load(shape=name, harmonic=0, cos=1e6) for name in pressed]
    loads.append(ss.Load(base="z", motion="acceleration", cos=5e3))
    problem = ss.Problem(
        body.structure, contacts=joint, loads=loads, harmonics=range(4),
        units={"length": "m", "force": "N", "time": "s"},
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # few harmonics
        return ss.steady_response(problem, omega=[2e3, 1.3e4])
