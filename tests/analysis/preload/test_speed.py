"""Centrifugal forces as load steps, against closed forms of a turning bar."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.model import elastic_model

E, A, L, RHO, KN, GAP = 2e11, 1e-4, 0.2, 7800.0, 3e8, 2e-6
STEEL = ss.Material(young=E, poisson=0.0, density=RHO)
SPINDLE = {"point": (0, 0, 0), "direction": (0, 0, 1)}


def turning(kind="hex20", start=0.0, centrifugal=SPINDLE, **options):
    bar = elastic_model(box((L, 0.01, 0.01), (6, 1, 1), kind, at=(start, -0.005, 0.0)), STEEL, ["x0"])
    body = ss.reduced_body(bar, keep=["x1 x"], modes=4, loss_factor=0.01, centrifugal=centrifugal)
    stop = ss.ContactPair(name="stop", contact=ss.FrictionContact(kn=KN, gap=GAP), normal={"x1 x": 1.0})
    return ss.Problem(body.structure, contacts=stop, loads=ss.Load(dof="x1 x", cos=1.0), harmonics=3, **options)


def stretched(speed, start=0.0):
    """Motion of the free end of a bar from ``start`` to ``start + L``."""
    a, b = start, start + L
    return RHO * speed**2 / E * (b * b * (b - a) - (b**3 - a**3) / 3) / 2


@pytest.mark.parametrize("kind", ["hex8", "hex20", "tet10"])
@pytest.mark.parametrize("start", [0.0, 0.3])
def test_a_turning_bar_stretches_and_presses_against_its_stop(kind, start):
    steps = [
        ss.LoadStep(name="slow", speed="1000 rpm"),
        ss.LoadStep(name="fast", speed=1500.0),
        ss.LoadStep(name="stays"),
        ss.LoadStep(name="stopped", speed=0.0),
    ]
    data = ss.preload(turning(kind, start), steps).dataset
    pressed = []
    for speed in (1000 * np.pi / 30, 1500.0, 1500.0, 0.0):
        free = stretched(speed, start)
        pressed.append(max(0.0, (free - GAP) / (L / (E * A) + 1.0 / KN)))
    assert pressed[1] > 100.0
    within = 1e-6
    assert data.normal_force.values[:, 0] == pytest.approx(np.array(pressed), rel=within, abs=1e-6)


def test_the_axis_may_lie_anywhere():
    shifted = turning(centrifugal={"point": (0.1, 0.0, 0.0), "direction": (0, 0, 2)})
    force = ss.preload(shifted, ss.LoadStep(speed=3000.0)).dataset.normal_force.item()
    a, b = -0.1, 0.1
    free = RHO * 3000.0**2 / E * (b * b * (b - a) - (b**3 - a**3) / 3) / 2
    assert force == pytest.approx((free - GAP) / (L / (E * A) + 1.0 / KN), rel=1e-6)


def test_faults_are_told():
    with pytest.raises(InputError, match=r"steps, number 1, speed: the structure has no centrifugal forces; give"):
        ss.preload(turning(centrifugal=None), ss.LoadStep(speed=1.0))
    with pytest.raises(InputError, match=r"speed: found -1.0; expected a speed >= 0"):
        ss.LoadStep(speed=-1.0)
    with pytest.raises(InputError, match="centrifugal"):
        turning(centrifugal=3)
    with pytest.raises(InputError, match="centrifugal"):
        turning(centrifugal={"direction": (0, 0, 0)})
