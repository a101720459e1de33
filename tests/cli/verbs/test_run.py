"""What ``run`` tells at its end."""

from __future__ import annotations

import re

import numpy as np
from helpers.reports import branch

from slipstick.cli.verbs.run import peak_lines
from slipstick.results.peaks import peak_points


def test_peaks_are_told_the_largest_first() -> None:
    made = branch().dataset
    at = peak_points(branch().table)
    dofs = made["peak_dof"].to_numpy()[at]
    truth = sorted(
        ((float(made["amplitude"][p, d]), "abz"[d], float(made["omega"][p])) for p, d in zip(at, dofs, strict=True)),
        reverse=True,
    )
    text = "\n".join(peak_lines(branch().table, most=2 * len(truth)))
    found = re.findall(r"peak of (\w+): amplitude ([\d.e+-]+).* at ([\d.e+-]+)", text)
    assert [(dof, f"{size:.6g}") for size, dof, _ in truth] == [(dof, size) for dof, size, _ in found]
    np.testing.assert_allclose([float(where) for *_, where in found], [where for *_, where in truth], rtol=1e-4)
