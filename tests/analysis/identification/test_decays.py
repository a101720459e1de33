"""Free decays fitted in time: against motions that scipy integrated by itself, with parameters known."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

import slipstick as ss
from slipstick.analysis.identification.decays import DecayPredictor, decay_of
from slipstick.plots.fits import fit

TRUE = {"joint.kt": 20.0, "joint.limit": 1.0}


def bolted(**law: float) -> ss.Problem:
    contact = ss.models.DahlContact(**({"kt": 20.0, "limit": 1.0} | law))
    pair = ss.ContactPair(name="joint", contact=contact, tangential="x")
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.02]], K=[[40.0]], dofs=["x"])
    return ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=1.0), harmonics=[0, 1, 3])


@cache
def decay(duration: float, noise: float = 0.0, seed: int = 0) -> xr.Dataset:
    """Dahl's element let go with a velocity and with a force in it."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        return [y[1], -40.0 * y[0] - 0.02 * y[1] - y[2], 20.0 * (y[1] - abs(y[1]) * y[2] / 1.0)]

    t = np.linspace(0.0, duration, int(60 * duration) + 1)
    x = solve_ivp(rates, (0.0, duration), [1.0, 1.0, 0.2], "DOP853", t, rtol=1e-12, atol=1e-13).y[0]
    x = x + noise * np.sqrt(np.mean(x**2)) * np.random.default_rng(seed).standard_normal(x.size)
    return xr.Dataset({"displacement": ("time", x)}, coords={"time": t}, attrs={"dof": "x"})


def predictor(duration: float) -> DecayPredictor:
    found = decay_of(bolted(), decay(duration), "x", 6.5)
    assert found is not None
    return DecayPredictor(bolted(), list(TRUE), found)


def test_the_motion_and_its_derivatives_at_the_best_initial_state() -> None:
    """At the parameters it was made with it is the motion that was measured; slopes are those of nearby motions."""
    predicted, x = predictor(2.0), decay(2.0)["displacement"].to_numpy()
    p = np.array([*TRUE.values()])
    np.testing.assert_allclose(predicted.values(p), x, atol=2e-6)
    np.testing.assert_allclose(predicted.values(p), x, atol=1e-9)  # from the initial state found before
    slopes = predicted.slopes(p).copy()
    for k, step in enumerate(1e-3 * p):
        up, down = (predicted.values(p + sign * step * np.eye(2)[k]) for sign in (1.0, -1.0))
        np.testing.assert_allclose((up - down) / (2 * step), slopes[k], atol=2e-3 * np.abs(slopes[k]).max())


def test_without_noise_the_parameters_are_exact() -> None:
    predicted, x = predictor(2.0), decay(2.0)["displacement"].to_numpy()
    unit = np.array([18.0, 1.05])
    found = least_squares(
        lambda z: predicted.values(z * unit) - x, np.ones(2),
        jac=lambda z: predicted.slopes(z * unit).T * unit, xtol=1e-8,
    )  # fmt: skip
    np.testing.assert_allclose(found.x * unit, [*TRUE.values()], rtol=1e-6)


def test_what_is_not_simulated_stays_a_nonlinear_mode() -> None:
    """Contacts that stick and slip, rubbing that vibrates, too many numbers in the state."""
    data, sound = decay(2.0), bolted()
    pair = sound.contacts[0]
    friction = ss.ContactPair(name="joint", contact=ss.FrictionContact(kt=1.0, mu=1.0, normal_load=1.0), tangential="x")
    shaken = ss.ContactPair(
        name="joint", contact=pair.contact, tangential="x", rubbing=ss.RubbingMotion(sin={1: 0.1})
    )  # fmt: skip
    many = ss.MatrixStructure(
        M=np.eye(12), C=0.01 * np.eye(12), K=np.diag(np.arange(1.0, 13.0)), dofs=list("abcdefghijkl")
    )
    for contacts, structure, dof in (
        (friction, sound.structure, "x"), (shaken, sound.structure, "x"),
        (ss.ContactPair(name="joint", contact=pair.contact, tangential=many.dofs[0]), many, many.dofs[0]),
    ):  # fmt: skip
        problem = ss.Problem(structure, contacts=contacts, loads=ss.Load(dof=dof, sin=1.0), harmonics=[0, 1, 3])
        assert decay_of(problem, data, dof, 6.5) is None


@pytest.mark.verify
def test_a_decay_gives_the_parameters_to_a_millionth() -> None:
    """From a start far away, over the nonlinear mode, whose own values are off by some per cent."""
    found = ss.identify(bolted(kt=15.0, limit=1.3), decay(7.0), list(TRUE))
    assert found.values == pytest.approx(TRUE, rel=1e-6)
    assert found.dataset["fitted"].dims == ("time",)
    assert found.misfit < 1e-7
    assert len(fit(found.dataset).lines) == 2


@pytest.mark.verify
def test_with_one_per_cent_of_noise_the_errors_are_as_large_as_they_are_said_to_be() -> None:
    off = []
    for seed in range(4):
        found = ss.identify(bolted(kt=19.0, limit=1.05), decay(7.0, 0.01, seed), list(TRUE))
        off.append([(found.values[n] - TRUE[n]) / found.standard_errors[n] for n in TRUE])
    assert np.abs(off).max() < 4.0
    assert 0.3 < np.sqrt(np.mean(np.square(off))) < 1.8
