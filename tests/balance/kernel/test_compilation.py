"""What is compiled before the first run is all that it needs."""

import pytest
from helpers.problems import random_problem

import slipstick as ss
from slipstick.balance.kernel.compilation import compile_all
from slipstick.balance.kernel.sums import (
    add_force_changes,
    add_products,
    compliance_times,
    residual_with_slope,
    residuals_of_many,
)
from slipstick.contact.kernel.batch import run_elements
from slipstick.structure.kernel.modal_sums import modal_sums
from slipstick.verify.cases import oscillator


@pytest.mark.parametrize("problem", [oscillator(velocity=10.0), random_problem(0)], ids=["one port", "many"])
def test_a_curve_needs_no_other_versions(problem: ss.Problem) -> None:
    """A view of the unknowns, or one that is not contiguous, would compile everything again."""
    assert compile_all() > 0.0
    functions = (
        run_elements, modal_sums, compliance_times, residual_with_slope, residuals_of_many, add_products,
        add_force_changes,
    )  # fmt: skip
    before = [len(function.signatures) for function in functions]
    ss.forced_response(problem, omega=(6.0, 7.0))
    assert [len(function.signatures) for function in functions] == before
