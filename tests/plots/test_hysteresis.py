"""Loops are those of the element; the area over the sliding motion is the energy dissipated."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.figures import branch, drawn, named, title
from helpers.reports import planar_branch
from matplotlib.axes import Axes

import slipstick as ss
from slipstick import plots
from slipstick.contact.law import Motion
from slipstick.errors import InputError
from slipstick.plots.style import GREY, STATE_COLOURS


def coloured(ax: Axes) -> dict[str, np.ndarray]:
    """Places (n, 2) of the lines of each colour of a state."""
    lines = [line for line in ax.lines if line.get_color() in STATE_COLOURS.values()]
    colours = {line.get_color() for line in lines}
    return {c: np.concatenate([np.array(drawn(line)).T for line in lines if line.get_color() == c]) for c in colours}


def energy(b: ss.Branch, point: int, contact: str) -> float:
    """The integral of the friction force over the sliding motion, from the closed form of the element.

    Gauss' rule within each state, where the force is smooth: exact to rounding.
    """
    d = b.dataset.isel(point=point).sel(contact=contact)
    h, states = b.harmonics, b.states(point)[contact]
    X = d["contact_tangential"].to_numpy()
    W, Y = X + d["rubbing_motion"].to_numpy(), d["contact_normal"].to_numpy()
    v = float(d["rubbing_velocity"] / d["omega"])
    nodes, weights = np.polynomial.legendre.leggauss(40)
    total = 0.0
    numbers = {"kt": "tangential_stiffness", "mu": "friction_coefficient", "kn": "normal_stiffness", "gap": "gap"}
    motion = Motion(h, float(d["omega"]), (W[None], Y[None]), np.array([[v], [0.0]]))
    given = {key: np.array([float(d[name])]) for key, name in numbers.items()}
    for start, end, _ in states:
        tau = 0.5 * (start + end) + 0.5 * (end - start) * nodes
        force = ss.FrictionContact(kt=1.0, mu=0.0, normal_load=0.0).forces_in_time(motion, given, tau)[0][0]
        speed = v + h.H_minus(tau) @ h.derivative(W)
        total += 0.5 * (end - start) * float(weights @ (force * speed))
    return total


@pytest.mark.parametrize("velocity", [0.0, 5.0])
def test_the_area_of_the_loop_over_the_sliding_motion_is_the_energy(velocity: float) -> None:
    b = branch(velocity)
    for point in (0, b.at(6.9)):
        d = b.dataset.isel(point=point)
        for contact in ("c0", "c1", "c2"):
            dissipated = 2 * np.pi * float(d["dissipated_power"].sel(contact=contact)) / float(d["omega"])
            scale = 2 * np.pi * 60.0 * abs(float(d["amplitude"].max()))
            assert energy(b, point, contact) == pytest.approx(dissipated, rel=1e-9, abs=1e-9 * scale)
            w, f = drawn(b.plot.loop(point, contact, over="sliding").lines[0])
            area = float(np.sum(0.5 * (f[1:] + f[:-1]) * np.diff(w)))
            assert area == pytest.approx(dissipated, rel=1e-3, abs=1e-4 * scale)


@pytest.mark.parametrize("velocity", [0.0, 5.0])
def test_a_loop_over_the_vibration_and_one_over_the_sliding_motion(velocity: float) -> None:
    b, point = branch(velocity), branch(velocity).at(6.9)
    left, right = b.plot.loops(point, "c1", limit=True)
    period = b.loop(point, "c1")
    np.testing.assert_array_equal(drawn(left.lines[0]), (period["motion"], period["friction"]))
    np.testing.assert_array_equal(drawn(right.lines[0]), (period["total"], period["friction"]))
    np.testing.assert_array_equal(drawn(left.lines[2])[1], -period["limit"])
    closes = drawn(right.lines[0])[0][[0, -1]]
    advanced = 2 * np.pi * velocity / float(b.dataset["omega"][point])
    assert closes[1] - closes[0] == pytest.approx(advanced, abs=1e-9)
    assert (left.get_xlabel(), right.get_xlabel()) == ("Vibration x [mm]", "Sliding motion x + u [mm]")
    assert (left.get_ylabel(), right.get_ylabel()) == ("Friction force [N]", "")
    d = b.dataset.isel(point=point).sel(contact="c1")
    size = 2 * np.pi * float(d["dissipated_power"]) / float(d["omega"])
    assert right.get_title() == f"area = energy dissipated a period = {size:.4g} mJ"
    assert title(left) == f"Chain (c1, at {float(d['omega']):.5g} rad/s)"
    assert len(right.patches) == 1


def test_loops_of_several_contacts_have_names() -> None:
    left, right = branch().plot.loops(3, ["c0", "c2"])
    assert (named(left), named(right)) == ([], ["c0", "c2"])
    assert len(left.lines) == len(right.lines) == 2
    assert named(branch().plot.loop(3, "c0", label="v = 0")) == ["v = 0"]
    ax = branch().plot.loop(3, "c0", label="v = 0")
    branch(5.0).plot.loop(3, "c0", label="v = 5", ax=ax)
    assert named(ax) == ["v = 0", "v = 5"]


def test_loops_over_something_else() -> None:
    with pytest.raises(InputError, match="over: found 'u'; expected 'vibration' or 'sliding'"):
        plots.loop(branch(), 0, over="u")


def test_the_force_of_a_contact_in_a_plane_stays_within_the_circle() -> None:
    """Its path and that of the vibration, both over one period, and circles of the smallest and largest limit."""
    made = planar_branch()
    for name, circles in (("heel", [30.0]), ("foot", None)):
        left, right = made.plot.loops(0, name)
        states = made.states(0)[name]
        first, second = (made.loop(0, name, port=port) for port in ("tangential", "second"))
        force, vibration = (coloured(ax) for ax in (left, right))
        assert set(force) == set(vibration) == {STATE_COLOURS[state] for *_, state in states}
        for drawn_in, key in ((force, "force"), (vibration, "motion")):
            places = {tuple(place) for own in drawn_in.values() for place in own}
            assert set(zip(first[key].tolist(), second[key].tolist(), strict=True)) <= places
        slipping = force.get(STATE_COLOURS["slip"], np.zeros((0, 2)))
        assert (np.hypot(*slipping.T) <= first["limit"].max() * (1 + 1e-8) + 1e-9).all()
        radii = [np.hypot(*drawn(line)) for line in left.lines if line.get_color() == GREY]
        wanted = circles or [first["limit"].min(), first["limit"].max()]
        np.testing.assert_allclose([radius.max() for radius in radii], wanted, rtol=1e-12)
        np.testing.assert_allclose([radius.min() for radius in radii], wanted, rtol=1e-12)
        assert left.get_aspect() == right.get_aspect() == 1.0
    both = made.plot.loops(0, ["foot", "heel"])
    told = {state for name in ("foot", "heel") for *_, state in made.states(0)[name]}
    assert {text.get_text() for text in both[1].get_legend().get_texts()} == told
    assert {text.get_text() for text in both[1].texts} == {"foot", "heel"}
    mixed = made.plot.loops(0, ["foot", "joint"])[0]  # along the first port
    np.testing.assert_array_equal(drawn(mixed.lines[0])[1], made.loop(0, "foot")["force"])
