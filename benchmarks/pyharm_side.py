"""pyHarm's side of the comparison, run by the Python it is installed in; ``against_pyharm.py`` sends it tasks.

pyHarm's friction element with a constant normal load (Jenkins) and its analytic Jacobian, compiled by its own numba.
"""

import json
import logging
import sys
import time

import numpy as np


def made(case, matrices, connectors):
    """One body of these matrices and what acts on it: ``case`` has harmonics, samples, and the range of a curve."""
    from pyHarm.Maestro import Maestro

    n = len(matrices["M"])
    given = {
        "system": {"type": "Base", "nh": case["harmonics"], "nti": case["samples"]},
        "substructures": {
            "body": {
                "matrix": {key: np.array(value) for key, value in matrices.items()},
                "nnodes": 1, "ndofs": n, "nmodes": 0, "matching": list(range(n)),
            }
        },
        "connectors": connectors,
        "analysis": {} if "from" not in case else {
            "curve": {
                "study": "frf", "solver": case["solver"], "predictor": "tangent", "corrector": case["corrector"],
                "stepsizer": "acceptance", "puls_inf": case["from"], "puls_sup": case["to"],
                "ds_max": case["step"], "ds_min": 1e-8, "ds0": min(case["step"], 0.1), "sign_ds": 1, "verbose": False,
            }
        },
    }  # fmt: skip
    out = Maestro(given)
    logging.disable(logging.CRITICAL)
    return out


def system(case):
    """One mass on a spring, rubbing on a wall: ``case`` has m, c, k, p, kt, mu, load besides."""
    matrices = {"M": [[case["m"]]], "C": [[case["c"]]], "K": [[case["k"]]], "G": [[0.0]]}
    connectors = {
        "load": {"type": "SinusForcing", "connect": {"body": [0]}, "dirs": [0], "amp": case["p"]},
        "damper": {
            "type": "Jenkins", "connect": {"body": [0], "GROUND": [0]}, "dirs": [0],
            "mu": case["mu"], "N0": case["load"], "k": case["kt"],
        },
    }  # fmt: skip
    return made(case, matrices, connectors)


def element(case):
    """Seconds of residual and Jacobian of one element by motion, and both, for coefficients ``X`` (n, L)."""
    damper = next(e for e in system(case).system.LE if type(e).__name__ == "Jenkins")
    motions = [np.array(x) for x in case["X"]]
    out = [(damper.evalResidual(x, 1.0), damper.evalJacobian(x, 1.0)[0]) for x in motions]
    seconds = []
    for _ in range(case["repeats"]):
        start = time.process_time()
        for x in motions:
            damper.evalResidual(x, 1.0)
            damper.evalJacobian(x, 1.0)
        seconds.append((time.process_time() - start) / len(motions))
    return {"seconds": seconds, "F": [f.tolist() for f, _ in out], "J": [J.tolist() for _, J in out]}


def sweep(case):
    """The oscillator's curve."""
    return swept(system(case), case)


def swept(made, case, dofs=1):
    """Seconds of a whole curve, its points, iterations, and largest amplitude of the first of ``dofs``."""
    start = time.process_time()
    made.operate()
    seconds = time.process_time() - start
    found = [s for s in made.nls["curve"].SolList if s.flag_accepted]
    tau = 2 * np.pi * np.arange(4096) / 4096
    orders = np.arange(1, case["harmonics"] + 1)
    H = np.vstack([np.cos(orders[:, None] * tau), np.sin(orders[:, None] * tau)])
    first = [s.x[:-1:dofs] for s in found]  # the mean, then cosine and sine by harmonic
    amplitudes = [np.abs(np.concatenate([x[1::2], x[2::2]]) @ H).max() for x in first]
    at = int(np.argmax(amplitudes))
    return {
        "seconds": seconds,
        "points": len(found),
        "refused": len(made.nls["curve"].SolList) - len(found),
        "reached": float(max(s.x[-1] for s in found)),
        "peak": float(amplitudes[at]),
        "omega": float(found[at].x[-1]),
    }


def answer(version, element, sweep):
    """Tasks from standard input, answers to standard output."""
    answers, sys.stdout = sys.stdout, sys.stderr  # pyHarm prints
    print(json.dumps({"version": version()}), file=answers, flush=True)
    for line in sys.stdin:
        task = json.loads(line)
        done = element(task) if task["what"] == "element" else sweep(task)
        print(json.dumps(done), file=answers, flush=True)


def version():
    import pyHarm

    return getattr(pyHarm, "__version__", "unknown")


if __name__ == "__main__":
    answer(version, element, sweep)
