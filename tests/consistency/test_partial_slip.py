"""Load steps against contact mechanics: Hertz and Cattaneo-Mindlin on an elastic half-plane, a press fit of two rings.

K. L. Johnson, Contact Mechanics, Cambridge 1985, sections 4.2 and 7.2, for cylinders.
"""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import slipstick as ss
from slipstick.fem.box import box
from slipstick.fem.mesh import Mesh, Surface, together
from slipstick.fem.model import elastic_model

E, RADIUS, P, MU = 1.0, 1.0, 0.02, 0.4
"""Combined modulus, radius, normal force by length, friction coefficient."""
A = np.sqrt(4.0 * P * RADIUS / (np.pi * E))
"""Half width of the contact."""
PRESSURE = 2.0 * P / (np.pi * A)


def flexibility(x, width):
    """Displacement of the surface of a half-plane at x by forces on strips there, (n, n)."""
    distance = np.subtract.outer(x, x)

    def primitive(s):
        return s * (np.log(np.abs(s) / 1e3) - 1.0)

    strip = primitive(distance + 0.5 * width) - primitive(distance - 0.5 * width)
    return -2.0 / (np.pi * E) * strip / width


def cylinder(n):
    """A rigid cylinder on a half-plane with the combined modulus, strips along x; dofs z and s are the cylinder's."""
    edges = np.linspace(-1.25 * A, 1.25 * A, n + 1)
    x, width = 0.5 * (edges[1:] + edges[:-1]), edges[1] - edges[0]
    K = np.linalg.inv(flexibility(x, width))
    K = 0.5 * (K + K.T)
    whole = np.zeros((2 * n + 2, 2 * n + 2))
    whole[:n, :n], whole[n:-2, n:-2] = K, K
    whole[-2, -2] = whole[-1, -1] = 1e-9
    dofs = [*(f"u{i}" for i in range(n)), *(f"t{i}" for i in range(n)), "z", "s"]
    structure = ss.MatrixStructure(M=np.eye(2 * n + 2), K=whole, dofs=dofs)
    stiff = 300.0 * E * width / A
    contact = ss.FrictionContact(kt=stiff, kn=stiff, mu=MU, gap=x**2 / (2.0 * RADIUS))
    pair = ss.ContactPair(
        name="line", contact=contact, tangential=[{"s": 1.0, f"t{i}": -1.0} for i in range(n)],
        normal=[{"z": 1.0, f"u{i}": -1.0} for i in range(n)],
    )  # fmt: skip
    return ss.Problem(structure, contacts=pair, outputs=["z", "s"]), x, width


def dome(x, half):
    return np.sqrt(np.maximum(1.0 - (x / half) ** 2, 0.0))


def mindlin(x, Q):
    """Traction by a first load Q over mu times the largest pressure."""
    c = A * np.sqrt(1.0 - Q / (MU * P))
    return dome(x, A) - c / A * dome(x, c)


@pytest.mark.parametrize("n", [40, pytest.param(120, marks=pytest.mark.verify)])
def test_hertz_and_partial_slip_in_a_load_cycle(n):
    problem, x, width = cylinder(n)
    Q, back = 0.6 * MU * P, -0.2 * MU * P

    def push(force):
        return ss.LoadStep(loads=ss.Load(dof="s", harmonic=0, cos=force))

    press = ss.LoadStep(loads=ss.Load(dof="z", harmonic=0, cos=P))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Newton's method stalled")  # the cylinder hangs on next to nothing
        state = ss.preload(problem, [press, push(Q), push(back), push(Q)])
        parts = ss.preload(problem, [press, *(push(Q * part) for part in (0.3, 0.7, 1.0))])
    data, close = state.dataset, 0.07 if n < 100 else 0.02
    pressure = data.normal_force.values / width / PRESSURE
    for step in range(4):  # pressure and friction do not disturb each other
        np.testing.assert_allclose(pressure[step], dome(x, A), atol=close)
    traction = data.friction_force.values[..., 0] / width / (MU * PRESSURE)
    np.testing.assert_allclose(traction[0], 0.0, atol=1e-9)
    for found, expected in (
        (traction[1], mindlin(x, Q)),
        (traction[2], mindlin(x, Q) - 2.0 * mindlin(x, 0.5 * (Q - back))),
    ):
        wrong = np.sort(np.abs(found - expected))
        assert wrong[-5] < close  # but for the strips about both tips of the traction
        assert wrong[-1] < 2.0 * close
    np.testing.assert_allclose(traction[3], traction[1], atol=2e-4)
    stick = np.abs(x[data.state.values[1] == "stick"])
    assert stick.max() == pytest.approx(A * np.sqrt(1.0 - Q / (MU * P)), abs=2.0 * width)
    s = data.displacement.sel(dof="s").values
    if n < 100:
        assert s[3] == pytest.approx(s[1], rel=1e-5)
    # one step, or parts of it: the same end on the same path
    np.testing.assert_allclose(parts.dataset.friction_force.values[-1], data.friction_force.values[1], atol=1e-4 * P)


def ring(inner, outer, thickness, around, across):
    """A whole ring of 20-node bricks with the surfaces "inner" and "outer"."""
    flat = box((1.0, 1.0, 1.0), (across, around, 1), "hex20")
    radius, angle = inner + (outer - inner) * flat.nodes[:, 0], 2.0 * np.pi * flat.nodes[:, 1]
    nodes = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), thickness * flat.nodes[:, 2]])
    _, first, number = np.unique(nodes.round(12), axis=0, return_index=True, return_inverse=True)
    number = number.ravel()
    surfaces = {
        name: Surface(faces={kind: number[faces] for kind, faces in flat.surface(side).faces.items()})
        for name, side in (("inner", "x0"), ("outer", "x1"))
    }
    return Mesh(nodes=nodes[first], blocks={"hex20": number[flat.blocks["hex20"]]}, surfaces=surfaces)


@pytest.mark.verify
def test_a_press_fit_has_the_pressure_of_lame():
    young, nu, (r0, r, r1), overlap = 2e11, 0.3, (0.04, 0.06, 0.09), 5e-5
    kn = 2e15
    beside = box((0.01, 0.01, 0.01), (1, 1, 1), at=(1.0, 0.0, 0.0))  # models hold some node
    mesh = together({"hub": ring(r0, r, 0.005, 32, 3), "rim": ring(r, r1, 0.005, 40, 4), "beside": beside})
    steel = ss.Material(young=young, poisson=nu, density=7800.0)
    free = elastic_model(mesh, steel, "beside.x0")
    model = replace(free, K=(free.K + 1e3 * free.M).tocsr())  # held by springs that are soft
    law = ss.FrictionContact(kn=kn, gap=-overlap)
    joint = ss.surface_pair(model, "hub.outer", "rim.inner", contact=law, points=200, gap="touching")
    body = ss.reduced_body(model, pairs=joint, modes=20)
    state = ss.preload(ss.Problem(body.structure, contacts=joint), pairs=joint)
    give = r / young * ((r1**2 + r**2) / (r1**2 - r**2) + nu + (r**2 + r0**2) / (r**2 - r0**2) - nu) + 1.0 / kn
    area = 2.0 * np.pi * r * 0.005
    mean = state.dataset.normal_force.values[-1].sum() / area
    assert mean == pytest.approx(overlap / give, rel=5e-3)
