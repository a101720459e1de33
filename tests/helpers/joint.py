"""Two leaves in contact, clamped together and shaken across, at two frequencies: made once."""

from __future__ import annotations

import functools
import warnings

import numpy as np

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


def clamped_by_points(points: int = 40) -> ss.Problem:
    """Leaves held at both ends, pressed together by two pairs of forces: elsewhere the joint is open, or nearly so."""
    low, high = box(SIZE, (6, 3, 1), "hex20"), box(SIZE, (5, 4, 1), "hex20", at=(0.5 * SIZE[0], 0.0, SIZE[2]))
    mesh = together({"lower": low, "upper": high})
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    model = elastic_model(mesh, steel, ["lower.x0", "upper.x1"])
    law = ss.PlanarFrictionContact(kt=5e12, kn=1e13, mu=0.3, gap=0.0)
    joint = ss.surface_pair(model, "lower.z1", "upper.z0", contact=law, points=points)
    pressed = []
    for x in (0.6 * SIZE[0], 0.9 * SIZE[0]):
        for side, sign, z in (("lower.z0", 1.0, 0.0), ("upper.z1", -1.0, 2.0 * SIZE[2])):
            on = mesh.surface(side).nodes
            nearest = on[np.linalg.norm(mesh.nodes[on] - (x, 0.5 * SIZE[1], z), axis=1).argmin()]
            pressed.append((f"n{mesh.labels[nearest]}z", sign))
    tip = f"n{mesh.labels[mesh.surface('lower.x1').nodes[0]]}z"
    body = ss.reduced_body(model, pairs=joint, keep=[tip, *(dof for dof, _ in pressed)], modes=24, damping_ratio=0.002)
    loads = [ss.Load(dof=dof, harmonic=0, cos=3000.0 * sign) for dof, sign in pressed]
    return ss.Problem(
        body.structure, contacts=joint, loads=[*loads, ss.Load(dof=tip, sin=2.0)], harmonics=[0, 1, 3]
    )  # fmt: skip
