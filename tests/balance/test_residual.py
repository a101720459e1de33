"""The residual of the balance against a balance written out anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.problems import port_forces, random_problem

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem


def test_residual_is_the_balance_of_the_full_matrices() -> None:
    """``X + A (F - P) = 0`` is the port form of ``Z q = p - D f``: checked for the matrices themselves."""
    problem = random_problem(4)
    balance, omega, h = Balance(problem), 5.0, problem.harmonics
    x = 0.3 * np.random.default_rng(1).standard_normal(balance.size)
    F = port_forces(balance, x, omega, problem)
    D, s = balance.directions, problem.structure
    q = np.zeros((len(s.dofs), h.size))
    load = np.zeros_like(q)
    for each in problem.loads:
        row = s.dofs.index(str(each.dof))
        load[row, h.index(each.harmonic, "c")] += each.cos
        if each.harmonic:
            load[row, h.index(each.harmonic, "s")] += each.sin
    rhs = load - D @ F
    q[:, 0] = np.linalg.solve(s.K, rhs[:, 0])
    for j, m in enumerate(h.orders[1:]):
        Z = s.K * (1 + 1j * s.loss_factor) - (m * omega) ** 2 * s.M + 1j * m * omega * s.C
        hat = np.linalg.solve(Z, rhs[:, 2 * j + 1] - 1j * rhs[:, 2 * j + 2])
        q[:, 2 * j + 1], q[:, 2 * j + 2] = hat.real, -hat.imag
    wanted = x.reshape(balance.n_ports, -1) - D.T @ q
    found = FrequencySystem(balance, problem.inputs).evaluate(x, omega).residual.reshape(wanted.shape)
    assert found == pytest.approx(wanted, abs=1e-11 * np.abs(wanted).max())


def test_zero_harmonic_alone_is_a_static_problem() -> None:
    problem = random_problem(0)
    pairs = [replace(pair, rubbing=ss.RubbingMotion(velocity=pair.rubbing.velocity)) for pair in problem.contacts]
    static = replace(
        problem, contacts=pairs, loads=[ss.Load(dof="d2", harmonic=0, cos=20.0)], harmonics=ss.Harmonics([0])
    )
    balance = Balance(static)
    found = FrequencySystem(balance, static.inputs).evaluate(np.zeros(balance.size), 3.0)
    F = port_forces(balance, np.zeros(balance.size), 3.0, static)[:, 0]
    A = balance.receptance.static
    wanted = A[:, :5] @ F - 20.0 * A[:, 5]
    assert found.residual == pytest.approx(wanted, rel=1e-12)
