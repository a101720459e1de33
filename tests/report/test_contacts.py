"""What a page gets to draw forces: states of all points at once, and the series of other laws."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.reports import branch, decoded

import slipstick as ss
from slipstick.report.contacts import STATES, friction_of, series_of


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
    assert seen == set(STATES)


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


def test_no_contacts() -> None:
    made = branch()
    assert friction_of(made.dataset, made.harmonics, np.array([], dtype=int)) is None
    assert friction_of(made.dataset.drop_vars("gap"), made.harmonics, np.arange(2)) is None
