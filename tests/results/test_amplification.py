"""The scatter of mistuned discs."""

from __future__ import annotations

import numpy as np
import xarray

from slipstick.results.amplification import largest_alone


def test_the_largest_of_all_outputs_is_no_rotation() -> None:
    study = xarray.Dataset(
        {
            "peak_amplitude": (("case", "dof"), [[0.2, np.nan]]),
            "peak_omega": (("case", "dof"), [[5.0, np.nan]]),
            "largest_amplitude": ("case", [0.2]),
        },
        coords={"case": [0], "dof": ["n1x", "n1rx"]},
    )
    curves = xarray.Dataset(
        {"amplitude": (("point", "dof"), [[0.1, 7.0], [0.2, 9.0]])}, coords={"dof": ["n1x", "n1rx"]}
    )
    one, drawn = largest_alone(study, curves)
    assert one["dof"].to_numpy().tolist() == drawn["dof"].to_numpy().tolist() == ["largest"]
    assert drawn["amplitude"].to_numpy().tolist() == [[0.1], [0.2]]
    assert one["peak_omega"].to_numpy().tolist() == [[5.0]]
