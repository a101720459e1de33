"""The deflected shape in a page."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.blocks import branch
from helpers.reports import branch as masses
from helpers.reports import decoded, decoded_coefficients

from slipstick.report.content import shape_of
from slipstick.results.deflection import deflection_of


def test_fields_and_coefficients_make_the_motion() -> None:
    made = branch()
    found, whole = shape_of(made), deflection_of(made)
    assert found is not None
    assert decoded(found["nodes"]) == pytest.approx(whole.skin.nodes)
    assert (decoded(found["triangles"]) == whole.skin.triangles).all()
    fields, coefficients = decoded(found["fields"]), decoded_coefficients(found["coefficients"])
    size = max(np.abs(whole.at(p)).max() for p in range(len(made)))
    for point in range(0, len(made), 5):
        motion = (fields.T @ coefficients[point]).reshape(-1, 3, made.harmonics.size)
        assert np.abs(motion - whole.at(point)).max() < 5e-3 * size


def test_nothing_where_no_surface_is_known() -> None:
    assert shape_of(masses()) is None
    made = branch()
    assert shape_of(type(made)(made.dataset, made.outcome)) is None
