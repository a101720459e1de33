"""Seconds and work of response curves after warm-up: oscillator (150 points) and reduced blade (200 points)."""

import time
from pathlib import Path

import numpy as np

import slipstick as ss
from slipstick.verify.cases import oscillator

BLADE = Path(__file__).parents[1] / "examples" / "blade_reduced" / "blade_reduced.npz"
STIFFNESS, LOAD = 27450.33, 3.96918


def blade(*, level=1.0, velocity=0.0, harmonics=range(6), mu=0.3, viscous=False):
    """The reduced blade with 8 rubbing contacts on its shroud; ``level`` is the normal load over its reference."""
    damping = {"damping_ratio": 0.0005} if viscous else {"loss_factor": 0.001}
    structure = ss.ModalStructure.load(BLADE, **damping)
    contact = ss.FrictionContact(kt=STIFFNESS, mu=mu, kn=STIFFNESS, gap=-level * LOAD / STIFFNESS)
    rubbing = ss.RubbingMotion(velocity=velocity)
    pairs = [
        ss.ContactPair(name=f"c{k}", contact=contact, tangential=f"n{k}y", normal=f"n{k}z", rubbing=rubbing)
        for k in range(1, 9)
    ]
    load = ss.Load(shape=structure.load_shapes[0], sin=2.0)
    return ss.Problem(structure, contacts=pairs, loads=[load], harmonics=harmonics, outputs=["n1y"])


CURVES = {
    "oscillator, v = 0": (lambda: oscillator(velocity=0.0), (2.0, 15.0)),
    "oscillator, v = 10": (lambda: oscillator(velocity=10.0), (2.0, 15.0)),
    "oscillator, v = 100": (lambda: oscillator(velocity=100.0), (2.0, 15.0)),
    "blade 100 %, v = 0": (lambda: blade(), (2 * np.pi * 295, 2 * np.pi * 320)),
    "blade 100 %, v = 1": (lambda: blade(velocity=1.0), (2 * np.pi * 195, 2 * np.pi * 230)),
    "blade 100 %, v = 5": (lambda: blade(velocity=5.0), (2 * np.pi * 195, 2 * np.pi * 230)),
    "blade 400 %, v = 0": (lambda: blade(level=4.0), (2 * np.pi * 295, 2 * np.pi * 320)),
}


def measure(repeats=3):
    """Name, best seconds, milliseconds a point, points, evaluations, peak, outcome of each curve."""
    for name, (build, span) in CURVES.items():
        seconds, branch = [], None
        for _ in range(repeats):
            problem = build()
            start = time.perf_counter()
            branch = ss.forced_response(problem, omega=span)
            seconds.append(time.perf_counter() - start)
        attributes = branch.dataset.attrs
        peak = max(branch.peaks(), key=lambda p: p[1], default=(float("nan"), float("nan")))
        yield {
            "curve": name,
            "seconds": min(seconds),
            "ms_a_point": 1e3 * min(seconds) / len(branch),
            "points": len(branch),
            "evaluations": attributes.get("evaluations", ""),
            "peak": f"{peak[1]:.4g} at {peak[0]:.4g}",
            "outcome": branch.outcome.name,
        }


if __name__ == "__main__":
    for row in measure():
        print(
            "  ".join(
                f"{key} {value:.4g}" if isinstance(value, float) else f"{key} {value}" for key, value in row.items()
            )
        )
