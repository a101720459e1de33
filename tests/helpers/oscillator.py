"""One mass on a spring, which most tests begin with."""

from __future__ import annotations

from typing import Any

import numpy as np

import slipstick as ss

UNITS = {"length": "mm", "force": "N", "time": "s"}


def mass(**options: Any) -> ss.MatrixStructure:
    return ss.MatrixStructure(**{"M": [[1.0]], "C": [[0.4]], "K": [[40.0]], "dofs": ["x"]} | options)


def damper(velocity: float = 0.0, *, name: str = "damper", law: Any = None, **parts: Any) -> ss.ContactPair:
    """Friction under a constant load, with the values of the paper beside those given; the rest is how it rubs."""
    values = {key: parts.pop(key, value) for key, value in {"kt": 100.0, "mu": 0.3, "normal_load": 800.0}.items()}
    values |= {key: parts.pop(key) for key in ("kn", "gap") if key in parts}
    rubbing = ss.RubbingMotion(velocity=velocity, **parts)
    return ss.ContactPair(name=name, contact=law or ss.FrictionContact(**values), tangential="x", rubbing=rubbing)


def one_mass(*contacts: ss.ContactPair, C: float | None = 0.4, force: float = 100.0, **options: Any) -> ss.Problem:
    """The mass with these contacts, under a sine; few harmonics."""
    given = {"contacts": contacts, "loads": ss.Load(dof="x", sin=force), "harmonics": range(4)} | options
    return ss.Problem(mass(C=None if C is None else [[C]]), **given)


def with_law(law: Any, *, name: str = "spring", port: str = "x", force: float = 1.0, **options: Any) -> ss.Problem:
    """The mass with a contact of one port."""
    return one_mass(ss.ContactPair(name=name, contact=law, ports={port: "x"}), force=force, **options)


def oscillator(velocity: float = 0.0, harmonics: int = 11, **parts: Any) -> ss.Problem:
    """The paper's oscillator with a rubbing contact."""
    return one_mass(damper(velocity, **parts), harmonics=range(harmonics))


def opening() -> ss.Problem:
    """A contact that opens and closes: from 2 rad/s the branch comes back, as from 10; from 15 rad/s it does not."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=[[40.0, -10.0], [-10.0, 60.0]], dofs=["x", "y"])
    contact = ss.FrictionContact(kt=400.0, mu=0.3, kn=400.0, gap=-2.0)
    pair = ss.ContactPair(name="damper", contact=contact, tangential="x", normal="y")
    return ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=400.0)], harmonics=range(11))


def closed(a: float, m: float = 1.0, k: float = 40.0, c: float = 0.4, kt: float = 100.0, load: float = 240.0):
    """Frequency and damping ratio of its nonlinear mode with one harmonic."""
    limit = load / kt
    if a <= limit:
        w = np.sqrt((k + kt) / m)
        return w, c / (2.0 * m * w)
    th = np.arccos(1.0 - 2.0 * limit / a)
    w = np.sqrt((k + kt / np.pi * (th - np.sin(2.0 * th) / 2.0)) / m)
    return w, (c / m + 4.0 * load * (a - limit) / (np.pi * a**2 * w * m)) / (2.0 * w)
