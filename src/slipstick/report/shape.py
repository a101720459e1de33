"""The deflected shape for a page: the skin of the body, and the few fields that its motion is made of."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.report.encoding import fixed, packed
from slipstick.results.deflection import deflection_of

if TYPE_CHECKING:
    from slipstick.branch import Branch

UNSEEN = 1e-3
"""Relative to the largest motion: less is not seen."""


def shape_of(branch: Branch) -> dict[str, Any] | None:
    """Nodes, triangles, fields and their coefficients at every point; None where nothing is known of the surface."""
    structure = getattr(branch.problem, "structure", None)
    if getattr(structure, "skin", None) is None or not len(branch):
        return None
    deflection = deflection_of(branch, small=UNSEEN)
    size = float(np.abs(deflection.fields).max()) or 1.0
    return {
        "nodes": packed(deflection.skin.nodes, "f4"),
        "triangles": packed(deflection.skin.triangles, "u2"),
        "fields": packed(deflection.fields.T / size, "f4"),
        "coefficients": fixed(deflection.coefficients * size, 3),
    }
