"""Runs of the compiled batch: each computes its own elements, keeps states where asked, says where it cannot go on."""

from __future__ import annotations

import numpy as np

from slipstick.contact.kernel.batch import ALL_DONE, most_intervals, run_elements
from slipstick.contact.kernel.tuples import NAMES, SLIP_PLUS, BatchOutputs, States
from slipstick.contact.law import Placed
from slipstick.trig.basis import Grid, grid
from slipstick.trig.harmonics import Harmonics

COUNT = 4


def batch(tables: Grid, states: bool) -> tuple[Placed, BatchOutputs, States]:
    """A cosine of unit size at the last port against kt = 1, limit 0.5, and outputs that no one has written."""
    L = 2 * tables.n + 1
    X, rows, still = np.zeros((1, COUNT + 1, L)), np.full((2, COUNT), -1), np.zeros((2, COUNT))
    X[:, :, 1], rows[0] = 1.0, np.arange(1, COUNT + 1)
    values = np.tile([1.0, 0.5, 1.0, -1.0], (COUNT, 1))
    kept, room = (COUNT, most_intervals(tables.top)) if states else (0, 0)
    return (
        Placed(X, rows, np.zeros((2, COUNT, L)), still, still, np.ones(1), values),
        BatchOutputs(
            *(np.full((COUNT, *shape), np.nan) for shape in ((7, L), (3, L, L), (6,), (2, L), (5,))),
            np.full((2, 1, COUNT + 1, L), np.nan),
        ),
        States(np.full(kept, -1), np.zeros((kept, room, 3)), np.zeros((kept, room, 2), np.int64)),
    )


def go(first: int, last: int, tables: Grid, states: bool = False) -> tuple[int, BatchOutputs, States]:
    inputs, outputs, kept = batch(tables, states)
    return run_elements(first, last, tuple(inputs), tuple(tables), tuple(outputs), tuple(kept)), outputs, kept


def test_a_run_writes_its_own_elements_and_no_others() -> None:
    ended, outputs, _ = go(1, 3, grid(Harmonics(3)))
    assert ended == ALL_DONE
    of_ports = outputs.on_ports.swapaxes(0, 2)[1:]
    for array in (*outputs[:-1], of_ports):
        assert np.isnan(array[[0, 3]]).all()
        assert np.isfinite(array[1:3]).all()


def test_states_are_kept_where_they_are_asked_for() -> None:
    """From each turn the contact sticks until the motion has gone back by 1, then slips, a quarter period each."""
    _, _, kept = go(0, COUNT, grid(Harmonics(3)), states=True)
    assert kept.totals.tolist() == [4] * COUNT
    at, code = kept.at[0, :4], kept.code[0, :4]
    np.testing.assert_allclose(np.diff(at[:, :2]), np.full((4, 1), np.pi / 2), atol=1e-14)
    assert sorted(NAMES[state] for state in code[:, 0]) == ["slip+", "slip-", "stick", "stick"]
    np.testing.assert_allclose(at[code[:, 0] == SLIP_PLUS, 2], 0.5, atol=1e-15)


def test_a_run_ends_at_the_element_that_cannot_be_computed() -> None:
    """No motion has more roots than fit; so the room is made too small."""
    assert go(2, COUNT, grid(Harmonics([0, 6])))[0] == ALL_DONE
    tables = grid(Harmonics([0, 6]))._replace(top=2)
    inputs, outputs, kept = batch(tables, states=False)
    inputs.X[..., 1], inputs.X[0, 4, 1] = 0.0, 1.0
    assert run_elements(0, COUNT, tuple(inputs), tuple(tables), tuple(outputs), tuple(kept)) == 3
