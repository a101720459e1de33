"""Structured elements: what people type and what symmetry makes, and what random numbers never meet.

Round amplitudes, rational phases, equal values, few harmonics out of many, trial functions that cancel, gaps that just
touch, and rates of motion or openings that are products with double and triple roots at multiples of pi/k.
"""

import numpy as np

SETS = [
    [0, 1], [0, 2], [0, 6], [0, 15], [0, 1, 2], [0, 1, 3], [0, 2, 3], [0, 4, 6], [0, 1, 2, 3], [0, 2, 4, 6],
    [0, 1, 3, 5, 7], [0, 3, 6, 9, 12], [0, 1, 7, 20], list(range(6)), list(range(8)), list(range(11)), list(range(16)),
    [0, *range(1, 22, 2)], list(range(0, 25, 4)), [0, 5, 40],
]  # fmt: skip
DIVISIONS = [1, 2, 3, 4, 5, 6, 8, 12]
EVEN_DIVISIONS = [2, 4, 6, 8, 10, 12]


def rotation(orders, s):
    """Coefficients of f(tau + s) from those of f(tau)."""
    R = np.eye(2 * len(orders) - 1)
    for k, m in enumerate(orders[1:]):
        c, d = np.cos(m * s), np.sin(m * s)
        R[1 + 2 * k : 3 + 2 * k, 1 + 2 * k : 3 + 2 * k] = [[c, d], [-d, c]]
    return R


def harmonics_with_round_phases(rng, orders):
    """A few harmonics of round amplitude, each at a multiple of pi/k; often a single one, often equal."""
    n = len(orders) - 1
    out = np.zeros(2 * n + 1)
    few = rng.choice(n, min(n, rng.choice([1, 1, 2, 3, n])), replace=False)
    equal = rng.choice([1.0, 0.5, 2.0])
    for j in few:
        amplitude = equal if rng.random() < 0.5 else rng.choice([1.0, 0.5, 2.0, 0.1, 10.0])
        phase = np.pi * rng.integers(0, 24) / rng.choice(DIVISIONS)
        out[2 * j + 1 : 2 * j + 3] = amplitude * np.round([np.cos(phase), np.sin(phase)], 15)
    return out


def product(rng, orders):
    """Coefficients of a product of ``sin((tau - a)/2)`` over places ``a`` among the multiples of pi/k, some of them
    twice or three times; of the degree of the leading consecutive orders."""
    degree = next((k for k, m in enumerate(orders) if k != m), len(orders)) - 1
    degree = int(rng.integers(1, max(degree, 1) + 1))
    places = np.pi * rng.integers(0, 12, 2 * degree) / rng.choice(EVEN_DIVISIONS)
    places[: 2 * degree // 3 * 2 : 2] = places[1 : 2 * degree // 3 * 2 + 1 : 2]
    if degree > 1 and rng.random() < 0.3:
        places[2] = places[0]
    tau = 2 * np.pi * np.arange(64) / 64
    c = np.fft.rfft(np.prod([np.sin((tau - a) / 2) for a in places], axis=0)) / 64
    out = np.zeros(2 * len(orders) - 1)
    out[0] = c[0].real
    for j in range(1, len(orders)):
        if orders[j] <= degree:
            out[2 * j - 1 : 2 * j + 1] = 2 * c[orders[j]].real, -2 * c[orders[j]].imag
    return out / np.abs(out).max()


def integral(orders, p):
    """Periodic motion whose rate is ``p`` less its mean."""
    out = np.zeros_like(p)
    m = np.asarray(orders[1:], float)
    out[1::2], out[2::2] = -p[2::2] / m, p[1::2] / m
    return out


def structured_state(rng, orders):
    """One element."""
    kt, mu, kn = rng.choice([1.0, 0.5, 2.0, 10.0, 100.0]), rng.choice([0.3, 0.5, 1.0]), rng.choice([1.0, 2.0])
    X = harmonics_with_round_phases(rng, orders)
    v = rng.choice([0.0, 0.0, 1.0, -1.0, 0.5, 2.0, 1e-3]) * rng.choice([1.0, rng.choice(orders[1:])])
    dense = orders[1] == 1
    if dense and rng.random() < 0.3:
        p = product(rng, orders)
        X, v = integral(orders, p), p[0] * rng.choice([1.0, 1.0, 0.0])
    Y = harmonics_with_round_phases(rng, orders)
    size = np.abs(Y[1:]).sum()
    gap = rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0, -1.0, -2.0]) * size
    kind = rng.random()
    if kind < 0.25:
        Y[:], gap = 0.0, -rng.choice([1.0, 0.1, 2.0, 10.0])
    elif kind < 0.4 and dense:
        Y, gap = product(rng, orders), 0.0
    elif kind < 0.5:
        X = rng.choice([1.0, -1.0]) * mu * kn / kt * Y  # one trial function vanishes but for the velocity
        X[0] = 0.0
    return {"X": X, "Y": Y, "v": v, "kt": kt, "mu": mu, "kn": kn, "gap": gap}


def structured_states(rng, n, orders):
    """A batch of elements."""
    made = [structured_state(rng, orders) for _ in range(n)]
    return {name: np.array([state[name] for state in made], float) for name in made[0]}


def load_scale(state):
    """Friction limit at the size of the normal motion, (n,): what rounding of the forces is relative to."""
    return state["mu"] * state["kn"] * (np.abs(state["Y"][:, 1:]).sum(axis=1) + np.abs(state["Y"][:, 0] - state["gap"]))


def shifted(orders, state, s):
    """The states seen from another start of the period; ``s`` (n,)."""
    R = np.array([rotation(orders, a) for a in s])
    return {**state, **{k: np.einsum("eij,ej->ei", R, state[k]) for k in ("X", "Y")}}, R
