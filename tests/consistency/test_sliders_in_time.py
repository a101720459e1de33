"""Iwan's joint in time and its multipliers: as the friction contacts side by side that it is."""

import numpy as np
import pytest

import slipstick as ss

COUNT = 3


def iwan(n=1, **changed):
    values = {"kt": 1.0, "limit": 1.2, "chi": -0.3, "beta": 0.3} | changed
    return ss.models.IwanContact(**{k: np.full(n, v) if n > 1 else v for k, v in values.items()}, sliders=COUNT)


def sliders(law):
    """The same as contacts of their own."""
    k, limits = law.slider_parameters({name: np.atleast_1d(value) for name, value in law.values.items()})
    return [ss.FrictionContact(kt=a, mu=1.0, normal_load=b) for a, b in zip(k[0], limits[0], strict=True)]


def problem(joints, velocity=0.1, beside=True, **options):
    """Two masses; a joint between them on a surface that slides, and a friction contact on the second mass."""
    rubbing = ss.RubbingMotion(velocity=velocity, cos={1: 0.2})
    pairs = [
        ss.ContactPair(name=f"joint {k}", contact=joint, tangential={"a": 1.0, "b": -1.0}, rubbing=rubbing)
        for k, joint in enumerate(joints)
    ]
    if beside:
        damper = ss.FrictionContact(kt=0.8, mu=0.5, kn=1.0, gap=-0.6)
        pairs.insert(1, ss.ContactPair(name="damper", contact=damper, tangential="b", normal="a"))
    return ss.Problem(
        ss.MatrixStructure(M=np.diag([1.0, 0.7]), C=0.05 * np.eye(2), K=[[1.5, -0.5], [-0.5, 1.0]], dofs=["a", "b"]),
        contacts=pairs, loads=[ss.Load(dof="a", sin=0.9), ss.Load(dof="b", cos=0.3)],
        harmonics=options.pop("harmonics", range(12)), **options,
    )  # fmt: skip


def multipliers(branch):
    found = branch.dataset["multiplier"].values[0] @ [1.0, 1.0j]
    found = found[np.isfinite(found)]
    return np.sort_complex(found[np.abs(found) > 1e-9])  # contacts that forget have others at zero


@pytest.mark.parametrize(
    ("velocity", "beside"),
    [
        (0.1, True),
        *(pytest.param(*case, marks=pytest.mark.verify) for case in ((0.0, True), (0.0, False), (0.1, False))),
    ],
)
def test_it_is_its_sliders(velocity, beside):
    law = iwan()
    h = range(6)
    one, many = (problem(joints, velocity, beside, harmonics=h) for joints in ([law], sliders(law)))
    a, b = (ss.forced_response(p, omega=(1.1, 1.102), stability=True) for p in (one, many))
    np.testing.assert_allclose(a.dataset["displacement"][0], b.dataset["displacement"][0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(multipliers(a), multipliers(b), rtol=0, atol=1e-7)
    assert a.dataset["stability_method"][0] == b.dataset["stability_method"][0]
    in_time, apart = (ss.transient(p, 1.1) for p in (one, many))
    np.testing.assert_allclose(in_time.coefficients, apart.coefficients, rtol=0, atol=1e-9)
    joint = [k for k, name in enumerate(apart.contacts) if name.startswith("joint")]
    np.testing.assert_allclose(
        in_time.friction_coefficients[0], apart.friction_coefficients[joint].sum(axis=0), atol=1e-9
    )
    assert in_time.power[0] == pytest.approx(apart.power[joint].sum(), rel=1e-9)
    assert np.isnan(in_time.fractions[0]).all()
    assert np.isnan(in_time.normal_coefficients[0]).all()
    assert {change.contact for change in in_time.changes} <= {"damper"}


def test_a_point_is_checked_in_time():
    branch = ss.forced_response(problem([iwan()], harmonics=range(20)), omega=(1.1, 1.102))
    check = branch.check_in_time(0)
    assert check.converged
    assert check.relative_difference < 2e-4


def test_behind_a_static_residual():
    """One mode and the residual of the other: sliders that share a port answer at once."""
    K = np.array([[2.0, -0.8], [-0.8, 1.5]])
    squared, shapes = np.linalg.eigh(K)
    structure = ss.ModalStructure(
        omega=np.sqrt(squared[:1]), mode_shapes=shapes[:, :1], static_compliance=np.linalg.inv(K), dofs=["a", "b"],
        damping_ratio=0.03,
    )  # fmt: skip
    branch = ss.forced_response(
        ss.Problem(
            structure, contacts=ss.ContactPair(name="joint", contact=iwan(), tangential="b"),
            loads=[ss.Load(dof="a", sin=0.8)], harmonics=range(16), told=None,
        ), omega=(1.1, 1.102), stability=True,
    )  # fmt: skip
    assert branch.dataset["unstable_multipliers"][0] == 0
    check = branch.check_in_time(0)
    assert check.converged
    assert check.relative_difference < 1e-3


def test_of_several_elements():
    """Three joints of one pair, of which two stand on the same mass."""
    law = iwan(3)
    pair = ss.ContactPair(name="joint", contact=law, tangential=["a", "b", "b"])
    single = [ss.ContactPair(name=f"{k}", contact=iwan(), tangential=dof) for k, dof in enumerate("abb")]
    results = []
    for contacts in ([pair], single):
        structure = ss.MatrixStructure(M=np.eye(2), C=0.1 * np.eye(2), K=[[2.0, -0.5], [-0.5, 1.0]], dofs=["a", "b"])
        one = ss.Problem(structure, contacts=contacts, loads=[ss.Load(dof="a", sin=2.0)], harmonics=range(6))
        results.append(ss.transient(one, 1.3))
    np.testing.assert_allclose(results[0].coefficients, results[1].coefficients, rtol=0, atol=1e-10)
    np.testing.assert_allclose(results[0].power, results[1].power, rtol=1e-9)


def marched(law, omega, start, steps):
    """One period of a mass on a joint by Heun's steps; each slider is kept within its limit after every step."""
    k, limits = law.slider_parameters({name: np.atleast_1d(value) for name, value in law.values.items()})
    h = 2.0 * np.pi / omega / steps
    x, v, f = start[0], start[1], np.array(start[2:])
    for i in range(steps):
        t = i * h
        a = 0.9 * np.sin(omega * t) - 0.05 * v - x - f.sum()
        there = np.clip(f + k[0] * h * (v + 0.5 * h * a), -limits[0], limits[0])
        moved, faster = x + h * (v + 0.5 * h * a), v + h * a
        b = 0.9 * np.sin(omega * (t + h)) - 0.05 * faster - moved - there.sum()
        way = 0.5 * h * (v + faster)
        x, v, f = x + way, v + 0.5 * h * (a + b), np.clip(f + k[0] * way, -limits[0], limits[0])
    return np.array([x, v, *f])


@pytest.mark.verify
def test_its_motion_and_multipliers_are_those_of_a_march():
    law, omega, steps = iwan(), 1.1, 1000
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.05]], K=[[1.0]], dofs=["x"])
    one = ss.Problem(
        structure, contacts=ss.ContactPair(name="joint", contact=law, tangential="x"),
        loads=[ss.Load(dof="x", sin=0.9)], harmonics=range(20),
    )  # fmt: skip
    branch = ss.forced_response(one, omega=(omega, omega * 1.001), stability=True)
    y = np.zeros(2 + COUNT + 1)
    for _ in range(25):
        y = marched(law, omega, y, steps)
    X, h = branch.dataset["displacement"].values[0, 0], one.harmonics
    at = [X @ h.H_minus(0.0), omega * h.derivative(X) @ h.H_minus(0.0)]
    np.testing.assert_allclose(y[:2], at, rtol=0, atol=4e-3)
    e, n = 1e-4, len(y)
    Phi = np.array([marched(law, omega, y + e * d, steps) - marched(law, omega, y - e * d, steps) for d in np.eye(n)])
    known = np.linalg.eigvals(Phi.T / (2.0 * e))
    largest = known[np.argsort(-np.abs(known))][:2]
    found = multipliers(branch)
    found = found[np.argsort(-np.abs(found))][:2]
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(largest), atol=2e-2)


def test_run_up_is_that_of_its_sliders():
    one, many = (
        ss.runs.run_up(problem(joints, harmonics=range(3), told=None), omega=(0.9, 1.1), rate=0.005).dataset
        for joints in ([iwan()], sliders(iwan()))
    )
    np.testing.assert_allclose(one["amplitude"], many["amplitude"], rtol=0, atol=1e-11)
    power = many["dissipated_power"].values
    np.testing.assert_allclose(one["dissipated_power"][:, 0], power[:, [0, *range(2, power.shape[1])]].sum(axis=1))
    assert set(one["change_contact"].values) == {"damper"}
