"""Rotors in a report: opened on a length, rotations apart, the orbit in the clearance with its states."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.pages import needs_node, opened
from helpers.reports import decoded, decoded_coefficients
from helpers.rotors import shaft, whirling

from slipstick.report.content import content_of


def test_the_orbit_is_that_of_the_results() -> None:
    made = whirling()
    orbits = content_of(made, "a", contacts=1, dofs=2)["contacts"]["orbits"]
    for port in ("x", "y"):
        own = made.dataset[f"contact_{port}"].values
        np.testing.assert_allclose(
            decoded_coefficients(orbits[port]), own, rtol=0, atol=1e-6
        )  # as coefficients are rounded
    np.testing.assert_array_equal(decoded(orbits["gap"]), 1.0)
    assert decoded(orbits["states"]["counts"]).max() >= 2


@needs_node
def test_the_page_draws_the_orbit_in_the_colours_of_contact() -> None:
    """Where it is drawn as in contact, and nowhere else, the centre is beyond the clearance."""
    made = whirling()
    lines = opened(
        {"results": [content_of(made, "a", contacts=1, dofs=2)]},
        """const o = app.result.orbit(0, "stator");
        const drawn = pathLines(o, (t) => o.motion.map((X) => series(X, o.orders, t))).filter((l) => l.name);
        const title = document.getElementById("loop-title").textContent, { loop, states } = app.panels;
        return [drawn.map((l) => [l.name, [...l.x], [...l.y]]), title, loop.note.textContent, states.card.hidden]""",
    )
    paths, title, note, hidden = lines
    assert {name for name, *_ in paths} == {"slip", "separation"}
    for name, x, y in paths:
        r = np.hypot(np.array(x, dtype=float), np.array(y, dtype=float))
        r = r[np.isfinite(r)]
        assert (r >= 1.0 - 1e-5).all() if name == "slip" else (r <= 1.0 + 1e-5).all()
    assert (title, hidden) == ("Orbit in the clearance", False)
    point = 0
    share = sum(b - a for a, b, state in made.states(point)["stator"] if state == "slip") / (2.0 * np.pi)
    assert 0.0 < share < 1.0
    assert "% of the time" in note


@needs_node
def test_the_page_opens_on_a_length_and_keeps_rotations_apart() -> None:
    made = shaft()
    content = content_of(made, "a", contacts=1, dofs=12)
    assert set(content["dofs"]["units_of"]) == {"mm", "rad"}
    first, mixed, label = opened(
        {"results": [content]},
        """const first = app.view.dof, unit = () => app.unitsOf(app.curves.curve, app.result)[1];
        const before = [first, app.view.dofs, unit()];
        app.set({ dofs: [...app.view.dofs, "n0ry"], dof: "n0ry" });
        return [before, [app.view.dof, app.view.dofs, unit()], app.curves.readout.textContent]""",
    )
    assert "r" not in first[0]
    assert first[2] == "mm"
    assert mixed == ["n0ry", ["n0ry"], "rad"]
    assert "n0ry: amplitude" in label
    assert " rad ·" in label


def test_the_figure_of_an_orbit() -> None:
    made = whirling()
    ax = made.plot.orbit(0)
    circle = ax.lines[0]
    np.testing.assert_allclose(np.hypot(*circle.get_data()), 1.0)
    share = sum(b - a for a, b, state in made.states(0)["stator"] if state == "slip") / (2.0 * np.pi)
    assert f"in contact {100.0 * share:.3g} % of the time" in ax.get_title()
    assert {text.get_text() for text in ax.get_legend().get_texts()} == {"slip", "separation"}
    assert ax.get_aspect() == pytest.approx(1.0)
