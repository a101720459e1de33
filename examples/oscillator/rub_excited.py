"""Vibration excited by the rub alone: no load, u = a cos(omega t), a = 1 .. 50 (Petrov 2012, Fig. 11)."""

import oscillator
from oscillator import oscillator as problem

import slipstick as ss

AMPLITUDES = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0)


def compute():
    """One branch for each amplitude of the rubbing motion."""
    return {a: ss.forced_response(problem(cos={1: a}, force=0.0), omega=(2.0, 15.0)) for a in AMPLITUDES}


def draw(branches, folder):
    """The figure of this example."""
    curves = {f"a = {key:g}": branch for key, branch in branches.items()}
    oscillator.draw(curves, "rub_excited", "u = a cos(omega t)", folder)


if __name__ == "__main__":
    oscillator.main(compute, draw, "rubbing amplitude")
