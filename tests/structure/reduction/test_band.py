"""The accuracy asked of a reduction holds everywhere in its band, between directions and from loads, against all modes
of the full model by LAPACK."""

import numpy as np
import pytest
from scipy.linalg import eigh

from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.model import elastic_model
from slipstick.structure.receptance_size import CANCELLED, UNREACHED, ReceptanceSize, band
from slipstick.structure.reduction.band import band_error
from slipstick.structure.reduction.reduce import reduce_model

STEEL = Material(young=2e11, poisson=0.3, density=8000.0)
CASES = {
    # seed, size, divisions, directions kept, accuracy, mode below the top, top over that mode
    "many": (13, (0.25, 0.06, 0.03), (4, 2, 2), 24, 1e-3, 9, 1.03),
    "few": (3, (0.20, 0.03, 0.02), (5, 1, 1), 2, 1e-4, 6, 1.20),
    "one": (6, (0.20, 0.05, 0.03), (4, 1, 1), 1, 1e-4, 8, 1.03),
    "low": (5, (0.15, 0.06, 0.02), (4, 2, 1), 9, 1e-5, 1, 1.25),
    "dense": (8, (0.12, 0.08, 0.04), (3, 2, 1), 24, 1e-3, 11, 1.03),
}


def case(seed, size, divisions, n_keep, accuracy, mode, share):
    """Full model with a uniform load and a point load; worst error over accuracy of each (directions, loads)."""
    rng = np.random.default_rng(seed)
    model = elastic_model(box(size, divisions, "hex20"), STEEL, "x0")
    n = model.K.shape[0]
    values, shapes = eigh(model.K.toarray(), model.M.toarray())
    keep = list(rng.choice(model.dofs, n_keep, replace=False))
    uniform, point = np.zeros(n), np.zeros(n)
    uniform[1::3], point[int(rng.integers(n))] = 1.0, 1.0
    top = np.sqrt(values[mode]) * share
    made = reduce_model(
        model.K, model.M, dofs=model.dofs, keep=keep, load_shapes={"uniform": uniform, "point": point},
        accuracy=accuracy, frequency_range=(0.0, top),
    )  # fmt: skip
    grid = np.linspace(0.0, top, 702)[1:]
    natural = np.sqrt(values)
    grid = grid[np.abs(grid[:, None] / natural - 1.0).min(axis=1) > 2e-3]  # there rounding of frequencies shows
    a = shapes[[model.dofs.index(name) for name in keep]]
    p = np.column_stack([shapes.T @ uniform, shapes.T @ point])
    c = 1.0 / (values - grid[:, None] ** 2)
    exact = np.concatenate(
        [np.einsum("ir,gr,jr->gij", a, c, a, optimize=True), np.einsum("ir,gr,rk->gik", a, c, p, optimize=True)], axis=2
    )
    eye = np.eye(n_keep)
    found = made.structure.project(eye, eye, ["uniform", "point"]).at([1], grid)[0][:, 0]
    whole = np.abs(c)[:, None] * np.abs(np.vstack([np.ones_like(values), p.T]))
    between = [np.linalg.norm((a * w) @ a.T) for w in whole[:, 0]]
    worst = []
    for column in (slice(0, n_keep), slice(n_keep, n_keep + 1), slice(n_keep + 1, None)):
        k = max(column.start - n_keep + 1, 0)
        error = np.linalg.norm((found - exact)[:, :, column], axis=(1, 2))
        size = np.linalg.norm(exact[:, :, column], axis=(1, 2))
        if k:
            apart = np.sqrt(np.einsum("gr,rs,gs->g", whole[:, k], np.abs(a.T @ a), whole[:, k], optimize=True))
            reach = UNREACHED * np.sqrt(between * (np.abs(c) @ p[:, k - 1] ** 2))
            size = np.maximum(size, reach)
        else:
            apart = np.array(between)
        worst.append(float(np.max(error / np.maximum(size, CANCELLED * apart)) / accuracy))
    return worst, made


@pytest.mark.filterwarnings("ignore:the receptance of the reduced")  # an accuracy above 1e-4 is warned of
@pytest.mark.parametrize("name", CASES)
def test_the_accuracy_holds_everywhere_in_the_band_loads_included(name):
    worst, made = case(*CASES[name])
    assert max(worst) <= 1.0, worst
    assert made.error_estimate / CASES[name][4] >= 0.9 * max(worst)


def test_what_cancels_at_the_top_is_still_bounded_below_it():
    """Two modes left out move one dof; a load drives them so that its error at the top is zero, and not below it."""
    omega, left, top, n_keep = np.array([1.0, 3.0]), np.array([4.0, 6.0]), 2.0, 1
    t = top**4 / (left**2 - top**2)
    kept, p = np.array([[1.0, 0.5]]), np.array([t[1], -t[0]])
    shapes, loads = np.array([[1.0, 1.0]]) * left**2, p * left**2
    both = np.vstack([shapes, loads]) / left**2
    missing = (both * t) @ both.T
    assert missing[0, 1] == pytest.approx(0.0, abs=1e-12)
    residual, load_residual = (shapes / left**2) @ shapes.T, (shapes / left**2) @ loads[:, None]
    size = ReceptanceSize(omega, kept, residual, np.array([[1.0, 1.0]]), load_residual)
    second = both @ both.T
    found = band_error(size, omega, n_keep, top=top, missing=missing, second=second)
    w = band(omega, 0.0, top)
    true = np.abs((both[0] * both[1]) @ (w**4 / (left[:, None] ** 2 - w**2)))
    assert found >= np.max(true / size.at(w)[:, 1]) > 0.0


def test_modes_that_end_below_the_top_say_nothing():
    size = ReceptanceSize(np.array([1.0]), np.ones((1, 1)), np.ones((1, 1)), np.zeros((0, 1)), np.zeros((1, 0)))
    assert band_error(size, np.array([1.0]), 1, top=2.0, missing=np.ones((1, 1)), second=np.ones((1, 1))) == np.inf
