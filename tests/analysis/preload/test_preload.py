"""Load steps against closed forms: bolts, heat, sliders, histories of friction."""

import dataclasses
import warnings

import numpy as np
import pytest

import slipstick as ss
from slipstick.contact.quasi_static import incremented
from slipstick.errors import InputError


def static(dof, force):
    return ss.Load(dof=dof, harmonic=0, cos=force)


KB, KP = 2e8, 7e8


def flange(**options):
    """A flange that one contact presses on the ground and one bolt holds there."""
    structure = ss.MatrixStructure(M=[[2.0]], K=[[0.0]], C=[[5.0]], dofs=["u"])
    plates = ss.ContactPair(name="plates", contact=ss.FrictionContact(kn=KP, gap=0.0), normal={"u": -1.0})
    screw = ss.bolt(name="bolt 1", elongation={"u": 1.0}, stiffness=KB)
    return ss.Problem(structure, contacts=[plates, screw], harmonics=3, **options)


def forces(state, step=-1):
    data = state.dataset.isel(step=step)
    return dict(zip(data.contact.values.tolist(), data.normal_force.values.tolist(), strict=True))


@pytest.mark.parametrize("share", [0.2, 0.8, 0.999])
def test_a_bolt_takes_its_share_of_a_load(share):
    F = 12e3
    apart = F * (KB + KP) / KP
    steps = [ss.LoadStep(bolts={"bolt 1": F}), ss.LoadStep(loads=static("u", share * apart))]
    state = ss.preload(flange(), steps)
    assert forces(state, 0)["bolt 1"] == pytest.approx(F, rel=1e-12)
    assert forces(state, 0)["plates"] == pytest.approx(F, rel=1e-9)
    expected = F + share * apart * KB / (KB + KP)
    assert forces(state)["bolt 1"] == pytest.approx(expected, rel=1e-8)
    assert forces(state)["plates"] == pytest.approx(expected - share * apart, abs=1e-6 * F)
    assert state.dataset.open_share.sel(joint="plates").values.tolist() == [0.0, 0.0]


def test_beyond_the_separation_the_bolt_takes_all():
    F, P = 12e3, 30e3
    state = ss.preload(flange(), [ss.LoadStep(bolts={"bolt 1": F}), ss.LoadStep(loads=static("u", P))])
    assert forces(state)["bolt 1"] == pytest.approx(P, rel=1e-9)
    assert state.dataset.state.sel(contact="plates").values.tolist() == ["closed", "open"]
    u = F / KP  # the plates are compressed by F / KP where the bolt has its preload
    assert state.dataset.gap.sel(contact="plates").values[-1] == pytest.approx((P - F) / KB - u, rel=1e-9)


def test_a_bolt_is_tightened_by_shortening():
    length = 5e-5
    state = ss.preload(flange(), ss.LoadStep(shortening={"bolt 1": length}))
    assert forces(state)["bolt 1"] == pytest.approx(length / (1 / KB + 1 / KP), rel=1e-9)
    again = [ss.LoadStep(bolts={"bolt 1": forces(state)["bolt 1"]}), ss.LoadStep(loads=static("u", 100.0))]
    assert ss.preload(flange(), again).gaps[1] == pytest.approx(-length, rel=1e-9)


def test_a_load_stays_until_it_is_named_again():
    steps = [ss.LoadStep(bolts={"bolt 1": 1e4}, loads=static("u", -500.0)), ss.LoadStep(bolts={"bolt 1": 1.2e4})]
    steps.append(ss.LoadStep(loads=static("u", 0.0)))
    state = ss.preload(flange(), steps)
    assert forces(state, 1)["plates"] == pytest.approx(1.2e4 + 500.0, rel=1e-9)
    assert forces(state)["plates"] == pytest.approx(1.2e4 + 500.0 - 500.0 * KP / (KB + KP), rel=1e-9)
    assert state.loads == ()


def test_loads_of_the_problem_come_first_and_its_factor_counts():
    problem = flange(loads=[static("u", -500.0), ss.Load(dof="u", cos=1.0)], load=2.0)
    state = ss.preload(problem)
    assert forces(state)["plates"] == pytest.approx(1000.0, rel=1e-9)
    assert [load.cos for load in state.loads] == [-500.0]
    assert sorted(load.harmonic for load in problem.preloaded(state).loads) == [0, 1]


def test_a_clamped_bar_is_heated():
    """A bar between a wall and a stop across a gap, by its nodal forces of thermal strain: one force along it."""
    n, EA, L, strain, gap, kn = 8, 4e6, 0.5, 1.2e-3, 2e-4, 3e8
    k = EA * n / L
    K = k * (np.diag([2.0] * (n - 1) + [1.0]) - np.eye(n, k=1) - np.eye(n, k=-1))
    structure = ss.MatrixStructure(M=np.eye(n), K=K, dofs=[f"x{i}" for i in range(1, n + 1)])
    stop = ss.ContactPair(name="stop", contact=ss.FrictionContact(kn=kn, gap=gap), normal={f"x{n}": 1.0})
    problem = ss.Problem(structure, contacts=stop)
    hot = ss.LoadStep(loads=static(f"x{n}", EA * strain))  # those of neighbours cancel but for the end
    state = ss.preload(problem, hot)
    N = (strain * L - gap) / (L / EA + 1.0 / kn)
    assert forces(state)["stop"] == pytest.approx(N, rel=1e-9)
    end = state.dataset.displacement.sel(dof=f"x{n}").item()
    assert end == pytest.approx(gap + N / kn, rel=1e-9)
    cold = ss.preload(problem, ss.LoadStep(loads=static(f"x{n}", 0.5 * EA * gap / L)))
    assert cold.dataset.state.item() == "open"
    assert cold.dataset.gap.item() == pytest.approx(0.5 * gap, rel=1e-9)


SLIDERS = ((100.0, 3.0), (60.0, 5.0), (40.0, 8.0))
"""Stiffness and limit of sliders beside a spring of stiffness 20."""


def iwan():
    structure = ss.MatrixStructure(M=[[1.0]], K=[[20.0]], C=[[0.5]], dofs=["x"])
    contacts = [
        ss.ContactPair(
            name=f"slider {i}", tangential="x", contact=ss.FrictionContact(kt=kt, mu=0.5, normal_load=2.0 * limit)
        )
        for i, (kt, limit) in enumerate(SLIDERS)
    ]
    return ss.Problem(structure, contacts=contacts)


def virgin(force):
    """Displacement of the sliders by a first load: a polygon."""
    turning = sorted(limit / kt for kt, limit in SLIDERS)
    x = np.array([0.0, *turning, 10.0 + turning[-1]])
    total = 20.0 * x + sum(np.minimum(kt * x, limit) for kt, limit in SLIDERS)
    return float(np.interp(force, total, x))


def x_of(state):
    return state.dataset.displacement.values[:, 0]


def test_loading_unloading_and_reloading_follow_masing():
    P = 22.0
    path = [P, 5.0, -P, -3.0, P]
    x = x_of(ss.preload(iwan(), [ss.LoadStep(loads=static("x", force)) for force in path]))
    assert x[0] == pytest.approx(virgin(P), rel=1e-9)
    for k, force in enumerate(path[1:3], 1):
        assert x[k] == pytest.approx(x[0] - 2.0 * virgin((P - force) / 2.0), rel=1e-9, abs=1e-9)
    assert x[3] == pytest.approx(x[2] + 2.0 * virgin((P - 3.0) / 2.0), rel=1e-9)
    assert x[4] == pytest.approx(x[0], rel=1e-9)


@pytest.mark.parametrize("parts", [1, 3, 10])
def test_steps_in_parts_end_alike(parts):
    P = 22.0
    up = [ss.LoadStep(loads=static("x", P * (k + 1) / parts), increments=1 + k % 2) for k in range(parts)]
    down = [ss.LoadStep(loads=static("x", P - 30.0 * (k + 1) / parts), increments=2) for k in range(parts)]
    x = x_of(ss.preload(iwan(), up + down))
    assert x[-1] == pytest.approx(virgin(P) - 2.0 * virgin(15.0), rel=1e-9)


def test_two_blocks_on_a_string_slip_one_after_the_other():
    """The second is pulled. It slips at once its limit is reached; then the string loads the first."""
    k, kt, limits = 50.0, 200.0, (4.0, 6.0)
    structure = ss.MatrixStructure(M=np.eye(2), K=[[k + 5.0, -k], [-k, k]], dofs=["x1", "x2"])
    feet = [
        ss.ContactPair(
            name=f"foot {i + 1}", tangential=f"x{i + 1}",
            contact=ss.FrictionContact(kt=kt, mu=0.4, normal_load=limit / 0.4),
        )
        for i, limit in enumerate(limits)
    ]  # fmt: skip
    pulls = (5.0, 9.0, 14.0)
    state = ss.preload(ss.Problem(structure, contacts=feet), [ss.LoadStep(loads=static("x2", P)) for P in pulls])
    K = np.asarray(structure.K)
    both = np.linalg.solve(K + kt * np.eye(2), [0.0, pulls[0]])
    one = np.linalg.solve(K + np.diag([kt, 0.0]), [0.0, pulls[1] - limits[1]])
    none = np.linalg.solve(K, [-limits[0], pulls[2] - limits[1]])
    assert kt * one[0] < limits[0]
    np.testing.assert_allclose(state.dataset.displacement.values, [both, one, none], rtol=1e-9)
    assert state.dataset.state.values.tolist() == [["stick", "stick"], ["stick", "slip"], ["slip", "slip"]]
    slip = state.dataset.slip.values[:, :, 0]
    np.testing.assert_allclose(slip[1], [0.0, one[1] - limits[1] / kt], atol=1e-12)


def sledge(planar=True):
    """A body that contacts alone hold: pressed on the ground, it sticks by friction."""
    structure = ss.MatrixStructure(M=np.eye(3), K=np.zeros((3, 3)), C=np.eye(3), dofs=["x", "y", "z"])
    law = ss.PlanarFrictionContact(kt=100.0, kn=300.0, mu=0.5, gap=0.0)
    foot = ss.ContactPair(name="foot", contact=law, tangential=("x", "y"), normal={"z": -1.0})
    return ss.Problem(structure, contacts=foot)


def test_friction_alone_holds_a_body():
    press = ss.LoadStep(loads=static("z", -10.0))
    push = ss.LoadStep(loads=[static("x", 2.4), static("y", 1.8)])
    state = ss.preload(sledge(), [press, push])
    np.testing.assert_allclose(state.dataset.displacement.values[-1], [0.024, 0.018, -10.0 / 300.0], rtol=1e-9)
    np.testing.assert_allclose(state.dataset.friction_force.values[-1, 0], [2.4, 1.8], rtol=1e-9)
    too_much = ss.LoadStep(name="pull", loads=[static("x", 4.0), static("y", 4.0)])
    with pytest.raises(InputError, match=r"preload, pull: no equilibrium beyond 88\.3.*foot.*tighten the bolts"):
        ss.preload(sledge(), [press, too_much])


def test_vibration_begins_from_the_preload():
    """Of small motion the mean forces are those of the load steps."""
    problem = flange(loads=ss.Load(dof="u", cos=20.0))
    state = ss.preload(problem, [ss.LoadStep(bolts={"bolt 1": 12e3}), ss.LoadStep(loads=static("u", 3e3))])
    both = [
        problem.preloaded(state),
        ss.Problem(problem.structure, contacts=problem.contacts, loads=problem.loads, harmonics=3, preload=state),
    ]
    for vibrating in both:
        branch = ss.steady_response(vibrating, omega=50.0)
        found = branch.dataset.normal_force.isel(point=0).sel(coefficient="0").values
        np.testing.assert_allclose(found, list(forces(state).values()), rtol=1e-8)  # the balance ends at 1e-10 of u
        # the ripple of the bolt is its share of the load
        ripple = branch.dataset.normal_force.isel(point=0, contact=1).sel(coefficient="c1").item()
        assert ripple == pytest.approx(20.0 * KB / (KB + KP), rel=1e-4)


def test_stuck_contacts_keep_the_friction_of_the_assembly():
    """Small vibration after loading and unloading: mean friction and displacement are those of the last step."""
    problem = iwan()
    state = ss.preload(problem, [ss.LoadStep(loads=static("x", force)) for force in (22.0, 4.0, 6.0)])
    left = state.dataset.friction_force.values[-1, :, 0]
    assert np.abs(left).min() > 0.1
    small = ss.Problem(
        problem.structure, contacts=problem.contacts, loads=ss.Load(dof="x", cos=0.5), harmonics=5, preload=state
    )
    branch = ss.steady_response(small, omega=2.0)
    point = branch.dataset.isel(point=0)
    np.testing.assert_allclose(point.friction_force.sel(coefficient="0").values, left, rtol=1e-9)
    assert point.displacement.sel(dof="x", coefficient="0").item() == pytest.approx(x_of(state)[-1], rel=1e-9)
    # of large vibration nothing is left of it
    large = ss.steady_response(ss.Problem(
        problem.structure, contacts=problem.contacts, loads=ss.Load(dof="x", cos=60.0), harmonics=5,
        preload=state,
    ), omega=2.0)  # fmt: skip
    np.testing.assert_allclose(large.dataset.friction_force.isel(point=0).sel(coefficient="0"), 0.0, atol=2.3)


def two_feet(*rests, amplitude=0.5, names=("a", "b")):
    """Two masses in one chain, each on a foot; the second slips in every period."""
    structure = ss.MatrixStructure(
        M=np.eye(2), C=0.1 * np.eye(2), K=[[40.0, -10.0], [-10.0, 30.0]], dofs=["x", "y"]
    )  # fmt: skip
    feet = [
        ss.ContactPair(
            name=name, contact=ss.FrictionContact(kt=100.0, mu=0.3, normal_load=load, rest=rest), tangential=dof
        )
        for name, load, rest, dof in zip(names, (10.0, 1.0), rests, "xy", strict=True)
    ]
    loads = [ss.Load(dof=dof, cos=amplitude) for dof in "xy"]
    return ss.Problem(structure, contacts=feet, loads=loads, harmonics=7)


@pytest.mark.parametrize("amplitude", [0.1, 2.0])
def test_motion_in_time_has_the_mean_of_the_preload(amplitude):
    problem = two_feet(None, None, amplitude=amplitude)
    state = ss.preload(problem, [ss.LoadStep(loads=static("x", force)) for force in (6.0, 1.0)])
    vibrating = problem.preloaded(state)
    branch = ss.steady_response(vibrating, omega=3.0, stability=True)
    assert np.abs(branch.dataset["mean"] - [1 / 27.5, 1 / 110.0]).max() > 0.004  # of the problem without preload
    check = branch.check_in_time(0)
    np.testing.assert_allclose(check.mean_in_time, branch.dataset["mean"].values[0], rtol=1e-5)
    assert check.converged
    assert branch.dataset.stable.item() == 1
    for begun in (vibrating, problem):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            motion = ss.transient(begun, 3.0)
        if amplitude == 0.1:  # neither foot slips while the motion sets in
            mean = branch.dataset["mean"].values[0] if begun is vibrating else np.zeros(2)
            np.testing.assert_allclose(motion.mean, mean, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("rests", [(0.0, 0.0), (None, 0.0), (0.0, None)])
def test_contacts_that_remember_and_others_have_the_same_stability(rests):
    """Symmetric motion has no mean force, whether contacts remember where they were or not."""
    found = []
    for given in (rests, (None, None)):
        branch = ss.steady_response(two_feet(*given, amplitude=2.0), omega=[3.0, 5.3], stability=True)
        data = branch.dataset
        found.append((data.multiplier.values, data.stable.values, branch.contact_forces(1).Fx))
    assert np.isfinite(found[0][0]).any()
    for mine, other in zip(*found, strict=True):
        np.testing.assert_allclose(mine, other, rtol=1e-7, atol=1e-7)


def test_steps_without_load_leave_all_as_it_is():
    state = ss.preload(iwan(), [ss.LoadStep(), ss.LoadStep(loads=static("x", 0.0))])
    np.testing.assert_array_equal(state.dataset.displacement, 0.0)
    np.testing.assert_array_equal(state.dataset.friction_force.values[:, :, 0], 0.0)


def test_a_second_preload_says_that_it_begins_anew():
    problem = iwan()
    state = ss.preload(problem, ss.LoadStep(loads=static("x", 22.0)))
    with pytest.warns(ss.SlipstickWarning, match=r"an earlier preload left in .* is left out"):
        ss.preload(problem.preloaded(state))
    bolted = flange()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ss.preload(bolted.preloaded(ss.preload(bolted, ss.LoadStep(bolts={"bolt 1": 12e3}))))


def test_a_body_held_by_friction_vibrates_where_it_was_left(tmp_path):
    press = ss.LoadStep(loads=static("z", -10.0))
    push = ss.LoadStep(loads=[static("x", 2.4), static("y", 1.8)])
    problem = sledge()
    state = ss.preload(problem, [press, push])
    shaken = ss.Problem(
        problem.structure, contacts=problem.contacts, loads=ss.Load(dof="x", cos=0.3), harmonics=5, preload=state
    )
    branch = ss.steady_response(shaken, omega=1.0)
    point = branch.dataset.isel(point=0)
    np.testing.assert_allclose(point.friction_force.sel(coefficient="0").values[0], 2.4, rtol=1e-8)
    np.testing.assert_allclose(point.second_friction_force.sel(coefficient="0").values[0], 1.8, rtol=1e-8)
    np.testing.assert_allclose(point["mean"].values, [0.024, 0.018, -10.0 / 300.0], rtol=1e-8)
    branch.save(tmp_path / "r.nc")
    again = ss.load(tmp_path / "r.nc")
    assert again.problem.contacts[0].contact == shaken.contacts[0].contact
    np.testing.assert_allclose(again.loop(0)["force"].mean(), 2.4, rtol=1e-2)


@pytest.mark.parametrize("planar", [False, True])
def test_an_increment_is_straight(planar):
    """One increment along a line is as many: contact that closes within it, slips and sticks."""
    values = {name: np.array([value]) for name, value in {"kt": 80.0, "mu": 0.4, "kn": 120.0, "gap": 0.1}.items()}
    for end in ((0.3, 0.5), (0.02, 0.6), (-0.4, 0.2)):
        along = np.array([[0.6], [0.8]]) if planar else np.array([[1.0]])
        stop = np.vstack([along * end[0], [[end[1]]]])
        at = np.vstack([along * 0.05, [[-0.2]]])
        force, begin = np.zeros_like(at), at
        whole = incremented(force, at, stop, values)
        for t in np.linspace(0.0, 1.0, 301)[1:]:
            now = begin + t * (stop - begin)
            force, at = incremented(force, at, now, values).force, now
        np.testing.assert_allclose(whole.force, force, rtol=1e-9, atol=1e-12)


def test_slopes_of_increments_are_those_of_differences():
    rng = np.random.default_rng(3)
    n, step = 400, 1e-7
    values = {"kt": rng.uniform(20, 90, n), "mu": rng.uniform(0, 0.8, n), "kn": rng.uniform(50, 200, n)}
    values["gap"] = rng.uniform(-0.3, 0.3, n)
    before, after = rng.uniform(-0.5, 0.5, (2, 3, n))
    start = np.zeros((3, n))
    start[-1] = values["kn"] * np.maximum(before[-1] - values["gap"], 0.0)
    angle, size = rng.uniform(0, 7, n), rng.uniform(0, 1, n) * values["mu"] * start[-1]
    start[:2] = size * np.cos(angle), size * np.sin(angle)
    found = incremented(start, before, after, values)
    for j in range(3):
        moved = [after.copy(), after.copy()]
        moved[0][j] += step
        moved[1][j] -= step
        ends = [incremented(start, before, one, values).force for one in moved]
        slope = (ends[0] - ends[1]) / (2 * step)
        wrong = np.abs(found.slopes[:, j] - slope) > 1e-5 * (1.0 + np.abs(slope))
        assert wrong.any(axis=0).sum() <= 1  # at most one lies on a kink


def test_faults_are_told_together():
    with pytest.raises(InputError) as error:
        ss.LoadStep(name="a", loads=ss.Load(dof="x", cos=1.0), bolts={"b": -1.0}, shortening={"b": 0.1}, increments=0)
    text = str(error.value)
    for part in ("loads, number 1", "harmonic=0", "a force >= 0", "given together with its force", "increments"):
        assert part in text
    with pytest.raises(InputError, match=r"there is no bolt 'bolt 2'.*did you mean 'bolt 1'"):
        ss.preload(flange(), ss.LoadStep(bolts={"bolt 2": 1.0}))
    with pytest.raises(InputError, match="shortening, bolt 1 is given together with its force"):
        ss.preload(flange(), ss.LoadStep(bolts={"bolt": 1.0}, shortening={"bolt 1": 0.1}))
    with pytest.raises(InputError, match="there is no dof 'w'"):
        ss.preload(flange(), ss.LoadStep(loads=static("w", 1.0)))
    with pytest.raises(InputError, match="'foot' is no bolt"):
        ss.preload(sledge(), ss.LoadStep(bolts={"foot": 1.0}))
    with pytest.raises(InputError, match="elongation has no direction"):
        ss.bolt(name="a", elongation={}, stiffness=1.0)
    with pytest.raises(InputError, match="preload is that of a problem with other contacts"):
        iwan().preloaded(ss.preload(flange(), ss.LoadStep(bolts={"bolt 1": 1.0})))
    foot, law = iwan().contacts[0], ss.FrictionContact(kt=1.0, mu=0.3, normal_load=[1.0, 2.0])
    two = ss.ContactPair(name=foot.name, contact=law, tangential=[foot.tangential] * 2)
    with pytest.raises(InputError, match="preload is that of a problem with other contacts"):
        ss.Problem(iwan().structure, contacts=[two, *iwan().contacts[1:]], preload=ss.preload(iwan(), ss.LoadStep()))
    with pytest.raises(InputError, match=r"preload: found 3; expected what ss\.preload returns"):
        iwan().preloaded(3)


def test_other_laws_and_loose_bodies_are_refused():
    structure = ss.MatrixStructure(M=[[1.0]], K=[[20.0]], dofs=["x"])
    dahl = ss.ContactPair(name="d", contact=ss.models.DahlContact(kt=10.0, limit=1.0), tangential="x")
    with pytest.raises(InputError, match="DahlContact cannot be followed through load steps"):
        ss.preload(ss.Problem(structure, contacts=dahl), ss.LoadStep(loads=static("x", 1.0)))
    free = ss.MatrixStructure(M=np.eye(2), K=np.zeros((2, 2)), C=np.eye(2), dofs=["x", "y"])
    foot = ss.ContactPair(name="foot", contact=ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0), tangential="x")
    with pytest.raises(InputError, match=r"nothing|no contact"):
        ss.preload(ss.Problem(free, contacts=foot), ss.LoadStep(loads=static("x", 0.1)))


def test_rubbing_is_left_out_and_told():
    structure = ss.MatrixStructure(M=[[1.0]], K=[[20.0]], dofs=["x"])
    foot = ss.ContactPair(
        name="foot", contact=ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0), tangential="x",
        rubbing=ss.RubbingMotion(velocity=3.0),
    )  # fmt: skip
    with pytest.warns(ss.SlipstickWarning, match="leave out the rubbing motion of foot"):
        ss.preload(ss.Problem(structure, contacts=foot), ss.LoadStep(loads=static("x", 0.1)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ss.preload(iwan(), ss.LoadStep(loads=static("x", 0.1)))


def test_other_values_than_those_of_the_load_steps_are_told():
    problem = iwan()
    state = ss.preload(problem, ss.LoadStep(loads=static("x", 0.1)))
    stiffer = [dataclasses.replace(pair, contact=pair.contact.changed(kt=9.0)) for pair in problem.contacts[:1]]
    with pytest.warns(ss.SlipstickWarning, match=rf"other values of {problem.contacts[0].name}\.kt, and are not"):
        ss.Problem(problem.structure, contacts=[*stiffer, *problem.contacts[1:]], preload=state)


def test_a_step_that_is_not_there_and_a_folder_that_is_not_there(tmp_path):
    state = ss.preload(iwan(), ss.LoadStep(loads=static("x", 0.1)))
    with pytest.raises(InputError, match="step: found 7; expected a whole number from -1 to 0"):
        state.table(7)
    with pytest.raises(InputError, match=r"preload\.nc: cannot be written \(there is no folder"):
        state.save(tmp_path / "missing" / "preload.nc")
