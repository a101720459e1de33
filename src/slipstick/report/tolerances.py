"""What tolerances of parameters do to the curves of a page, and which of them matters most at the highest peak."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.sensitivity.tolerances import amplitude_band, ranked_bars
from slipstick.report.encoding import Indices, packed

if TYPE_CHECKING:
    from slipstick.branch import Branch


def bands_of(branch: Branch, kept: Indices, tolerances: Mapping[str, float]) -> dict[str, Any]:
    """Lower and upper amplitudes (point, dof) of the dofs that are kept, with the tolerances in words."""
    names = [str(name) for name in branch.table["dof"].to_numpy()]
    bands = [amplitude_band(branch, names[d], tolerances) for d in kept]
    said = ", ".join(f"{name} \N{PLUS-MINUS SIGN}{100.0 * share:g} %" for name, share in tolerances.items())
    return {
        "low": packed(np.array([band.low for band in bands]).T),
        "high": packed(np.array([band.high for band in bands]).T),
        "said": said,
    }


def what_matters(branch: Branch, kept: Indices, tolerances: Mapping[str, float]) -> list[list[str]]:
    """For each dof the change of its largest amplitude by each tolerance, the largest first, as rows of a table."""
    rows, names = [], [str(name) for name in branch.table["dof"].to_numpy()]
    for d in kept:
        size = branch.table["amplitude"].to_numpy()[:, d]
        bars = ranked_bars(branch, names[d], int(np.nanargmax(size)), tolerances)
        text = ", ".join(f"{bar.name}: {100.0 * bar.change / np.nanmax(size):+.2g} %" for bar in bars)
        rows.append([f"largest amplitude of {names[d]} with tolerances", text])
    return rows
