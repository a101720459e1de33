"""Rows: the contact element, thermal equilibrium and the oscillator against closed forms CF1 to CF10."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.forces import ContactForces
from slipstick.contact.friction import FrictionContact, contact_forces
from slipstick.contact.rubbing import RubbingMotion
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array
from slipstick.verify import closed_forms as cf
from slipstick.verify.cases import DAMPING, LOAD, MASS, STIFFNESS, oscillator
from slipstick.verify.checks import Check, ExpectedFound

H = Harmonics(range(4))
OMEGA, MU, N = 2.5, 0.3, 100.0
LIMIT = MU * N
EXACT = 1e-10 * LIMIT


def _motion(constant: float = 0.0, cos: float = 0.0, sin: float = 0.0) -> Array:
    X = np.zeros(H.size)
    X[:3] = constant, cos, sin
    return X


def _element(X: Array, Y: Array | None = None, *, v: float = 0.0, kt: float = 50.0, kn: float = 1.0) -> ContactForces:
    """One element with mu = 0.3 and N0 = 100; ``v`` in length per radian."""
    contact = FrictionContact(kt=kt, mu=MU, kn=kn, gap=-N / kn)
    Y = np.zeros(H.size) if Y is None else Y
    return contact_forces(contact, H, X, Y, omega=OMEGA, rubbing=RubbingMotion(velocity=v * OMEGA))


def _masing_energy() -> ExpectedFound:
    return cf.masing(2.0, 50.0, LIMIT).energy, float(2 * np.pi * _element(_motion(cos=2.0)).work)


def _masing_cos() -> ExpectedFound:
    return cf.masing(2.0, 50.0, LIMIT).cos, float(_element(_motion(cos=2.0)).Fx[1])


def _rigid() -> ExpectedFound:
    """Slope of the difference from rigid friction over kt."""
    exact = np.array(cf.rigid_coulomb(1.0, 0.7, LIMIT))
    stiffness = np.array([1e5, 1e6, 1e7])
    differences = [np.abs(_element(_motion(sin=1.0), v=0.7, kt=kt).Fx[:2] - exact).max() for kt in stiffness]
    return -1.0, float(np.polyfit(np.log(stiffness), np.log(differences), 1)[0])


def _regimes() -> ExpectedFound:
    cases = [(v, kt) for v in (0.01, 0.3, 0.5, 0.8, 0.99999, 1.00001, 1.5) for kt in (1.0, 30.0, 60.0, 100.0, 1e3)]
    right = 0
    for v, kt in cases:
        states = _element(_motion(sin=1.0), v=v, kt=kt).states
        right += sum(name == "stick" for *_, name in states) == cf.sticks_a_period(1.0, v, kt, LIMIT)
    return float(len(cases)), float(right)


def _one_stick() -> ExpectedFound:
    return cf.one_stick(1.0, 0.5, 30.0, LIMIT)[2], float(_element(_motion(sin=1.0), v=0.5, kt=30.0).Fx[0])


def _slow_rubbing() -> ExpectedFound:
    return cf.slow_rubbing(1.0, 20.0, LIMIT)[0], float(_element(_motion(sin=1.0), v=1e-13, kt=20.0).Fx[0])


def _permanent_slip() -> ExpectedFound:
    f = _element(_motion(sin=1.0), _motion(cos=0.4), v=16.0, kn=70.0)
    return cf.slip_power(MU, N, 16.0 * OMEGA, 70.0, 1.0, 0.4, OMEGA), float(f.power)


def _permanent_slip_tangent() -> ExpectedFound:
    f = _element(_motion(sin=1.0), _motion(cos=0.4), v=16.0, kn=70.0)
    return 0.0, float(np.abs(f.dFx_dY - MU * 70.0 * np.eye(H.size)).max() + np.abs(f.dFx_dX).max())


def _normal_threshold() -> ExpectedFound:
    """Rubbing velocity at which the stick is born, by bisection on the state sequence."""
    low, high = 0.0, 1.0
    for _ in range(60):
        v = (low + high) / 2
        sticks = any(name == "stick" for *_, name in _element(_motion(), _motion(cos=0.4), v=v, kn=70.0).states)
        low, high = (v, high) if sticks else (low, v)
    return cf.normal_vibration_slip_velocity(MU, 70.0, 50.0, 0.4, OMEGA), high * OMEGA


def _normal_vibration_slow() -> ExpectedFound:
    f = _element(_motion(), _motion(cos=0.4), v=1e-13, kn=70.0)
    return cf.normal_vibration_slow(MU, N, 70.0, 0.4), float(f.Fx[0])


def _separation() -> ExpectedFound:
    f = contact_forces(FrictionContact(kt=50.0, mu=MU, kn=70.0, gap=0.5), H, _motion(), _motion(0.2, 1.0), omega=OMEGA)
    return cf.separation(0.2, 1.0, 0.5, 70.0)[1], float(f.Fy[1])


def _hot(mu: NDArray[np.float64], T: NDArray[np.float64]) -> float:
    """Temperature rise of a vibrating element in full slip with mu(T) a cubic table; 20 N, 5 m/s, 8 K/W."""
    from slipstick.state.thermal.equilibrium import equilibrium
    from slipstick.state.thermal.friction_curve import FrictionCurve

    curve, rubbing = FrictionCurve(temperature=T, mu=mu, interpolation="cubic"), RubbingMotion(velocity=5.0)

    def evaluate(temperature: Array) -> tuple[Array, Array]:
        contact = FrictionContact(kt=1e6, mu=curve.mu(temperature), kn=1e7, gap=-20e-7)
        f = contact_forces(contact, H, _motion(sin=1e-4)[None, :], np.zeros((1, H.size)), omega=1e3, rubbing=rubbing)
        return np.asarray(f.power), 20.0 * 5.0 * curve.dmu(temperature)

    return float(equilibrium(evaluate, [0.0], 8.0, limits=curve.limits).temperature[0])


def _hot_exponential() -> ExpectedFound:
    T = np.linspace(0.0, 600.0, 400)
    return cf.temperature_exponential(8.0, 20.0, 5.0, 0.5, 2e-3), _hot(0.5 * np.exp(-2e-3 * T), T)


def _hot_rational() -> ExpectedFound:
    T = np.linspace(0.0, 600.0, 400)
    return cf.temperature_rational(8.0, 20.0, 5.0, 0.5, 3e-3), _hot(0.5 / (1 + 3e-3 * T), T)


def _den_hartog() -> ExpectedFound:
    """Slope over kt of the difference from rigid friction, by time integration."""
    from slipstick.analysis.time_domain.transient import transient
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.loads import Load
    from slipstick.balance.problem import Problem
    from slipstick.structure.matrices import MatrixStructure

    structure = MatrixStructure(M=[[1.0]], C=[[0.0]], K=[[1.0]], dofs=["x"])
    stiffness = np.array([1e4, 1e5, 1e6])
    amplitudes = []
    for kt in stiffness:
        pair = ContactPair(name="c", contact=FrictionContact(kt=kt, mu=0.5, gap=-1.0), tangential={"x": 1.0})
        loads, h = [Load(dof="x", cos=1.0)], Harmonics(range(2))
        problem = Problem(structure, contacts=[pair], loads=loads, harmonics=h, told=None)  # h is not used in time
        amplitudes.append(transient(problem, 0.9, tolerance=1e-12).amplitude[0])
    difference = np.abs(np.array(amplitudes) - cf.den_hartog(1.0, 1.0, 1.0, 0.5, 0.9))
    return -0.5, float(np.polyfit(np.log(stiffness), np.log(difference), 1)[0])


def _oscillator_power() -> ExpectedFound:
    """Power of the oscillator just above its slip threshold: mu N v."""
    from slipstick.analysis.time_domain.transient import transient

    velocity = 1.001 * cf.slip_threshold(MASS, DAMPING, STIFFNESS, LOAD, 5.0)
    return 240.0 * velocity, float(transient(oscillator(velocity=velocity), 5.0).power[0])


CLOSED_FORM_CHECKS = (
    Check(name="CF1", what="Masing loop, energy a period", compute=_masing_energy, tolerance=EXACT),
    Check(name="CF1", what="Masing loop, cosine of the friction force", compute=_masing_cos, tolerance=EXACT),
    Check(name="CF2", what="approach to rigid friction under rubbing, order in kt", compute=_rigid, tolerance=0.02),
    Check(name="CF3", what="0, 1 or 2 sticks a period: cases right", compute=_regimes),
    Check(name="CF3", what="one stick a period, mean friction force", compute=_one_stick, tolerance=EXACT),
    Check(name="CF4", what="slow rubbing, mean friction force", compute=_slow_rubbing, tolerance=EXACT),
    Check(name="CF5", what="full slip, power", compute=_permanent_slip, tolerance=1e-8),
    Check(name="CF5", what="full slip, dFx/dY = mu kn I", compute=_permanent_slip_tangent, tolerance=1e-10),
    Check(name="CF6", what="normal vibration alone, velocity without stick", compute=_normal_threshold, tolerance=1e-8),
    Check(name="CF6", what="normal vibration alone, slow rubbing", compute=_normal_vibration_slow, tolerance=EXACT),
    Check(name="CF7", what="separation, cosine of the normal force", compute=_separation, tolerance=EXACT),
    Check(name="CF8", what="temperature rise in full slip (Lambert W)", compute=_hot_exponential, tolerance=1e-5),
    Check(name="CF8", what="temperature rise in full slip (quadratic)", compute=_hot_rational, tolerance=1e-5),
    Check(name="CF9", what="approach to Den Hartog's rigid friction, order in kt", compute=_den_hartog, tolerance=0.02),
    Check(name="CF10", what="oscillator in full slip, power = mu N v", compute=_oscillator_power, tolerance=1e-6),
)
