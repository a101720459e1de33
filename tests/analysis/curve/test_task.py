"""Options of a response curve: its own defaults, any of them changed."""

from slipstick.analysis.curve.task import response_options
from slipstick.solve.continuation import ContinuationOptions


def test_defaults_make_smooth_figures_and_any_can_be_changed():
    own = response_options()
    assert own.max_step == 1 / 30
    assert own.output_step == 1 / 120
    assert own.first_step <= own.max_step
    for name in ("max_step", "first_step", "event_tolerance", "output_step", "output_tolerance"):
        assert getattr(response_options(**{name: 1e-4}), name) == 1e-4
    assert isinstance(own, ContinuationOptions)
