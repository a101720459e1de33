"""Rules are exact to the degree they claim, and not beyond."""

from itertools import product
from math import factorial

import numpy as np
import pytest

from slipstick.fem.elements import gauss, prism, pyramid, tetrahedron, triangle


def on_interval(p):
    return (1 + (-1) ** p) / (p + 1)


def on_simplex(powers):
    return np.prod([factorial(p) for p in powers]) / factorial(sum(powers) + len(powers))


def on_pyramid(powers):
    """Across [-(1 - z), 1 - z]^2, then upwards: a beta function."""
    a, b, c = powers
    across = on_interval(a) * on_interval(b)
    return across * factorial(a + b + 2) * factorial(c) / factorial(a + b + c + 3)


RULES = [
    *((f"gauss {n}", gauss(n, 3), 2 * n - 1, lambda p: np.prod([on_interval(k) for k in p])) for n in (1, 2, 3)),
    *((f"triangle {n}", triangle(n), degree, on_simplex) for n, degree in ((1, 1), (3, 2), (7, 5))),
    *((f"tetrahedron {n}", tetrahedron(n), degree, on_simplex) for n, degree in ((1, 1), (4, 2), (15, 5))),
    *((f"pyramid {n}", pyramid(n), 2 * n - 1, on_pyramid) for n in (2, 3, 4)),
    *(
        (f"prism {n} {m}", prism(n, m), min(degree, 2 * m - 1), lambda p: on_simplex(p[:2]) * on_interval(p[2]))
        for n, m, degree in ((3, 2, 2), (3, 3, 2), (7, 3, 5))
    ),
]


@pytest.mark.parametrize(("rule", "degree", "exact"), [row[1:] for row in RULES], ids=[row[0] for row in RULES])
def test_degree(rule, degree, exact):
    def error(total):
        worst = 0.0
        for powers in product(range(total + 1), repeat=rule.points.shape[1]):
            if sum(powers) == total:
                value = rule.weights @ np.prod(rule.points ** np.array(powers), axis=1)
                worst = max(worst, abs(value - exact(powers)))
        return worst

    assert rule.weights.min() > 0
    assert max(error(total) for total in range(degree + 1)) < 1e-14
    assert error(degree + 1) > 1e-6
