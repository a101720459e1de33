"""Branches whose reports hold everything: two friction contacts, one that opens and rubs, and a law of another kind."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import slipstick as ss


@cache
def branch(title: str = "two masses", *, spring: bool = False) -> ss.Branch:
    structure = ss.MatrixStructure(
        M=np.diag([1.0, 1.0, 0.5]), C=0.3 * np.eye(3),
        K=np.array([[60.0, -20.0, 0.0], [-20.0, 70.0, 5.0], [0.0, 5.0, 90.0]]), dofs=["a", "b", "z"],
    )  # fmt: skip
    contacts = [
        ss.ContactPair(
            name="joint", contact=ss.FrictionContact(kt=80.0, mu=0.4, kn=1.0, gap=-30.0),
            tangential={"a": 1.0, "b": -1.0},
        ),
        ss.ContactPair(
            name="tip", contact=ss.FrictionContact(kt=40.0, mu=0.3, kn=60.0, gap=-0.02), tangential="b", normal="z",
            rubbing=ss.RubbingMotion(velocity=0.5, sin={1: 0.1}, normal_cos={0: 0.01, 2: 0.02}),
        ),
    ]  # fmt: skip
    if spring:
        law = ss.SampledLaw(force=lambda x, velocity, k: k * x**3, parameters={"k": 2.0}, ports=("x",))
        contacts.append(ss.ContactPair(name="stop", contact=law, ports={"x": {"a": 1.0}}))
    loads = [ss.Load(dof="a", sin=30.0), ss.Load(dof="z", cos=20.0)]
    problem = ss.Problem(structure, contacts=contacts, loads=loads, harmonics=range(6), title=title)
    return ss.forced_response(problem, omega=(6.0, 12.0), options={"max_step": 0.1})


@cache
def planar_branch() -> ss.Branch:
    """A foot whose normal load varies and opens, a heel of constant load, both sliding in a plane, and a joint."""
    structure = ss.MatrixStructure(
        M=np.eye(3), C=0.4 * np.eye(3), K=np.diag([40.0, 50.0, 60.0]), dofs=["x", "y", "z"]
    )  # fmt: skip
    plane, numbers = ("x", "y"), {"kt": 100.0, "mu": 0.3}
    contacts = [
        ss.ContactPair(
            name="foot", contact=ss.PlanarFrictionContact(kn=20.0, gap=-2.0, **numbers), tangential=plane, normal="z"
        ),
        ss.ContactPair(
            name="heel", contact=ss.PlanarFrictionContact(normal_load=100.0, **numbers), tangential=plane,
            rubbing=ss.RubbingMotion(velocity=(1.0, 0.0)),
        ),
        ss.ContactPair(name="joint", contact=ss.FrictionContact(normal_load=60.0, **numbers), tangential="x"),
    ]  # fmt: skip
    loads = [ss.Load(dof="x", sin=60.0), ss.Load(dof="y", cos=40.0), ss.Load(dof="z", cos=120.0)]
    problem = ss.Problem(structure, contacts=contacts, loads=loads, harmonics=range(5), title="three soles")
    return ss.forced_response(problem, omega=(6.0, 6.2), options={"max_step": 0.1})


def unplaned(planes: bytes, width: int) -> bytes:
    """Numbers of ``width`` bytes from the planes of their first bytes, their second bytes, ..."""
    return b"".join(planes[i :: len(planes) // width] for i in range(len(planes) // width)) if planes else b""


def decoded(packed: dict[str, Any]) -> np.ndarray:
    """The array of ``report.encoding.packed``, read as the page reads it."""
    kinds = {"f8": "<f8", "f4": "<f4", "u2": "<u2", "u1": "u1"}
    shape = packed["shape"]
    values = np.frombuffer(unplaned(packed["bytes"], int(packed["kind"][1:])), kinds[packed["kind"]])
    rows = values.reshape((1 if packed["once"] else shape[0], *shape[1:]))
    return np.broadcast_to(rows, shape)


def decoded_coefficients(fixed: dict[str, Any]) -> np.ndarray:
    """The array of ``report.encoding.fixed``, likewise."""
    n, m, count = fixed["rest"]["shape"]
    width = int(fixed["rest"]["kind"][1:])
    own = np.frombuffer(unplaned(fixed["rest"]["bytes"], width), np.uint8).reshape(-1, m, count, width)
    whole = np.zeros((n, m, count, 8), np.uint8)
    whole[..., :width] = own
    whole[..., width:] = np.where(own[..., -1:] > 127, 255, 0)  # the sign
    rest = whole.view("<i8")[..., 0] * decoded(fixed["scale"])[:, :, None]
    return np.concatenate([decoded(fixed["zero"])[:, :, None], rest], axis=2)
