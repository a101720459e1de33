"""Constant rubbing velocity from 0 to 250: amplitude and mean position (Petrov 2012, Figs. 6 and 7)."""

import oscillator
from oscillator import oscillator as problem

import slipstick as ss

VELOCITIES = (0.0, 1.0, 10.0, 20.0, 50.0, 100.0, 250.0)


def compute():
    """One branch for each velocity, from omega = 2 to 15 rad/s."""
    return {v: ss.forced_response(problem(velocity=v), omega=(2.0, 15.0)) for v in VELOCITIES}


def draw(branches, folder):
    """The figure of this example."""
    curves = {f"v = {key:g}": branch for key, branch in branches.items()}
    oscillator.draw(curves, "constant_velocity", "rubbing velocity", folder, mean=True, log=True)


if __name__ == "__main__":
    oscillator.main(compute, draw, "rubbing velocity")
