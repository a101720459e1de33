"""Contact stiffness of rough surfaces, spheres and rules: closed forms, integrals, differences."""

import numpy as np
import pytest
from scipy.integrate import quad

import slipstick as ss
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.model import elastic_model
from slipstick.models.contact_stiffness import greenwood_williamson, hertz_mindlin, penalty_stiffness

STEEL = ss.Material(young=2.1e11, poisson=0.3, density=7800.0)
ALUMINIUM = ss.Material(young=7e10, poisson=0.33)
ROUGH = {"height": 0.8e-6, "radius": 5e-5, "density": 2e10, "first": STEEL, "second": ALUMINIUM}


def summits(power, h):
    return quad(lambda s: (s - h) ** power * np.exp(-0.5 * s * s) / np.sqrt(2 * np.pi), h, h + 12, epsabs=0.0)[0]


@pytest.mark.parametrize("pressure", [1e3, 1e6, 1e8, 1e10])
def test_the_pressure_is_that_of_the_integral_over_the_summits(pressure):
    found = greenwood_williamson(pressure, **ROUGH)
    E = 1 / ((1 - 0.3**2) / 2.1e11 + (1 - 0.33**2) / 7e10)
    h = found.closure / 0.8e-6
    scale = E * 2e10 * np.sqrt(5e-5)
    assert 4 / 3 * scale * 0.8e-6**1.5 * summits(1.5, h) == pytest.approx(pressure, rel=1e-7)
    assert found.kn == pytest.approx(2 * scale * np.sqrt(0.8e-6) * summits(0.5, h), rel=1e-7)
    assert found.contact_area == pytest.approx(np.pi * 2e10 * 5e-5 * 0.8e-6 * summits(1.0, h), rel=1e-7)


def test_the_normal_stiffness_is_the_slope_of_the_pressure_over_the_closure():
    low, high = (greenwood_williamson(1e7 * (1 + step), **ROUGH) for step in (-1e-5, 1e-5))
    slope = 2e-5 * 1e7 / (low.closure - high.closure)
    assert greenwood_williamson(1e7, **ROUGH).kn == pytest.approx(slope, rel=1e-8)


def test_hertz_is_the_slope_of_force_over_approach_and_mindlin_the_ratio():
    low, high = (hertz_mindlin(50.0 * (1 + step), radius=0.02, first=STEEL) for step in (-1e-5, 1e-5))
    found = hertz_mindlin(50.0, radius=0.02, first=STEEL)
    assert found.kn == pytest.approx(50.0 * 2e-5 / (high.closure - low.closure), rel=1e-8)
    assert found.kt / found.kn == pytest.approx(2 * (1 - 0.3) / (2 - 0.3), rel=1e-14)
    E = 2.1e11 / (2 * (1 - 0.3**2))
    assert found.closure == pytest.approx((9 * 50.0**2 / (16 * 0.02 * E**2)) ** (1 / 3), rel=1e-13)
    a = np.sqrt(found.contact_area / np.pi)
    G = STEEL.shear_modulus
    assert found.kt == pytest.approx(4 * G * a / (2 - 0.3), rel=1e-13)


@pytest.mark.parametrize("kind", ["hex8", "hex20"])
def test_rules_of_other_codes(kind):
    model = elastic_model(box((0.1, 0.02, 0.03), (5, 2, 6), kind), STEEL, ["x0"])
    bulk = 2.1e11 / (3 * (1 - 0.6))
    assert penalty_stiffness("ls-dyna", model, "z1").kn == pytest.approx(0.1 * bulk / 0.005, rel=1e-12)
    assert penalty_stiffness("calculix", model, "z1").kn == pytest.approx(50 * 2.1e11, rel=1e-14)
    with pytest.raises(InputError, match=r"code: there is no rule of .abaqus.; there are calculix, ls-dyna"):
        penalty_stiffness("abaqus", model, "z1")
    with pytest.raises(InputError, match="surface 'z2'"):
        penalty_stiffness("calculix", model, "z2")


def test_faults_are_told_together():
    with pytest.raises(InputError) as error:
        greenwood_williamson(-1.0, height=0.0, radius="a", density=1e10, first=3)
    for part in ("pressure", "height", "radius", "first: found 3; expected an ss.Material"):
        assert part in str(error.value)
    with pytest.raises(InputError, match=r"pressure: found 1e\+40; expected a pressure from"):
        greenwood_williamson(1e40, **ROUGH)
