"""Points whose stability is looked at, by the names of their systems."""

import warnings

import numpy as np

import slipstick as ss
from slipstick.analysis.curve.response import follow
from slipstick.analysis.self_excited.limit_cycles import at_rest, cycles_request
from slipstick.analysis.self_excited.steady_sliding import SteadySliding
from slipstick.analysis.self_excited.system import CycleStart


def two_dofs(rubbing, *, gap=0.1, harmonics=11, **options):
    """A contact that opens and closes, with friction."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=[[60.0, -15.0], [-15.0, 45.0]], dofs=["x", "y"])
    contact = ss.FrictionContact(kt=120.0, mu=0.4, kn=60.0, gap=gap)
    pair = ss.ContactPair(name="c", tangential="x", normal="y", contact=contact, rubbing=rubbing)
    loads = [ss.Load(dof="x", sin=40.0), ss.Load(dof="y", cos=25.0)]
    return ss.Problem(structure, contacts=[pair], loads=loads, harmonics=range(harmonics), **options)


def chain(modes, *, gap, velocity, harmonics=11):
    """A chain of 16 dofs known by some modes and the static compliance of the others."""
    n = 16
    K = 400.0 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    squared, shapes = np.linalg.eigh(K)
    structure = ss.ModalStructure(
        omega=np.sqrt(squared[:modes]), mode_shapes=shapes[:, :modes], static_compliance=np.linalg.inv(K),
        dofs=[f"q{i}" for i in range(n)], damping_ratio=0.03,
    )  # fmt: skip
    contact = ss.FrictionContact(kt=60.0, mu=0.4, kn=40.0, gap=gap)
    pair = ss.ContactPair(
        name="c", tangential="q9", normal="q4", contact=contact, rubbing=ss.RubbingMotion(velocity=velocity)
    )
    return ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="q2", sin=12.0)], harmonics=range(harmonics))


def point_at(problem, omega, **options):
    """The point of a short curve round a frequency."""
    return next(p for p in follow(problem, omega=(omega, omega + 0.02), **options))


def contact_motion(problem, point):
    """Tangential and normal motion (n, L) of friction contacts at a point."""
    (batch,) = problem.batches
    X = point.x.reshape(-1, problem.harmonics.size)
    out = np.zeros((2, batch.count, problem.harmonics.size))
    for own, port in zip(out, batch.ports, strict=True):
        own[port.members] = X[port.rows]
    return out


def flutter(*, mu=0.56, force=10.0, harmonics=11, velocity=1.0):
    """Mode coupling under a pad pressed on by 50, shaken along its normal."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.5 * np.eye(2), K=[[100.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"])
    contact = ss.FrictionContact(kt=200.0, mu=mu, kn=40.0, gap=0.0)
    rubbing = ss.RubbingMotion(velocity=velocity)
    pair = ss.ContactPair(name="pad", tangential="x", normal="y", contact=contact, rubbing=rubbing)
    loads = [ss.Load(dof="y", harmonic=0, cos=50.0), ss.Load(dof="y", sin=force)]
    return ss.Problem(structure, contacts=[pair], loads=loads, harmonics=range(harmonics))


def stops(*, kn=10.0, gap=1.0, force=1.0, both=False, harmonics=13):
    """An oscillator between elastic stops without friction."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.1 * np.eye(2), K=np.eye(2), dofs=["t", "y"])
    contact = ss.FrictionContact(kt=1.0, mu=0.0, kn=kn, gap=gap)
    sides = {"up": 1.0, "down": -1.0} if both else {"up": 1.0}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # there is no friction
        pairs = [
            ss.ContactPair(name=name, tangential="t", normal={"y": cosine}, contact=contact)
            for name, cosine in sides.items()
        ]
        return ss.Problem(
            structure, contacts=pairs, loads=[ss.Load(dof="y", sin=force)], harmonics=range(harmonics), outputs=["y"]
        )


def brake(*, mu=0.4, damping=0.5, harmonics=11, pads=1, velocity=1.0, structure=None, load=50.0, scale=1.0, **rubbing):
    """Mode coupling under pads that are pressed on together."""
    K = [[100.0, -20.0], [-20.0, 60.0]]
    plain = ss.MatrixStructure(M=np.eye(2), C=damping * np.eye(2), K=K, dofs=["x", "y"])
    contact = ss.FrictionContact(kt=200.0 / pads, mu=mu, kn=40.0 / pads, gap=0.0)
    surface = ss.RubbingMotion(velocity=scale * velocity, **rubbing)
    names = ["pad"] if pads == 1 else [f"pad{i}" for i in range(pads)]
    pairs = [ss.ContactPair(name=n, tangential="x", normal="y", contact=contact, rubbing=surface) for n in names]
    loads = [ss.Load(dof="y", harmonic=0, cos=scale * load)]
    return ss.Problem(structure or plain, contacts=pairs, loads=loads, harmonics=range(harmonics))


def at_the_hopf_point(problem):
    """What is asked for, steady sliding there, its unknowns and the start of the limit cycles."""
    request = cycles_request(problem, "pad.mu", (0.4, 0.8), (), None)
    sliding = SteadySliding(request.balance, "pad.mu")
    (hopf,) = sliding.hopf_points([sliding.at(0.5), sliding.at(0.6)])
    rest = at_rest(request.balance, hopf)
    return request, hopf, rest, CycleStart(request.space, hopf, rest, request.span)
