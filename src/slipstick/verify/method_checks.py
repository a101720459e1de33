"""Rows: the contact element and the time integration against methods that share no code with them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array
from slipstick.verify.cases import EXACT_OSCILLATOR, oscillator
from slipstick.verify.checks import Check, ExpectedFound


class MarchedElements(NamedTuple):
    """Inputs of n elements: motions (n, L), the rest (n,)."""

    X: Array
    Y: Array
    v: Array
    kt: Array
    mu: Array
    kn: Array
    gap: Array


def random_elements(rng: np.random.Generator, n: int, orders: int) -> MarchedElements:
    """Elements with harmonics 0 .. orders; about half open now and then, one in five without rubbing velocity."""
    L = 2 * orders + 1
    X, Y = rng.normal(size=(2, n, L)) / np.repeat(np.arange(1.0, orders + 2), 2)[1:]
    v = rng.choice([-1.0, 1.0], n) * 10 ** rng.uniform(-3, 1, n)
    v[rng.random(n) < 0.2] = 0.0
    swing = np.abs(Y[:, 1:]).sum(axis=1)
    kt, mu, kn = 10 ** rng.uniform(-1, 1, n), rng.uniform(0.1, 1.0, n), 10 ** rng.uniform(-0.5, 0.5, n)
    return MarchedElements(X=X, Y=Y, v=v, kt=kt, mu=mu, kn=kn, gap=Y[:, 0] + swing * rng.uniform(-1.2, 0.5, n))


def marched_forces(e: MarchedElements, samples: int) -> tuple[Array, Array]:
    """Coefficients of the tangential and the normal force, (n, L) each."""
    tau = 2 * np.pi * np.arange(samples) / samples
    angle = tau[:, None] * np.arange(1, e.X.shape[1] // 2 + 1)
    H = np.ones((samples, e.X.shape[1]))
    H[:, 1::2], H[:, 2::2] = np.cos(angle), np.sin(angle)
    w, y = H @ e.X.T, H @ e.Y.T - e.gap
    bound = e.mu * e.kn * np.maximum(y, 0.0)
    y_before = np.roll(y, 1, axis=0)
    # where contact begins inside a step, only the part of the step in contact moves the spring
    part = np.where((y > 0) & (y_before < 0), y / np.where(y == y_before, 1.0, y - y_before), 1.0)
    moves = part * e.kt * (w - np.roll(w, 1, axis=0) + e.v * 2 * np.pi / samples)

    def once(f: Array) -> tuple[Array, Array]:
        path = np.empty_like(w)
        for i in range(samples):
            path[i] = f
            j = (i + 1) % samples
            f = np.clip(f + moves[j], -bound[j], bound[j])
        return f, path

    high, low = once(bound[0])[0], once(-bound[0])[0]
    _, path = once(np.where(e.v > 0, high, np.where(e.v < 0, low, (high + low) / 2)))
    P = 2 * H / samples
    P[:, 0] /= 2
    return path.T @ P, (e.kn * np.maximum(y, 0.0)).T @ P


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
    elements = random_elements(np.random.default_rng(_SEED), _COUNT, _ORDERS)
    h, step = Harmonics(range(_ORDERS + 1)), 1e-6
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
            compute = partial(_integrated, velocity, omega, which)
            yield Check(name="time", what=what, compute=compute, tolerance=1e-6 if which == 0 else 5e-6)


METHOD_CHECKS = tuple(_checks())
