"""Published joints rebuilt from their numbers by closed forms: the fit gives the numbers back.

- The pocket of the RubBeR beam, kt 1e8 N/m and friction limit 106 N: M. Scheel, T. Weigele, M. Krack, Challenging an
  experimental nonlinear modal analysis method with a new strongly friction-damped structure, J. Sound Vib. 485 (2020)
  115580; as in the example of NLvib (https://github.com/maltekrack/NLvib).
- Four-parameter Iwan element, kt 2, slip force 3, chi -0.1, beta 0.1, of the verification of tmdsimpy
  (https://github.com/tmd-lab/tmdsimpy, tests of Iwan4Force), whose loading curve has a closed form: D. J. Segalman,
  A Four-Parameter Iwan Model for Lap-Type Joints, J. Appl. Mech. 72 (2005) 752, equations 26 to 28.
"""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import slipstick as ss

POCKET = {"kt": 1e8, "limit": 106.0}
JOINT = {"kt": 2.0, "limit": 3.0, "chi": -0.1, "beta": 0.1}
TAU = np.arange(4000) * (2.0 * np.pi / 4000)


def masing(loading, amplitude):
    """Force of a loop x = amplitude cos tau from the curve of first loading: G. Masing, 1926."""
    x = amplitude * np.cos(TAU)
    down = np.sin(TAU) > 0.0
    top = loading(np.array([amplitude]))[0]
    return x, np.where(down, top - 2.0 * loading((amplitude - x) / 2.0), 2.0 * loading((amplitude + x) / 2.0) - top)


def loops(loading, amplitudes, noise=0.0) -> xr.Dataset:
    rng = np.random.default_rng(0)
    x, force = zip(*(masing(loading, a) for a in amplitudes), strict=True)
    force = np.array(force) + noise * rng.standard_normal((len(amplitudes), TAU.size))
    return xr.Dataset(
        {"displacement": (("loop", "tau"), np.array(x)), "force": (("loop", "tau"), force)}, coords={"tau": TAU}
    )


def problem_of(law, harmonics=range(12)) -> ss.Problem:
    structure = ss.MatrixStructure(M=[[1.0]], K=[[1.0]], dofs=["x"])
    return ss.Problem(
        structure, contacts=ss.ContactPair(name="joint", contact=law, tangential="x"), harmonics=harmonics
    )


def test_loops_of_the_pocket():
    """Parallelograms of 1 % noise, in N and m."""

    def loading(x):
        return np.minimum(POCKET["kt"] * x, POCKET["limit"])

    data = loops(loading, [8e-7, 1.5e-6, 4e-6], noise=1.06)
    law = ss.FrictionContact(kt=5e7, mu=0.5, normal_load=300.0)
    found = ss.identify(problem_of(law), data, ["joint.kt", "joint.normal_load"])
    assert found.values["joint.kt"] == pytest.approx(POCKET["kt"], rel=2e-3)
    assert 0.5 * found.values["joint.normal_load"] == pytest.approx(POCKET["limit"], rel=1e-3)
    for name, truth in (("joint.kt", POCKET["kt"]), ("joint.normal_load", 2.0 * POCKET["limit"])):
        assert abs(found.values[name] - truth) < 4.0 * found.standard_errors[name]


def segalman(x):
    """The curve of first loading of the four-parameter element."""
    kt, limit, chi, beta = JOINT.values()
    share = beta + (chi + 1.0) / (chi + 2.0)
    most = limit * (1.0 + beta) / (kt * share)  # displacement at which all slides
    u = np.minimum(x / most, 1.0)
    slid = u ** (chi + 2.0) / (chi + 2.0) / (1.0 + beta)
    curve = (beta + 1.0) * u / share - (1.0 + beta) * slid / share
    return np.where(x >= most, limit, limit * curve)


def test_loops_of_the_iwan_element():
    """A hundred sliders against the closed form: to what the number of sliders leaves."""
    kt, limit, chi, beta = JOINT.values()
    most = limit * (1.0 + beta) / (kt * (beta + (chi + 1.0) / (chi + 2.0)))
    small = 1e-4 * most
    assert segalman(np.array([small]))[0] == pytest.approx(kt * small, rel=1e-3)
    data = loops(segalman, [0.3 * most, 0.7 * most, 1.2 * most])
    law = ss.models.IwanContact(kt=1.5, limit=4.0, chi=-0.3, beta=0.3, sliders=100)
    with pytest.warns(ss.SlipstickWarning) as caught:  # the sliders' steps are no noise
        found = ss.identify(problem_of(law), data, ["joint.kt", "joint.limit", "joint.chi", "joint.beta"])
    assert all(str(each.message) in found.warnings for each in caught)
    for name, truth in JOINT.items():
        assert found.values[f"joint.{name}"] == pytest.approx(truth, rel=0.02), found.values
    assert found.misfit < 1e-4
