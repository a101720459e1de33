"""A mass on a belt whose friction falls with the velocity: where it slides, squeals, or can do either."""

import numpy as np

import slipstick as ss

VELOCITIES = (2.0, 1.8, 1.6, 1.4, 1.2, 1.0)
LOADS = (1.0, 1.5)
SLIDES, EITHER, SQUEALS = ".", "o", "#"


def problem(load):
    """x'' + 0.1 x' + x + f = 0 on a belt, mu = 0.5 + 0.5 exp(-v / 0.5)."""
    belt = ss.models.StribeckContact(kt=30.0, mu_s=1.0, mu_d=0.5, v_s=0.5, normal_load=load)
    rubbing = ss.RubbingMotion(velocity=-VELOCITIES[0])
    return ss.Problem(
        ss.MatrixStructure(M=[[1.0]], C=[[0.1]], K=[[1.0]], dofs=["x"]),
        contacts=ss.ContactPair(name="belt", contact=belt, tangential="x", rubbing=rubbing),
        harmonics=range(22),
        title="Friction that falls with the velocity",
    )


def row(load):
    """What the mass does at each velocity: from the cycles that begin at the Hopf point of one load."""
    velocities = [-v for v in VELOCITIES]
    branch = ss.limit_cycles(problem(load), "belt.velocity", (-4.0, -0.9), at=velocities)
    data, marks = branch.dataset, ""
    for velocity in velocities:
        at = np.isclose(data.parameter, velocity, atol=1e-9)
        sliding = at & (data.branch_part == 2)
        cycle = at & (data.branch_part == 1) & (data.stick_fraction[:, 0] > 0)
        slides = bool((data.unstable_multipliers[sliding] == 0).all())
        marks += f"{(EITHER if cycle.any() else SLIDES) if slides else SQUEALS:>5}"
    return marks


def compute():
    """The map, line by line."""
    lines = [f"{'load':>5} |" + "".join(f"{v:5.1f}" for v in VELOCITIES) + "  belt velocity"]
    return lines + [f"{load:5.1f} |{row(load)}" for load in LOADS]


if __name__ == "__main__":
    print("\n".join(compute()))
