"""Campbell and interference diagrams in a page, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.reports import branch as masses
from helpers.rings import disc_and_wave

import slipstick as ss
from slipstick.report.curves import diagram_of


def test_a_rotor_has_its_whirl_frequencies_and_critical_speed() -> None:
    """w^2 -+ W w - 4 = 0: backward whirl is met at W = sqrt 2, forward whirl never."""
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    top = ss.MatrixStructure(
        M=np.eye(2), C=1e-9 * np.eye(2), K=4.0 * np.eye(2), gyroscopic=turn, speed=0.0, dofs=["x", "y"]
    )
    problem = ss.Problem(top, loads=ss.Load(dof="x", cos=1.0), harmonics=[0, 1])
    found = diagram_of(ss.linear_response(problem, omega=[1.0, 1.5, 3.0]))
    assert found is not None
    assert [line["name"] for line in found["lines"]] == [
        "mode 1, backward whirl",
        "mode 2, forward whirl",
        "engine order 1",
    ]
    speed = np.array(found["lines"][0]["x"])
    assert (speed[0], speed[-1]) == (0.0, 3.0)
    for line, sign in zip(found["lines"][:2], (-1.0, 1.0), strict=True):
        np.testing.assert_allclose(line["y"], sign * speed / 2 + np.sqrt(speed**2 / 4 + 4), rtol=1e-9)
    ((met,),) = [found["met"]]
    assert (met["x"], met["y"]) == (pytest.approx(np.sqrt(2)), pytest.approx(np.sqrt(2)))


def test_a_wave_is_met_at_its_own_nodal_diameter() -> None:
    """6 masses in a ring: w^2 = k + 4 kc sin^2(pi d / 6); both harmonics of engine order 2 have 2 nodal diameters."""
    sector = ss.CyclicStructure(M=[[1.0]], K=([[4.0 + 2.0]], [[-1.0]]), dofs=["x"], sectors=6, loss_factor=1e-3)
    problem = ss.Problem(sector.travelling_wave(2), loads=ss.Load(dof="x", cos=1.0), harmonics=[0, 1, 2])
    found = diagram_of(ss.linear_response(problem, omega=[2.0, 2.5, 3.0]))
    assert found is not None
    family, *excited = found["lines"]
    frequency = np.sqrt(4.0 + 4.0 * np.sin(np.pi * np.arange(4) / 6) ** 2)
    np.testing.assert_allclose(family["y"], frequency, rtol=1e-12)
    assert [(line["x"], line["y"]) for line in excited] == [([2.0, 2.0], [2.0, 3.0]), ([2.0, 2.0], [4.0, 6.0])]
    (met,) = found["met"]
    assert (met["x"], met["y"], met["said"]) == (
        2,
        pytest.approx(np.sqrt(7.0)),
        "harmonic 1, 2 nodal diameters, mode 1",
    )


def test_others_have_none() -> None:
    """No rotor and no wave, a whole disc, and a single frequency."""
    assert diagram_of(masses()) is None
    assert [diagram_of(made) for made in disc_and_wave()] == [None, None]
