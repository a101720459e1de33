"""Rows: the contact element and the time integration against methods that share no code with them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics
from slipstick.verify.cases import EXACT_OSCILLATOR, oscillator
from slipstick.verify.marching import MarchedElements, marched_forces, random_elements
from slipstick.verify.table import Check, ExpectedFound

_SEED, _COUNT, _ORDERS = 5, 400, 4


def _errors(samples: int) -> np.ndarray:
    elements = random_elements(np.random.default_rng(_SEED), _COUNT, _ORDERS)
    f = element_forces(Harmonics(range(_ORDERS + 1)), **elements._asdict())
    Fx, Fy = marched_forces(elements, samples)
    scale = elements.kn * np.abs(elements.Y).sum(axis=1)
    return np.maximum(np.abs(f.Fx - Fx).max(axis=1), np.abs(f.Fy - Fy).max(axis=1)) / scale


def _marching() -> ExpectedFound:
    return 0.0, float(np.median(_errors(8192)))


def _marching_order() -> ExpectedFound:
    samples = np.array([1024, 4096])
    means = [float(_errors(int(n)).mean()) for n in samples]
    return 2.0, float(np.log(means[0] / means[1]) / np.log(samples[1] / samples[0]))


def _moved(elements: MarchedElements, name: str, step: float) -> MarchedElements:
    return elements._replace(**{name: getattr(elements, name) + step})


def _differences(name: str, derivative: str) -> ExpectedFound:
    """Derivative by one input against central differences: the middle of the relative errors over all elements."""
    elements, h, step = (
        random_elements(np.random.default_rng(_SEED), _COUNT, _ORDERS),
        Harmonics(range(_ORDERS + 1)),
        1e-6,
    )
    if name == "v":
        elements = elements._replace(v=np.where(elements.v == 0, 0.3, elements.v))
    f = element_forces(h, **elements._asdict())
    low, high = (element_forces(h, **_moved(elements, name, s)._asdict()).Fx for s in (-step, step))
    exact = getattr(f, derivative)
    scale = np.abs(f.Fx).max(axis=1) + np.abs(exact).max(axis=1) + 1e-12
    return 0.0, float(np.median(np.abs((high - low) / (2 * step) - exact).max(axis=1) / scale))


def _integrated(velocity: float, omega: float, which: int) -> ExpectedFound:
    from slipstick.analysis.time_domain.transient import transient

    r = transient(oscillator(velocity=velocity), omega)
    return EXACT_OSCILLATOR[velocity, omega][which], float((r.mean, r.amplitude)[which][0])


def _checks() -> Iterator[Check]:
    yield Check(name="march", what=f"{_COUNT} random elements against marching", compute=_marching, tolerance=1e-6)
    yield Check(name="march", what="order of the march towards the element", compute=_marching_order, tolerance=0.3)
    for name in ("mu", "kt", "kn", "gap", "v"):
        compute = partial(_differences, name, f"dFx_d{name}")
        yield Check(name="slope", what=f"dFx/d{name} against central differences", compute=compute, tolerance=1e-7)
    for velocity, omega in EXACT_OSCILLATOR:
        for which, name in enumerate(("mean", "amplitude")):
            what = f"time integration, v = {velocity:g}, omega = {omega:g}: {name}"
            tolerance = 1e-6 if which == 0 else 5e-6
            yield Check(
                name="time", what=what, compute=partial(_integrated, velocity, omega, which), tolerance=tolerance
            )


METHOD_CHECKS = tuple(_checks())
