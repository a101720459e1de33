"""What users ask of stability."""

import subprocess
import sys

import pytest
from helpers.faults import raises_fault

from slipstick.analysis.curve.follow import stability_request


@pytest.mark.parametrize("given", [True, False, "full"])
def test_what_can_be_asked_for(given: object) -> None:
    assert stability_request(given) is given


@pytest.mark.parametrize("given", [None, 1, 0, "half", "", ["full"]])
def test_anything_else_is_told(given: object) -> None:
    with raises_fault("stability", expected='True, False, or "full" (all modes in motion)'):
        stability_request(given)


def test_a_response_loads_nothing_that_judges_stability() -> None:
    code = (
        "import sys; import slipstick.analysis.curve.response; print(*(n for n in sys.modules if '.stability.' in n))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.split() == []
