"""The effect of the harmonics kept, at rubbing velocity 10 (Petrov 2012, Fig. 8): even ones are needed."""

import warnings

import oscillator
from oscillator import oscillator as problem

import slipstick as ss

SETS = {"0..3": range(4), "0..7": range(8), "0..10": range(11), "0 and odd": [0, 1, 3, 5, 7, 9]}


def compute(at=()):
    """One branch for each set of harmonics, with points at exactly these frequencies."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)  # of the missing even ones: that is the point here
        return {
            name: ss.forced_response(problem(velocity=10.0, harmonics=kept), omega=(2.0, 15.0), at=at)
            for name, kept in SETS.items()
        }


def draw(branches, folder):
    """The figure of this example."""
    curves = branches
    oscillator.draw(curves, "harmonics_kept", "harmonics kept", folder)


if __name__ == "__main__":
    oscillator.main(compute, draw, "harmonics")
