"""A block of finite elements that rubs, small enough to be solved whole."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

import slipstick as ss
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.model import elastic_model
from slipstick.fem.retained import Retained, retain, strain_rows
from slipstick.structure.reduction.reduce import reduce_model

LOSS = 0.02
METAL = Material(young=100.0, poisson=0.3, density=1.0)


@cache
def block() -> Retained:
    """Held at one end, with two contacts on its top and a pressure on a side."""
    mesh = box((1.0, 0.2, 0.2), (5, 1, 1), "hex20")
    return retain(elastic_model(mesh, METAL, "x0"), surface="z1", contacts=2, pressure={"push": "y0"})


@cache
def branch(parameter: bool = False) -> ss.Branch:
    """Of the reduced block, with a pressure and a force; or along the friction coefficient."""
    body = block()
    structure = reduce_model(body.model.K, body.model.M, modes=60, loss_factor=LOSS, **body.request).structure
    pairs = [
        ss.ContactPair(
            name=f"c{i}", contact=ss.FrictionContact(kt=2.0, mu=0.3, kn=1.0, gap=-0.02), tangential=f"c{i}y",
            normal=f"c{i}z", rubbing=ss.RubbingMotion(velocity=0.01),
        )
        for i in (1, 2)
    ]  # fmt: skip
    loads = [
        ss.Load(shape="push", cos=0.02),
        ss.Load(dof="c1z", harmonic=2, sin=0.003),
        ss.Load(dof="c2z", harmonic=0, cos=-0.004),
    ]
    first = float(structure.natural_frequencies[0])
    problem = ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(5), title="block")
    options = {"max_step": 0.2}
    if parameter:
        return ss.parameter_response(problem, "c1.mu", (0.1, 0.4), omega=0.9 * first, options=options)
    return ss.forced_response(problem, omega=(0.8 * first, 1.1 * first), options=options)


def solved_whole(made: ss.Branch, point: int) -> np.ndarray:
    """Coefficients (n_dofs, L) of the motion of the whole model at a point, by direct solutions."""
    body, d, problem = block(), made.dataset.isel(point=point), made.problem
    assert problem is not None
    L, names = d.sizes["coefficient"], list(problem.structure.dofs)
    force, B = np.zeros((body.model.K.shape[0], L)), body.directions.toarray()
    for c in (0, 1):
        force -= np.outer(B[:, names.index(f"c{c + 1}y")], d["friction_force"].values[c])
        force -= np.outer(B[:, names.index(f"c{c + 1}z")], d["normal_force"].values[c])
    force[:, 1] += 0.02 * body.loads["push"]
    force[:, 4] += 0.003 * B[:, names.index("c1z")]
    force[:, 0] += -0.004 * B[:, names.index("c2z")]
    K, M, omega = body.model.K.toarray(), body.model.M.toarray(), float(d["omega"])
    out = np.zeros_like(force)
    out[:, 0] = np.linalg.solve(K, force[:, 0])
    for j, m in enumerate(made.harmonics.orders[1:]):
        one = force[:, 2 * j + 1] - 1j * force[:, 2 * j + 2]
        hat = np.linalg.solve(K * (1 + 1j * LOSS) - (m * omega) ** 2 * M, one)
        out[:, 2 * j + 1], out[:, 2 * j + 2] = hat.real, -hat.imag
    full = np.zeros((3 * body.model.mesh.n_nodes, L))
    full[body.model.free] = out
    return full.reshape(-1, 3, L)


@cache
def stressed(modes: int, parameter: bool = False, at: str = "elements") -> ss.Branch:
    """The branch with a structure that knows its strains; its points are those of 60 modes."""
    body = block()
    strains = strain_rows(body.model, "all", at)
    structure = reduce_model(
        body.model.K, body.model.M, modes=modes, loss_factor=LOSS, strains=strains, **body.request
    ).structure
    return with_structure(branch(parameter), structure)


@cache
def pressed(residuals: str) -> ss.Branch:
    """A plate on 100 contacts that slip and lift off, at three frequencies; its residuals written out, or solved for.

    Points are those of the written kind.
    """
    model, contacts = pressed_plate(), [f"k{i}" for i in range(1, 101)]
    strains = strain_rows(model.model, [3, 7, 40], "elements")
    structure = reduce_model(
        model.model.K, model.model.M, modes=30, loss_factor=LOSS, strains=strains, residuals=residuals, **model.request
    ).structure
    if residuals == "solved":
        return with_structure(pressed("written"), structure)
    law = ss.FrictionContact(kt=0.02, mu=0.3, kn=0.001, normal_load=0.0004)
    pairs = [
        ss.ContactPair(name=name, contact=law, tangential=f"c{i}x", normal=f"c{i}z")
        for i, name in enumerate(contacts, start=1)
    ]
    loads = [ss.Load(shape="push", cos=0.003), ss.Load(dof="c5z", harmonic=2, sin=0.001)]
    first = float(structure.natural_frequencies[0])
    problem = ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(4), title="plate", outputs=["c1z"])
    return ss.steady_response(problem, omega=first * np.array([0.8, 0.95, 1.1]), options={"jacobian": "iterative"})


@cache
def pressed_plate() -> Retained:
    """Held at one end, with 100 contacts below and a pressure from above."""
    mesh = box((2.0, 1.2, 0.1), (16, 10, 1), "hex20")
    return retain(elastic_model(mesh, METAL, "x0"), surface="z0", contacts=100, pressure={"push": "z1"})


def with_structure(made: ss.Branch, structure: ss.ModalStructure) -> ss.Branch:
    """A branch as it is, of another structure."""
    assert made.problem is not None
    return ss.Branch(made.dataset, made.outcome, replace(made.problem, structure=structure, told=None))


@cache
def worn() -> ss.Branch:
    """The block over 20 cycles in which both contacts wear, unlike each other."""
    made = branch()
    assert made.problem is not None
    omega = float(made.dataset.omega[3])
    return ss.wear(made.problem, {"c1": 1e-3, "c2": 2e-3}, cycles=(0, 20), omega=omega, at=[5.0, 12.0])
