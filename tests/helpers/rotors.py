"""Rotors in a stator."""

from __future__ import annotations

from functools import cache

import numpy as np

import slipstick as ss


@cache
def whirling() -> ss.Branch:
    """A disc off the middle of its stator, which it touches for a part of each turn."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.2 * np.eye(2), K=np.diag([40.0, 44.0]), dofs=["n1x", "n1y"])
    law = ss.models.StatorContact(kn=20.0, gap=1.0, mu=0.1, slip_velocity=0.05)
    pair = ss.ContactPair(
        name="stator", contact=law, ports={"x": "n1x", "y": "n1y"}, rubbing=ss.RubbingMotion(velocity_per_omega=0.5)
    )
    loads = [ss.Load(dof="n1x", cos=30.0), ss.Load(dof="n1y", sin=30.0), ss.Load(dof="n1x", harmonic=0, cos=20.0)]
    problem = ss.Problem(structure, contacts=[pair], loads=loads, harmonics=range(6), title="off the middle")
    return ss.forced_response(problem, omega=(4.0, 4.5))


@cache
def shaft() -> ss.Branch:
    """An elastic shaft, displacements in m and tilts in rad, which are the larger numbers."""
    steel = ss.Material(young=211e9, poisson=0.3, density=7810.0)
    bearings = [ss.models.Bearing(node=node, kxx=1e6, kyy=0.8e6, cxx=400.0) for node in (0, 2)]
    disc = ss.models.Disc.of(node=1, material=steel, width=0.07, outer=0.28, inner=0.05)
    pieces = [ss.models.Shaft(length=0.3, outer=0.05, elements=2)]
    structure = ss.models.beam_rotor(pieces, material=steel, discs=[disc], bearings=bearings, engine_order=1)
    loads = [ss.Load(dof="n0x", cos=100.0), ss.Load(dof="n2x", cos=-90.0)]  # which tilts it
    spring = ss.SampledLaw(force=lambda x, velocity, k: k * x**3, parameters={"k": 1e3}, ports=("x",))
    problem = ss.Problem(
        structure, contacts=[ss.ContactPair(name="stop", contact=spring, ports={"x": "n1x"})], loads=loads,
        harmonics=[0, 1], outputs=structure.dofs, title="a shaft", units={"length": "m", "force": "N", "time": "s"},
    )  # fmt: skip
    return ss.forced_response(problem, omega=(60.0, 500.0), peaks_of=["n0x", "n0ry"])
