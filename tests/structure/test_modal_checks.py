"""Modal arrays that are complex, and residuals that no modes can leave."""

from typing import Any

import numpy as np
import pytest

import slipstick as ss
from slipstick.structure.modal import LoadShape
from slipstick.structure.modal_checks import modal_number_faults, residual_faults

SHAPE = LoadShape(participation=[1.0], static_response=[1.0, 2.0])


def test_real_arrays_have_no_faults_and_each_complex_one_has_one():
    good = {"omega": [1.0], "mode_shapes": [[1.0], [2.0]], "second_residual": None}
    assert modal_number_faults(good, {"wind": SHAPE}) == []
    assert len(modal_number_faults(good | {"omega": [1j], "mode_shapes": [[1j], [2.0]]}, {"wind": SHAPE})) == 2
    (fault,) = modal_number_faults({}, {"wind": [1.0]})
    assert "expected a structure.modal.LoadShape" in str(fault)


def test_a_residual_is_a_sum_of_squares():
    a = np.random.default_rng(0).normal(size=(4, 2))
    square = a @ a.T
    assert residual_faults("R", square, square.diagonal()) == []
    assert residual_faults("R", square - 1e-6 * np.diag(square.diagonal()), square.diagonal()) == []
    (fault,) = residual_faults("R", -square, square.diagonal())
    assert "modes only add compliance" in str(fault)


@pytest.mark.parametrize("dofs", [3, ["x", "x"], []])
def test_wrong_names_hide_no_other_fault(dofs: Any) -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.ModalStructure(
            omega=[-1.0, 2.0], mode_shapes=[[1.0, np.nan], [0.0, 1.0]], static_compliance=np.eye(2), dofs=dofs
        )
    first, *others = caught.value.sentences
    assert first.startswith("dofs: ")
    assert [s.split(":")[0] for s in others] == ["omega", "mode_shapes"]


def test_an_array_of_texts_hides_no_other_fault() -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.ModalStructure(
            omega=["a", "b"], mode_shapes=np.ones((2, 3)), static_compliance=[[1.0, 2.0], [0.0, 1.0]], dofs=["x", "y"],
            loss_factor=-0.1,
        )  # fmt: skip
    assert sorted(s.split(":")[0] for s in caught.value.sentences) == ["loss_factor", "omega", "static_compliance"]
