"""What modes left out do: the estimate bounds the true error of a chain below its last mode, in any units."""

import numpy as np
import pytest
from scipy.linalg import eigh

from slipstick.structure.truncation import REFUSED, WARNED_REDUCTION, Truncation, WorstError

N = 12
K = 100.0 * (2.0 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
M = np.diag(np.linspace(1.0, 2.0, N))
VALUES, SHAPES = eigh(K, M)
KEPT = [2, 5, 9]


def truncation(modes, second=True, unit=1.0):
    a = SHAPES[KEPT] * unit
    static = (a / VALUES) @ a.T
    left = a[:, modes:]
    residual = (left / VALUES[modes:] ** 2) @ left.T if second else None
    return Truncation(
        omega=np.sqrt(VALUES[:modes]), mode_shapes=a[:, :modes], static_compliance=static, second_residual=residual
    )


def true_error(modes, w, second):
    a = SHAPES[KEPT]
    scale = 1.0 / np.sqrt(np.diag((a / VALUES) @ a.T))
    a = a * scale[:, None]
    exact = (a / (VALUES - w**2)) @ a.T
    left = a[:, modes:]
    short = (a[:, :modes] / (VALUES[:modes] - w**2)) @ a[:, :modes].T + (left / VALUES[modes:]) @ left.T
    if second:
        short = short + w**2 * (left / VALUES[modes:] ** 2) @ left.T
    return np.linalg.norm(exact - short) / np.linalg.norm(short)


@pytest.mark.parametrize("modes", [2, 4, 8])
@pytest.mark.parametrize("second", [True, False])
def test_the_estimate_bounds_the_error_below_the_last_mode(modes, second):
    found, last = truncation(modes, second), np.sqrt(VALUES[modes - 1])
    for share in (0.1, 0.5, 0.8):
        w = share * last
        true = true_error(modes, w, second)
        assert 0.99 * true <= float(found.error(w)) < 100.0 * true


def test_units_do_not_matter_and_all_modes_leave_nothing_out():
    w = np.linspace(0.5, 10.0, 7)
    np.testing.assert_allclose(truncation(4).error(w), truncation(4, unit=1e3).error(w), rtol=1e-10)
    assert truncation(N).error(w).max() < 1e-12
    assert truncation(N).valid_to() == np.inf


def test_valid_to_is_where_the_estimate_reaches_one_percent():
    found = truncation(3)
    w = found.valid_to()
    assert float(found.error(0.99 * w)) <= REFUSED < float(found.error(1.02 * w))


def test_a_worst_error_says_what_to_do():
    bad = WorstError(value=0.2, relative=0.2, omega=5.0, last_mode=4.0, reach=5.0)
    assert bad.refused
    assert "force = true" in bad.sentence(7)
    assert "all 7 below" in bad.sentence(7)
    fair = WorstError(
        value=10 * WARNED_REDUCTION, relative=10 * WARNED_REDUCTION, omega=5.0, last_mode=9.0, reach=5.0, kind="bound"
    )
    assert not fair.refused
    assert "may be wrong by up to" in fair.sentence()
    assert fair.needed >= 1.05 * 9.0


def test_a_load_that_modes_left_out_answer_enters_the_estimate():
    """The load drives dofs that are not kept against each other: its response is worse than that between those kept."""
    modes, load = 3, np.zeros(N)
    load[[4, 6]] = 1.0, -1.0
    a, p = SHAPES[KEPT], SHAPES.T @ load
    parts = {"omega": np.sqrt(VALUES[:modes]), "mode_shapes": a[:, :modes], "static_compliance": (a / VALUES) @ a.T}
    parts["second_residual"] = (a[:, modes:] / VALUES[modes:] ** 2) @ a[:, modes:].T
    static, second = (a / VALUES) @ p, (a[:, modes:] / VALUES[modes:] ** 2) @ p[modes:]
    known = {
        "participation": p[None, :modes],
        "load_response": static[:, None],
        "second_load_response": second[:, None],
    }
    w = 0.3 * np.sqrt(VALUES[modes - 1])
    with_load, without = Truncation(**parts, **known), Truncation(**parts)
    exact = (a / (VALUES - w**2)) @ p
    short = (a[:, :modes] / (VALUES[:modes] - w**2)) @ p[:modes]
    short = short + static - (a[:, :modes] / VALUES[:modes]) @ p[:modes] + w**2 * second
    true = np.linalg.norm(exact - short) / np.linalg.norm(exact)
    assert float(without.error(w)) < 0.5 * true < true <= float(with_load.error(w)) < 50.0 * true
    assert float(with_load.error(w, w * (1.0 + 1e-12))) == pytest.approx(float(without.error(w)), rel=1e-9)
    del known["second_load_response"]
    assert float(Truncation(**parts, **known).error(w)) > float(with_load.error(w))
