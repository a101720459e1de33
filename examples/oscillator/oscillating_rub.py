"""Rubbing motion u = v t + 2 cos(omega t) for several v (Petrov 2012, Figs. 9 and 10)."""

import oscillator
from oscillator import oscillator as problem

import slipstick as ss

VELOCITIES = (0.0, 1.0, 10.0, 20.0, 50.0, 100.0)


def compute():
    """One branch for each velocity."""
    return {v: ss.forced_response(problem(velocity=v, cos={1: 2.0}), omega=(2.0, 15.0)) for v in VELOCITIES}


def draw(branches, folder):
    """The figure of this example."""
    curves = {f"v = {key:g}": branch for key, branch in branches.items()}
    oscillator.draw(curves, "oscillating_rub", "u = v t + 2 cos(omega t)", folder, mean=True)


if __name__ == "__main__":
    oscillator.main(compute, draw, "rubbing velocity")
