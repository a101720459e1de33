"""Mean force of a contact that sticks all period, where it is known at which motion its spring has no force.

A stuck contact admits an interval of mean forces (THEORY.md section 3), in the plane a convex set. Of them it has
``kt (x - rest)``, with the mean x of its motion, if that is admissible: it has not slipped since the preload. Else it
has slipped up to the border while the vibration grew: the mean is the nearest one of the interval. In the plane it is
the last one on the straight way from the middle. A contact that slips in each period has forgotten.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from slipstick.contact.forces import ContactForces, element_forces
from slipstick.contact.law import Motion
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

REST, SECOND_REST = "rest", "second_rest"
_LEAST_DRIFT = 1e-300
"""Velocity that tells the side of the interval and changes no number."""
_ROUNDS, _FINER = 5, 8.0
"""Rounds in which the time is refined at which a planar contact would slip."""


def remember(f: ContactForces, motion: Motion, values: Mapping[str, Array], rest: Array) -> Array:
    """Write the means of contacts along one direction, with their derivatives, into ``f``; return those by ``rest``."""
    kt, x = values["kt"], motion.Q[0][:, 0]
    low, high = f.residual_traction.T
    wanted, loose = kt * (x - rest), low < high
    inside = loose & (wanted >= low) & (wanted <= high)
    by_rest = np.zeros_like(f.Fx)
    by_rest[inside, 0] = -kt[inside]
    f.Fx[inside, 0], f.dFx_dX[inside, 0], f.dFx_dY[inside, 0] = wanted[inside], 0.0, 0.0
    f.dFx_dX[inside, 0, 0] = kt[inside]
    f.dFx_dmu[inside, 0], f.dFx_dkn[inside, 0], f.dFx_dkt[inside, 0] = 0.0, 0.0, (x - rest)[inside]
    for side, beyond in ((-1.0, loose & (wanted < low)), (1.0, loose & (wanted > high))):
        if beyond.any():
            own = {name: value[beyond] for name, value in values.items()}
            drift = np.full(np.count_nonzero(beyond), side * _LEAST_DRIFT)
            at = element_forces(motion.harmonics, motion.Q[0][beyond], motion.Q[1][beyond], v=drift, **own)
            for name in ("Fx", "dFx_dX", "dFx_dY", "dFx_dmu", "dFx_dkt", "dFx_dkn"):
                getattr(f, name)[beyond] = getattr(at, name)
    return by_rest


def remember_in_plane(
    harmonics: Harmonics, X: Array, values: Mapping[str, Array], rest: Sequence[Array], loose: Array,
    out: tuple[Array, Array],
) -> Array:  # fmt: skip
    """The same in the plane: ``out`` are forces (n, 3, L) and derivatives (n, 3, L, 3 L + 6) of all elements.

    ``X`` (n, 3, L) is their motion, ``loose`` (n,) marks those that stick all period. Returns the derivatives of the
    means by both components of ``rest``, (n, 2, 2).
    """
    forces, derivatives = out
    n, L = len(X), harmonics.size
    by_rest, at = np.zeros((n, 2, 2)), np.flatnonzero(loose)
    if not at.size:
        return by_rest
    kt, mu, kn, gap = (np.asarray(values[name], dtype=float)[at] for name in ("kt", "mu", "kn", "gap"))
    shift = X[at, :2, 0] - np.stack([r[at] for r in rest], axis=1)
    middle = forces[at, :2, 0]
    way = kt[:, None] * shift - middle

    def moved(tau: Array) -> tuple[Array, Array, Array]:
        """Basis (k, T, L), motion about its mean (k, 2, T) and penetration (k, T) at phases (k, T)."""
        H = harmonics.H_minus(tau.reshape(-1)).reshape(*tau.shape, L)
        y = np.einsum("ktl,kl->kt", H, X[at, 2]) - gap[:, None]
        return H, np.einsum("ktl,kil->kit", H[..., 1:], X[at, :2, 1:]), y

    def share(tau: Array) -> Array:
        """Share of the way to the wanted mean at which the force meets the circle, (k, T)."""
        _, w, y = moved(tau)
        g, b = middle[:, :, None] + kt[:, None, None] * w, (mu * kn)[:, None] * y
        A, B, C = np.sum(way**2, axis=1)[:, None], np.einsum("ki,kit->kt", way, g), np.sum(g**2, axis=1) - b**2
        root = np.sqrt(np.maximum(B * B - A * C, 0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.where(B > 0.0, -C / (B + root), (root - B) / A)
        return np.where(A > 0.0, np.maximum(np.nan_to_num(found, nan=np.inf, posinf=np.inf), 0.0), np.inf)

    samples = 16 * (max(harmonics.orders) + 2)
    tau = np.tile(np.linspace(0.0, 2.0 * np.pi, samples, endpoint=False), (at.size, 1))
    step, place = 2.0 * np.pi / samples, np.arange(at.size)
    when = tau[place, np.argmin(share(tau), axis=1)]
    for _ in range(_ROUNDS):
        three = share(when[:, None] + step * np.array([-1.0, 0.0, 1.0]))
        with np.errstate(invalid="ignore"):
            bend, slope = three[:, 0] - 2.0 * three[:, 1] + three[:, 2], three[:, 0] - three[:, 2]
        curved = np.isfinite(bend) & (bend > 0.0)
        ahead = np.divide(0.5 * slope, bend, out=np.zeros_like(bend), where=curved)
        when, step = when + step * np.clip(ahead, -1.0, 1.0), step / _FINER
    s = share(when[:, None])[:, 0]
    inside, s = s >= 1.0, np.minimum(s, 1.0)
    columns = derivatives.shape[3]
    wanted = np.zeros((at.size, 2, columns))
    for i in (0, 1):
        wanted[:, i, i * L], wanted[:, i, 3 * L + 2] = kt, shift[:, i]
    of_middle = derivatives[at, :2, 0, :].copy()
    ways = (1.0 - s)[:, None, None] * of_middle + s[:, None, None] * wanted
    own = -kt[:, None, None] * s[:, None, None] * np.eye(2)
    if not inside.all():
        at_time = moved(when[:, None])
        H, w, y = at_time[0][:, 0], at_time[1][:, :, 0], at_time[2][:, 0]
        force = middle + s[:, None] * way + kt[:, None] * w
        normal = force / np.maximum(np.linalg.norm(force, axis=1), 1e-300)[:, None]
        margin = np.einsum("ki,kic->kc", normal, ways)
        for i in (0, 1):
            margin[:, i * L + 1 : (i + 1) * L] += (kt * normal[:, i])[:, None] * H[:, 1:]
        margin[:, 3 * L + 2] += np.sum(normal * w, axis=1)
        margin[:, 2 * L : 3 * L] -= (mu * kn)[:, None] * H
        margin[:, 3 * L + 3] -= kn * y
        margin[:, 3 * L + 4] -= mu * y
        margin[:, 3 * L + 5] += mu * kn
        grows = np.sum(normal * way, axis=1)
        rate = np.divide(-1.0, grows, out=np.zeros_like(grows), where=~inside & (grows > 0.0))
        ways += way[:, :, None] * (rate[:, None] * margin)[:, None, :]
        own += way[:, :, None] * (rate[:, None] * np.einsum("ki,kij->kj", normal, own))[:, None, :]
    forces[at, :2, 0] = middle + s[:, None] * way
    derivatives[at, :2, 0, :] = ways
    by_rest[at] = own
    return by_rest


def rest_of(values: Mapping[str, Any]) -> tuple[dict[str, Any], list[Any]]:
    """Parameters without the motions at rest, and these."""
    names = [name for name in (REST, SECOND_REST) if name in values]
    return {name: value for name, value in values.items() if name not in names}, [values[name] for name in names]
