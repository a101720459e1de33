"""What a page gets to draw forces: states of all points at once, and the series of other laws."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.reports import branch, decoded, decoded_coefficients, planar_branch

import slipstick as ss
from slipstick.report.contacts import PHASES, STATES, friction_of, planar_of, series_of


@pytest.fixture(scope="module")
def made() -> ss.Branch:
    return branch(spring=True)


def test_states_are_those_of_every_point(made: ss.Branch) -> None:
    found = friction_of(made.dataset, made.harmonics, np.arange(3))
    assert found is not None
    assert found["of"] == [0, 1]
    states = found["states"]
    counts, starts, codes = (decoded(states[key]) for key in ("counts", "starts", "codes"))
    ends = np.cumsum(counts.ravel()).reshape(counts.shape)
    seen = set()
    plain = ss.Branch.from_dataset(made.dataset.isel(contact=[0, 1]))
    for point in range(0, len(made), 7):
        for c, own in enumerate(plain.states(point).values()):
            span = slice(ends[point, c] - counts[point, c], ends[point, c])
            assert [STATES[code] for code in codes[span]] == [state for _, _, state in own]
            assert starts[span].tolist() == [start for start, _, _ in own]
            seen |= {state for _, _, state in own}
    assert seen == set(STATES) - {"slip"}  # of contacts in a plane


def test_parameters_that_stay_are_kept_once(made: ss.Branch) -> None:
    found = friction_of(made.dataset, made.harmonics, np.arange(2))
    assert found is not None
    assert found["kt"]["once"]
    assert found["rubbing"]["once"]
    assert not found["drift"]["once"]


def test_another_law_gives_the_series_of_its_ports(made: ss.Branch) -> None:
    (port,) = series_of(made.dataset, np.arange(3), np.array([0, 1]))
    assert (port["port"], port["of"]) == ("x", [2])
    np.testing.assert_allclose(decoded(port["force"])[:, 0], made.dataset["x_force"].values[:, 2], rtol=1e-6, atol=1e-6)
    assert series_of(made.dataset, np.arange(2), np.array([0, 1])) == []


def test_contacts_in_a_plane_are_not_taken_for_those_along_a_line() -> None:
    """Both forces over the period, within the circle and on it while slipping."""
    made = planar_branch()
    along, found = friction_of(made.table, made.harmonics, np.arange(3)), planar_of(made, np.arange(3))
    assert along is not None
    assert found is not None
    assert (along["of"], found["of"]) == ([2], [0, 1])
    force, limits = decoded_coefficients(found["force"]), decoded(found["limit"])
    for point in range(0, len(made), 5):
        for c, name in enumerate(("foot", "heel")):
            first, second = (made.loop(point, name, samples=PHASES, port=port) for port in ("tangential", "second"))
            wanted, size = np.concatenate([first["force"], second["force"]]), first["limit"].max()
            np.testing.assert_allclose(force[point, c], wanted, atol=1e-6 * size)
            np.testing.assert_allclose(limits[point, c], [first["limit"].min(), size], rtol=1e-12)
            length = np.hypot(first["force"], second["force"])
            assert (length <= first["limit"] + 1e-8 * size).all()
            for start, end, state in made.states(point)[name]:
                inside = (first["tau"] - start) % (2 * np.pi) < end - start
                if state == "slip":
                    np.testing.assert_allclose(length[inside], first["limit"][inside], atol=1e-8 * size)
    assert {state for name in ("foot", "heel") for _, _, state in made.states(0)[name]} >= {"slip", "separation"}


def test_without_the_problem_a_contact_in_a_plane_is_its_harmonics() -> None:
    made = ss.Branch.from_dataset(planar_branch().dataset)
    assert planar_of(made, np.arange(3)) is None
    ports = series_of(made.dataset, np.arange(3), np.array([2]))
    assert [(port["port"], port["of"]) for port in ports] == [(p, [0, 1]) for p in ("tangential", "second", "normal")]
    np.testing.assert_allclose(
        decoded(ports[1]["force"])[:, 0], made.dataset["second_friction_force"].values[:, 0], rtol=1e-6, atol=1e-5
    )


def test_no_contacts() -> None:
    made = branch()
    assert friction_of(made.dataset, made.harmonics, np.array([], dtype=int)) is None
    assert friction_of(made.dataset.drop_vars("gap"), made.harmonics, np.arange(2)) is None
