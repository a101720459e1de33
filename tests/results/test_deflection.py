"""The recovered motion of the surface against the full finite element model under the same forces."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.blocks import block, branch, solved_whole

import slipstick as ss
from slipstick.fem.boundary import skin_of
from slipstick.results.deflection import deflection_of


def full_motion(made: ss.Branch, point: int) -> np.ndarray:
    """Coefficients (n_nodes, 3, L) of the skin nodes by direct solutions of the whole model."""
    nodes, _ = skin_of(block().model.mesh)
    return solved_whole(made, point)[nodes]


@pytest.mark.parametrize("parameter", [False, True])
def test_the_motion_is_that_of_the_full_model(parameter: bool) -> None:
    made = branch(parameter)
    found = deflection_of(made, small=1e-9)
    np.testing.assert_allclose(found.fields.T @ found.fields, np.eye(found.fields.shape[1]), atol=1e-10)
    for point in (0, len(made) // 2, len(made) - 1):
        exact = full_motion(made, point)
        np.testing.assert_allclose(found.at(point), exact, atol=2e-5 * np.abs(exact).max())


def test_few_fields_hold_nearly_all() -> None:
    made = branch()
    whole, few = deflection_of(made, small=1e-9), deflection_of(made, small=1e-3)
    assert few.fields.shape[1] < whole.fields.shape[1] <= 60
    size = max(np.abs(whole.at(p)).max() for p in range(len(made)))
    for point in range(0, len(made), 5):
        assert np.abs(few.at(point) - whole.at(point)).max() < 5e-3 * size


def test_it_is_stored_with_the_problem(tmp_path: pytest.TempPathFactory) -> None:
    made = branch()
    stored = ss.load(made.save(tmp_path / "r.nc"))
    np.testing.assert_allclose(deflection_of(stored).at(3), deflection_of(made).at(3), rtol=1e-12, atol=1e-15)


def test_structures_without_a_surface() -> None:
    from helpers.reports import branch as masses

    with pytest.raises(ss.InputError, match="has no surface to be seen"):
        deflection_of(masses())
    with pytest.raises(ss.InputError, match="the problem of this branch is not known"):
        deflection_of(ss.Branch.from_dataset(branch().dataset))
