"""What a branch can be asked: forces again from its numbers, loops, states, files, figures, a check in time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.results import corrected

import slipstick as ss
from slipstick.results.schema import POINT_KINDS, VARIABLES


def problem(velocity: float = 2.0) -> ss.Problem:
    """Two masses, the second with a normal direction, the first against the second."""
    structure = ss.MatrixStructure(
        M=np.diag([1.0, 1.0, 0.5]), C=0.3 * np.eye(3),
        K=np.array([[60.0, -20.0, 0.0], [-20.0, 70.0, 5.0], [0.0, 5.0, 90.0]]), dofs=["a", "b", "z"],
    )  # fmt: skip
    pairs = [
        ss.ContactPair(
            name="joint", contact=ss.FrictionContact(kt=80.0, mu=0.4, kn=1.0, gap=-30.0),
            tangential={"a": 1.0, "b": -1.0},
        ),
        ss.ContactPair(
            name="tip", contact=ss.FrictionContact(kt=40.0, mu=0.3, kn=60.0, gap=-0.2), tangential="b", normal="z",
            rubbing=ss.RubbingMotion(velocity=velocity, sin={1: 0.1}),
        ),
    ]  # fmt: skip
    loads = [ss.Load(dof="a", sin=30.0), ss.Load(dof="z", cos=20.0)]
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=ss.Harmonics(range(8)), title="two masses")


@pytest.fixture(scope="module")
def branch() -> ss.Branch:
    return ss.forced_response(problem(), omega=(6.0, 12.0), at=[8.0])


@pytest.mark.parametrize("value", [50.0, 5.9, "3 Hz"])
def test_a_value_outside_the_points_is_no_point(branch: ss.Branch, value: float | str) -> None:
    with pytest.raises(ss.InputError, match="expected omega from 6 to 12, where the branch has points"):
        branch.at(value)
    assert (branch.at(6.0), branch.at(12.0 * (1.0 + 1e-6)), branch.span) == (0, len(branch) - 1, (6.0, 12.0))
    assert not branch.reaches(50.0)


def test_dataset_is_complete_and_described(branch: ss.Branch) -> None:
    dataset = branch.dataset
    assert branch.outcome is ss.Outcome.COMPLETED
    for name, variable in dataset.variables.items():
        assert variable.attrs["units"], name
        assert variable.attrs["long_name"], name
    for name, declared in VARIABLES.items():
        if name not in ("parameter", "temperature"):
            assert dataset[name].dims == ("point", *declared.dims)
            assert declared.texts or np.all(np.isfinite(dataset[name].to_numpy())), name
    assert dataset["coefficient"].to_numpy()[:3].tolist() == ["0", "c1", "s1"]
    assert set(dataset["kind"].to_numpy()) <= set(POINT_KINDS)
    assert dataset.attrs["title"] == "two masses"
    assert dataset.attrs["evaluations"] > corrected(dataset).sizes["point"]
    total = sum(dataset[f"{state}_fraction"].to_numpy() for state in ("stick", "slip", "separation"))
    assert total == pytest.approx(1.0, abs=1e-12)


def test_every_output_satisfies_the_equations_of_motion(branch: ss.Branch) -> None:
    """``Z q = p - D f`` with all numbers from the dataset: outputs that are no contact port included."""
    p, d = branch.problem, corrected(branch.dataset)
    assert p is not None
    h, s = p.harmonics, p.structure
    for i in range(0, d.sizes["point"], 4):
        q, omega = d["displacement"].to_numpy()[i], float(d["omega"][i])
        fx, fy = d["friction_force"].to_numpy()[i], d["normal_force"].to_numpy()[i]
        force = np.array([fx[0], fx[1] - fx[0], fy[1]])
        load = np.zeros_like(q)
        load[0, h.index(1, "s")], load[2, h.index(1, "c")] = 30.0, 20.0
        wanted = load - force
        found = np.zeros_like(q)
        found[:, 0] = s.K @ q[:, 0]
        for j, m in enumerate(h.orders[1:]):
            Z = s.K - (m * omega) ** 2 * s.M + 1j * m * omega * s.C
            hat = Z @ (q[:, 2 * j + 1] - 1j * q[:, 2 * j + 2])
            found[:, 2 * j + 1], found[:, 2 * j + 2] = hat.real, -hat.imag
        assert found == pytest.approx(wanted, abs=1e-6 * np.abs(load).max())


def test_power_balance(branch: ss.Branch) -> None:
    """Power of loads and rubbing motion is that of damping and friction: here, load power less damping is friction's
    part on the structure, which the opposing surface makes up to the dissipated power."""
    p, d = branch.problem, corrected(branch.dataset)
    assert p is not None
    h, q = p.harmonics, d["displacement"].to_numpy()
    omega = d["omega"].to_numpy()
    velocity = h.derivative(q) * omega[:, None, None]
    load = 0.5 * (30.0 * velocity[:, 0, h.index(1, "s")] + 20.0 * velocity[:, 2, h.index(1, "c")])
    damping = 0.5 * 0.3 * (velocity[:, :, 1:] ** 2).sum(axis=(1, 2))
    fx, U = d["friction_force"].to_numpy(), d["rubbing_motion"].to_numpy()
    surface = d["rubbing_velocity"].to_numpy() * fx[:, :, 0]
    surface += 0.5 * (fx[:, :, 1:] * (h.derivative(U) * omega[:, None, None])[:, :, 1:]).sum(axis=2)
    dissipated = d["dissipated_power"].to_numpy()
    assert dissipated.min() > -1e-9 * dissipated.max()
    assert dissipated.sum(axis=1) == pytest.approx(load - damping + surface.sum(axis=1), rel=1e-7)


def test_contact_forces_come_back_from_the_dataset(branch: ss.Branch) -> None:
    at = branch.at(8.0)
    forces = branch.contact_forces(at)
    assert forces.Fx == pytest.approx(branch.dataset["friction_force"].to_numpy()[at], abs=1e-11)
    assert forces.power == pytest.approx(branch.dataset["dissipated_power"].to_numpy()[at], rel=1e-9)
    states = branch.states(at)
    assert list(states) == ["joint", "tip"]
    slip = sum(end - start for start, end, name in states["tip"] if name.startswith("slip")) / (2 * np.pi)
    assert slip == pytest.approx(float(branch.dataset["slip_fraction"][at, 1]), abs=1e-9)


def test_loop_encloses_the_dissipated_energy(branch: ss.Branch) -> None:
    at = branch.at(8.0)
    for contact in ("joint", "tip"):
        loop = branch.loop(at, contact, samples=20001)
        energy = np.trapezoid(loop["friction"], loop["total"])
        power = float(branch.dataset["dissipated_power"].sel(contact=contact)[at])
        assert energy * 8.0 / (2 * np.pi) == pytest.approx(power, rel=1e-5)
        assert np.all(np.abs(loop["friction"]) <= loop["limit"] * (1 + 1e-9) + 1e-12)
        assert loop["friction"][0] == pytest.approx(loop["friction"][-1], abs=1e-9)


def test_save_and_load(branch: ss.Branch, tmp_path: Path) -> None:
    again = ss.load(branch.save(tmp_path / "r.nc"))
    assert again.outcome is branch.outcome
    assert again.message == branch.message
    assert again.peaks("a") == branch.peaks("a")
    assert again.harmonics == branch.harmonics
    assert again.states(3) == branch.states(3)
    assert np.array_equal(again.contact_forces(3).Fx, branch.contact_forces(3).Fx)
    assert again.check_in_time(3).relative_difference == branch.check_in_time(3).relative_difference
    for a, b in zip(again.plot.loop(3).lines, branch.plot.loop(3).lines, strict=True):
        assert np.array_equal(np.asarray(a.get_data()), np.asarray(b.get_data()))


def test_a_branch_goes_on_from_its_last_point(branch: ss.Branch, tmp_path: Path) -> None:
    """The unknowns of a point solve the balance there: the first point needs no correction worth the name."""
    again = ss.load(branch.save(tmp_path / "r.nc"))
    assert again.problem is not None
    further = ss.forced_response(again.problem, omega=(12.0, 13.0), guess=again.guess(-1))
    assert further.dataset["newton_iterations"][0] <= 1
    first, last = further.dataset["displacement"][0], branch.dataset["displacement"][-1]
    np.testing.assert_allclose(first, last, rtol=0, atol=1e-9 * float(abs(last).max()))


def test_a_branch_of_a_dataset_alone_says_why_it_has_no_problem(branch: ss.Branch) -> None:
    with pytest.raises(ss.InputError, match="made from a dataset alone"):
        ss.Branch.from_dataset(branch.dataset).check_in_time(3)


@pytest.mark.parametrize("velocity", [2.0, 0.0])
def test_check_in_time(velocity: float) -> None:
    found = ss.forced_response(problem(velocity), omega=(6.0, 7.0), at=[6.5])
    check = found.check_in_time(found.at(6.5))
    assert check.converged
    assert check.relative_difference < 5e-3  # harmonics 0..7 only
    assert check.relative_difference > 0.0


def test_wrong_names_and_points(branch: ss.Branch) -> None:
    with pytest.raises(ss.InputError, match="no dof 'q'"):
        branch.peaks("q")
    with raises_fault("point", says=f"point: found 1000000; expected a whole number from -{len(branch)} to "):
        branch.contact_forces(10**6)
    with pytest.raises(ss.InputError, match="no contact 'q'"):
        branch.loop(0, "q")


def test_figures(branch: ss.Branch) -> None:
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    for axes in (
        branch.plot.response("b"), branch.plot.mean("z"), branch.plot.power(), branch.plot.fractions("tip"),
        branch.plot.loop(0, "tip"), branch.plot.states(0), branch.plot.friction("joint"),
    ):  # fmt: skip
        assert axes.lines or axes.patches or axes.collections
    pyplot.close("all")


def test_linear_limits() -> None:
    """Without load on the joint it is stuck, and a stuck contact is a spring."""
    p = problem(0.0)
    at = np.array([5.0, 9.0])
    free, stuck = (ss.linear_response(p, omega=at, state=state).dataset for state in ("free", "stuck"))
    K, D = p.structure.K, np.array([1.0, -1.0, 0.0])
    rub = np.array([0.0, 0.1, 0.0]) * 40.0
    spring = 80.0 * np.outer(D, D) + np.diag([0.0, 40.0, 60.0])
    for i, omega in enumerate(at):
        for found, stiffness, push in ((free, K, 0.0 * rub), (stuck, K + spring, rub)):
            Z = stiffness - omega**2 * p.structure.M + 1j * omega * p.structure.C
            hat = np.linalg.solve(Z, np.array([-30.0j, 0.0, 20.0]) + 1j * push)
            assert found["amplitude"].to_numpy()[i] == pytest.approx(np.abs(hat), rel=1e-10)
    with raises_fault("state", found="'slipping'"):
        ss.linear_response(p, omega=at, state="slipping")


def test_the_message_says_where_a_curve_stopped() -> None:
    stopped = ss.forced_response(problem(), omega=(6.0, 12.0), options={"max_points": 3})
    assert stopped.outcome is ss.Outcome.POINT_LIMIT
    assert stopped.message.startswith(stopped.outcome.text)
    assert corrected(stopped.dataset).sizes["point"] == 3
    assert f"the last of {len(stopped)} points is at {float(stopped.dataset.omega[-1]):.6g} rad/s" in stopped.message
    assert stopped.dataset.attrs["outcome_text"] == stopped.message
    assert ss.Branch.from_dataset(stopped.dataset).message == stopped.message


def test_a_complete_curve_has_the_text_of_its_outcome(branch: ss.Branch) -> None:
    assert branch.message == branch.outcome.text


def test_peaks_of_a_linear_response() -> None:
    p = problem()
    linear = ss.linear_response(p, omega=np.linspace(4.0, 14.0, 2001)[::-1])
    size = linear.dataset["amplitude"].sel(dof="b")
    peaks = linear.peaks("b")
    assert len(peaks) == 3
    assert max(a for _, a in peaks) == float(size.max())
    for w, _ in peaks:
        assert np.min(np.abs(p.structure.natural_frequencies - w)) < 0.05
    assert ss.linear_response(p, omega=[5.0]).peaks("b") == []
    with pytest.raises(ss.InputError, match="linear response"):
        linear.contact_forces(0)


@pytest.mark.parametrize("name", ["contact_tangential", "gap", "rubbing_velocity"])
def test_numbers_beyond_any_machine_are_refused(branch: ss.Branch, name: str) -> None:
    data = branch.dataset
    odd = ss.Branch.from_dataset(data.assign({name: (data[name].dims, np.full(data[name].shape, np.inf))}))
    with pytest.raises(ss.InputError, match=rf"contact 'joint': '{name}' .*not a number, or beyond 1e\+100; compute"):
        odd.contact_forces(0)
