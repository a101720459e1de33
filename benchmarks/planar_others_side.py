"""pyHarm's and tmdsimpy's side of friction in two directions, run by the Python they are installed in.

``planar_against_others.py`` sends tasks. All of their elements take coefficients by harmonic, then by dof.
"""

import logging
import os
import time

os.environ.update(XLA_FLAGS="--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1", OMP_NUM_THREADS="1")

import numpy as np
from pyharm_side import answer, made, swept

CHUNK = 10  # states that jax.vmap takes together: the columns of all at all samples have to fit in the caches


def connected(case, kind):
    """pyHarm's element between a mass with dofs of ``case`` and the ground."""
    jenkins = {"type": "Jenkins", "dirs": [0, 1], "mu": case["mu"], "N0": case["load"], "k": case["kt"]}
    penalty = {
        "type": "Penalty3D", "dirs": [2, 0, 1], "mu": case["mu"], "N0": case["load"], "k_t": case["kt"],
        "k_n": case["kn"], "g": 0.0,
    }  # fmt: skip
    element = {"connect": {"body": [0], "GROUND": [0]}, **(jenkins if kind == "Jenkins" else penalty)}
    n = 2 if kind == "Jenkins" else 3
    eye = np.eye(n)
    return made(case, {"M": eye, "C": eye, "K": eye, "G": 0.0 * eye}, {"foot": element})


def jenkins(case, X):
    """Two directions under a constant load, one circle; derivatives carried along, compiled by numba."""
    foot = next(e for e in connected(case, "Jenkins").system.LE if type(e).__name__ == "Jenkins")
    return lambda: [(foot.evalResidual(x, 1.0), foot.evalJacobian(x, 1.0)[0]) for x in X[:, :, :2].reshape(len(X), -1)]


def penalty(case, X):
    """A circle and a unilateral spring, derivatives by JAX. Its normal motion points away from the contact."""
    foot = next(e for e in connected(case, "Penalty3D").system.LE if type(e).__name__ == "Penalty3D")
    x = (X * [1.0, 1.0, -1.0]).reshape(len(X), -1)
    return lambda: [(np.asarray(foot.evalResidual(q, 1.0)), np.asarray(foot.evalJacobian(q, 1.0)[0])) for q in x]


def penalty_together(case, X):
    """The same function, force and derivatives in one pass, for many states by ``jax.vmap``."""
    import jax
    from pyHarm.Elements.NodeToNodeElements.Penalty3D import evalResidual_jax

    foot = next(e for e in connected(case, "Penalty3D").system.LE if type(e).__name__ == "Penalty3D")

    def twice(x):
        R = evalResidual_jax(
            x, 1.0, foot.Pdir, foot.Pslave, foot.Pmaster, foot.mu, foot.N0, foot.g, foot.k_n, foot.k_t,
            foot.D["ft"], foot.D["tf"],
        )  # fmt: skip
        return R, R

    return together(jax.jit(jax.vmap(jax.jacfwd(twice, has_aux=True))), (X * [1.0, 1.0, -1.0]).reshape(len(X), -1))


def dry(case):
    """tmdsimpy's ElasticDryFriction3D: a limit for each direction alone, a unilateral spring."""
    from tmdsimpy.jax.nlforces import ElasticDryFriction3D

    gap = -case["load"] / case["kn"]
    return ElasticDryFriction3D(np.eye(3), np.eye(3), case["kt"], case["kn"], case["mu"], u0=0.0, meso_gap=gap)


def dry_friction(case, X):
    """tmdsimpy's own call."""
    foot, h = dry(case), np.arange(case["harmonics"] + 1)
    x = X.reshape(len(X), -1)
    return lambda: [tuple(np.asarray(a) for a in foot.aft(q, 1.0, h, Nt=case["samples"])[:2]) for q in x]


def dry_friction_together(case, X):
    """The same function for many states by ``jax.vmap``."""
    import jax
    from tmdsimpy.jax.nlforces.elastic_dry_fric_3d import _local_aft_eldry_grad

    foot, h = dry(case), tuple(range(case["harmonics"] + 1))
    numbers = np.array([foot.kt, foot.kn, foot.mu])

    def one(x):
        return _local_aft_eldry_grad(x, numbers, np.zeros(3), h, case["samples"], False, foot.meso_gap)

    x = np.hstack([X.reshape(len(X), -1), np.ones((len(X), 1))])
    return together(jax.jit(jax.vmap(one)), x)


def together(compiled, x):
    """Force and Jacobian of all states, some at a time."""

    def call():
        out = []
        for first in range(0, len(x), CHUNK):
            J, F = (np.asarray(a) for a in compiled(x[first : first + CHUNK]))
            out += zip(F, J[:, :, : F.shape[1]], strict=True)
        return out

    return call


ELEMENTS = {
    "pyHarm Jenkins": jenkins,
    "pyHarm Penalty3D": penalty,
    "pyHarm Penalty3D, vmap": penalty_together,
    "tmdsimpy ElasticDryFriction3D": dry_friction,
    "tmdsimpy ElasticDryFriction3D, vmap": dry_friction_together,
}


def element(case):
    """Seconds of force and Jacobian of one element, and both in the order (direction, coefficient) for motions ``X``
    (n, 3, L): two directions and the approach."""
    X = np.moveaxis(np.array(case["X"]), 1, 2)
    call = ELEMENTS[case["element"]](case, X)
    out = call()
    seconds = []
    for _ in range(case["repeats"]):
        start = time.process_time()
        call()
        seconds.append((time.process_time() - start) / len(X))
    L = X.shape[1]
    F = np.array([f for f, _ in out]).reshape(len(X), L, -1)
    J = np.array([j for _, j in out]).reshape(len(X), L, F.shape[2], L, F.shape[2])
    F, J = np.moveaxis(F, 1, 2)[:, :2], np.transpose(J, (0, 2, 4, 1, 3))[:, :2]
    if "Penalty3D" in case["element"]:
        J[:, :, 2] *= -1.0
    return {"seconds": seconds, "F": F.tolist(), "J": J.tolist()}


def sweep(case):
    """A curve of pyHarm of a mass on springs along x and y with a Jenkins element in both."""
    eye = np.eye(2)
    matrices = {"M": case["m"] * eye, "C": case["c"] * eye, "K": case["k"] * eye, "G": 0.0 * eye}
    ground = {"connect": {"body": [0], "GROUND": [0]}}
    foot = {"type": "Jenkins", "dirs": [0, 1], "mu": case["mu"], "N0": case["load"], "k": case["kt"], **ground}
    connectors = {
        "along": {"type": "SinusForcing", "connect": {"body": [0]}, "dirs": [0], "amp": case["p"]},
        "across": {"type": "CosinusForcing", "connect": {"body": [0]}, "dirs": [1], "amp": case["q"]},
        "foot": foot,
    }
    return swept(made(case, matrices, connectors), case, 2)


def versions():
    """Of what is installed here."""
    import pyHarm

    found = {"pyHarm": getattr(pyHarm, "__version__", "unknown")}
    try:
        import tmdsimpy.jax.nlforces  # noqa: F401 (64 bits for JAX are turned on here too)

        found["tmdsimpy"] = "present"
    except ImportError:
        pass
    return found


if __name__ == "__main__":
    import jax

    jax.config.update("jax_enable_x64", True)
    logging.disable(logging.CRITICAL)
    answer(versions, element, sweep)
