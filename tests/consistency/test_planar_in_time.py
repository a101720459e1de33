"""Periodic motion with friction in two directions, integrated over a period in time: it comes back to where it began.

The integrator goes from state change to state change; it knows the law and the structure, no harmonics, no element.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import slipstick as ss
from slipstick.typing import Array

KT, MU, KN = 100.0, 0.3, 50.0


class Marched:
    """An oscillator in x, y, z on one contact: z = [q, dq, f1, f2], in slip [q, dq, theta, 0]."""

    def __init__(self, K: Array, c: float, load: Array, mean: Array, omega: float, gap: float, v: Array) -> None:
        self.K, self.c, self.load, self.mean, self.omega, self.gap, self.v = K, c, load, mean, omega, gap, v

    def forces(self, state: str, z: Array) -> Array:
        """Of the contact on x, y, z."""
        normal = KN * (z[2] - self.gap)
        if state == "open":
            return np.zeros(3)
        if state == "slip":
            return np.array([MU * normal * np.cos(z[6]), MU * normal * np.sin(z[6]), normal])
        return np.array([z[6], z[7], normal])

    def rate(self, state: str, t: float, z: Array) -> Array:
        """Of the state."""
        wt = self.omega * t
        outer = self.mean + self.load[0] * np.cos(wt) + self.load[1] * np.sin(wt)
        acceleration = outer - self.c * z[3:6] - self.K * z[:3] - self.forces(state, z)
        speed = z[3:5] + self.v
        if state == "slip":
            b = MU * KN * (z[2] - self.gap)
            memory = [KT * (speed[1] * np.cos(z[6]) - speed[0] * np.sin(z[6])) / b, 0.0]
        else:
            memory = list(KT * speed) if state == "stick" else [0.0, 0.0]
        return np.concatenate([z[3:6], acceleration, memory])

    def slip_velocity(self, z: Array) -> float:
        """``lambda``."""
        return float((z[3:5] + self.v) @ [np.cos(z[6]), np.sin(z[6])] - MU * KN * z[5] / KT)

    def events(self, state: str) -> list[tuple[str, Any]]:
        """Where a state leads, and the functions that tell when."""

        def event(function: Any, direction: int) -> Any:
            function.terminal, function.direction = True, direction
            return function

        if state == "open":
            return [("close", event(lambda t, z: z[2] - self.gap, 1))]
        found = [("open", event(lambda t, z: z[2] - self.gap - 1e-9, -1))]
        if state == "slip":
            return [*found, ("stick", event(lambda t, z: self.slip_velocity(z), -1))]
        return [*found, ("slip", event(lambda t, z: np.hypot(z[6], z[7]) - MU * KN * (z[2] - self.gap), 1))]

    def period(self, z: Array, state: str) -> tuple[Array, set[str]]:
        """Motion and velocity after one, and the states on the way."""
        t, end, met = 0.0, 2.0 * np.pi / self.omega, {state}
        while t < end:
            events = self.events(state)
            way = solve_ivp(
                lambda t, z, state=state: self.rate(state, t, z), (t, end), z, method="DOP853",
                events=[event for _, event in events], rtol=1e-11, atol=1e-11, max_step=0.02,
            )  # fmt: skip
            t, z = float(way.t[-1]), way.y[:, -1].copy()
            if way.status == 0:
                break
            leads = next(name for (name, _), times in zip(events, way.t_events, strict=True) if len(times))
            if leads == "close":
                speed = z[3:5] + self.v
                state, z[6:] = "stick", 0.0
                if KT * np.hypot(*speed) > MU * KN * z[5]:
                    state, z[6] = "slip", np.arctan2(speed[1], speed[0])
                z[2] = max(z[2], self.gap + 1e-9)
            elif leads == "slip":
                state, z[6] = "slip", np.arctan2(z[7], z[6])
            elif leads == "stick":
                force = self.forces("slip", z)
                state, z[6:] = "stick", force[:2]
            else:
                state, z[6:] = "open", 0.0
            met.add(state)
        return z[:6], met


def error(seed: int, orders: int) -> tuple[float, set[str]]:
    """How far a random system is from where it began after a period, over its motion, and the states it was in."""
    rng = np.random.default_rng(seed)
    K, c, omega, load0 = rng.uniform(30, 60, 3), rng.uniform(1.0, 4.0), rng.uniform(4.0, 14.0), 800.0
    load = rng.normal(size=(2, 3)) * [150.0, 150.0, [0.0, 400.0, 1500.0][seed % 3]]
    v = rng.normal(size=2) * [0.0, 3.0][seed % 2]
    contact = ss.PlanarFrictionContact(kt=KT, mu=MU, kn=KN, normal_load=load0)
    dofs = ["x", "y", "z"]
    problem = ss.Problem(
        ss.MatrixStructure(M=np.eye(3), C=c * np.eye(3), K=np.diag(K), dofs=dofs),
        contacts=[
            ss.ContactPair(
                name="foot", contact=contact, tangential=("x", "y"), normal="z",
                rubbing=ss.RubbingMotion(velocity=tuple(v)),
            )
        ],
        loads=[ss.Load(dof=dof, cos=load[0, i], sin=load[1, i]) for i, dof in enumerate(dofs)],
        harmonics=range(orders + 1),
    )  # fmt: skip
    branch = ss.steady_response(problem, omega=omega)
    X = branch.dataset["displacement"].to_numpy()[0]
    m = np.arange(1, orders + 1)
    q, dq = X[:, 0] + X[:, 1::2].sum(1), omega * (X[:, 2::2] * m).sum(1)
    f = np.array([branch.loop(0, "foot", port=port)["force"][0] for port in ("tangential", "second")])
    state = next(name for a, b, name in branch.states(0)["foot"] for t in (0.0, 2 * np.pi) if a <= t < b)
    memory = {"slip": [np.arctan2(f[1], f[0]), 0.0], "stick": list(f), "separation": [0.0, 0.0]}[state]
    system = Marched(K, c, load, np.zeros(3), omega, -load0 / KN, v)
    end, met = system.period(np.concatenate([q, dq, memory]), "open" if state == "separation" else state)
    size = np.array([np.abs(X[:, 1:]).sum()] * 3 + [omega * np.abs(X[:, 1:]).sum()] * 3)
    return float((np.abs(end - np.concatenate([q, dq])) / size).max()), met


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("seed", range(6))
def test_a_periodic_motion_comes_back(seed: int) -> None:
    found, _ = error(seed, 25)
    assert found < 1e-4
    assert found < 0.5 * error(seed, 8)[0] + 1e-7  # what is left is the series cut off


@pytest.mark.verify
@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_of_many_systems() -> None:
    found = [error(seed, 25) for seed in range(100)]
    assert set().union(*(met for _, met in found)) == {"open", "stick", "slip"}
    errors = np.array([value for value, _ in found])
    assert np.quantile(errors, 0.9) < 5e-5, np.sort(errors)[-10:]
    assert errors.max() < 3e-4, np.sort(errors)[-10:]
