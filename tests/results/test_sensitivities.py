from __future__ import annotations

import slipstick as ss
from slipstick.verify.cases import oscillator


def test_labels_say_what_and_in_which_units():
    from dataclasses import replace

    problem = replace(oscillator(velocity=100.0), units={"length": "mm", "force": "N", "time": "s"})
    branch = ss.forced_response(problem, omega=(6.0, 6.3))
    found = branch.sensitivity(["damper.kt", "load.x.phase"], "x")
    assert dict(found.sizes) == {"parameter": 2, "point": len(branch), "peak": 1}
    assert found.units.values.tolist() == ["N/mm", "rad"]
    assert (found.amplitude.attrs["of"], found.dissipated_power.attrs["of"]) == ("mm", "N mm/s")
    assert found.peak_omega.attrs["of"] == "rad/s"
    assert branch.dataset.kind[int(found.peak[0])] == "peak"
    assert float(found["at"][0]) == 6.0
    assert found.attrs == {"dof": "x", "followed": "omega"}
