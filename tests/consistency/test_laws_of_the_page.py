"""The laws with memory of docs/own-law-and-structure.md, held against truth: the page's own classes."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import slipstick as ss
from slipstick.contact.law import Motion
from slipstick.trig.harmonics import Harmonics

PAGE = Path(__file__).parents[2] / "docs" / "own-law-and-structure.md"
H = Harmonics(range(6))


@cache
def page() -> dict:
    """Names of the page's classes; nothing of it is computed."""
    text = PAGE.read_text(encoding="utf-8")
    blocks = [b for b in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "(Law)" in b]
    names: dict = {"np": np, "ss": ss}
    for block in blocks:
        exec(re.split(r"\n\n\n(?=def yielding|\w+, \w+ = )", block)[0], names)
    return names


def motion(n: int, size: float, drift: float) -> Motion:
    X = size * np.random.default_rng(3).standard_normal((n, H.size)) / (1.0 + np.arange(H.size)) ** 1.5
    return Motion(H, 1.7, (X,), np.full((1, n), drift))


@pytest.mark.parametrize("drift", [0.0, 0.3])
def test_iwan_is_the_sum_of_a_hundred_friction_contacts(drift: float) -> None:
    law, given = page()["Iwan"](kt=1.3, limit=0.8), motion(3, 1.5, drift)
    found = law.respond(given, {"kt": np.full(3, 1.3), "limit": np.full(3, 0.8)})
    force, tangent, work = np.zeros((3, H.size)), np.zeros((3, H.size, H.size)), np.zeros(3)
    rub = ss.RubbingMotion(velocity=1.7 * drift)
    for share in (np.arange(100) + 0.5) / 100:
        slider = ss.FrictionContact(kt=1.3 / 100, mu=0.5, normal_load=2.0 * 2.0 * share * 0.8 / 100)
        one = ss.contact_forces(slider, H, given.Q[0], 0.0 * given.Q[0], omega=1.7, rubbing=rub)
        force, tangent, work = force + one.Fx, tangent + one.dFx_dX, work + one.power / 1.7
    np.testing.assert_allclose(found.force[0], force, atol=1e-10 * np.abs(force).max())
    np.testing.assert_allclose(found.by_motion[0, 0], tangent, atol=1e-10 * np.abs(tangent).max())
    np.testing.assert_allclose(found.work, work, rtol=1e-10)


@pytest.mark.parametrize(("name", "values"), [("Iwan", {"kt": 1.3, "limit": 0.8}), ("Dahl", {"k": 2.0, "limit": 1.2})])
def test_derivatives_are_those_of_differences(name: str, values: dict[str, float]) -> None:
    law, given, step = page()[name](**values), motion(2, 1.2, 0.1), 1e-5
    own = {key: np.full(2, value) for key, value in values.items()}
    found = law.respond(given, own)
    for key in values:
        ends = [law.respond(given, {**own, key: own[key] + way}).force[0] for way in (step, -step)]
        slope = (ends[0] - ends[1]) / (2.0 * step)
        np.testing.assert_allclose(found.by_parameter(key)[0], slope, atol=2e-5 * np.abs(slope).max())
    for column in (0, 1, 4):
        moved = [given._replace(Q=(given.Q[0] + way * np.eye(H.size)[column],)) for way in (step, -step)]
        ends = [law.respond(one, own).force[0] for one in moved]
        slope = (ends[0] - ends[1]) / (2.0 * step)
        np.testing.assert_allclose(
            found.by_motion[0, 0][:, :, column], slope, atol=2e-5 * max(np.abs(slope).max(), 1.0)
        )
    ends = [law.respond(given._replace(drift=given.drift + way), own).force[0] for way in (step, -step)]
    slope = (ends[0] - ends[1]) / (2.0 * step)
    np.testing.assert_allclose(found.by_drift[0, 0], slope, atol=2e-5 * np.abs(slope).max())


@pytest.mark.parametrize("drift", [0.0, 0.2])
def test_dahl_is_its_equation(drift: float) -> None:
    """Forces over a period by solve_ivp, after the periods in which the start is forgotten; and what ``rate`` is."""
    law, given = page()["Dahl"](k=2.0, limit=1.2, samples=8192), motion(1, 1.2, drift)
    dX = H.derivative(given.Q[0][0])

    def velocity(tau):
        return dX @ H.H_minus(tau).T + drift

    def rate(tau, f):
        return law.rate(None, velocity(float(tau)), f, {"k": 2.0, "limit": 1.2})[1]

    tau = 2.0 * np.pi * np.arange(2000) / 2000
    f = solve_ivp(rate, (0.0, 10 * np.pi), [0.0], t_eval=8 * np.pi + tau, rtol=1e-9, atol=1e-11, max_step=0.01).y[0]
    wanted = f @ H.H_plus(tau) * 2.0 / 2000
    found = law.respond(given, {"k": np.array([2.0]), "limit": np.array([1.2])})
    np.testing.assert_allclose(found.force[0][0], wanted, atol=1e-6 * np.abs(wanted).max())
    assert found.work[0] == pytest.approx(np.mean(f * velocity(tau)), rel=2e-6)


def test_what_they_tell_of_time() -> None:
    assert page()["Dahl"](k=1.0, limit=1.0).in_time
    assert not page()["Iwan"](1.0, 1.0).in_time
    assert page()["Iwan"](1.0, 1.0).kind == page()["Iwan"](2.0, 1.0).kind
