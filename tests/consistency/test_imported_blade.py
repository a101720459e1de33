"""A blade nobody here made, from another code's archive to a rubbing response curve."""

import numpy as np
import pytest
from helpers.ansys import BLADE, needs_blade

import slipstick as ss
from slipstick.errors import SlipstickWarning

ROOT = ["FIRTREE1", "FIRTREE2", "FIRTREE3", "FIRTREE4"]


@pytest.mark.verify
@needs_blade
def test_turbine_blade_rubs_at_its_tip():
    """Fir tree fixed, pressure side loaded, four contacts on the tip rubbing along x; inch, lbf, s."""
    pytest.importorskip("mapdl_archive")
    with pytest.warns(SlipstickWarning, match="stiff in bending"):
        model = ss.import_model(BLADE, fixed=ROOT)
    tip = {"direction": [0.0, 1.0, 0.0], "depth": 0.02}
    blade = ss.reduced_body(model, surface=tip, contacts=4, pressure="PRESSURE_SURF", modes=20, loss_factor=0.002)
    contacts = ss.surface_contacts(
        blade,
        "tip",
        direction=[1.0, 0.0, 0.0],
        contact=ss.FrictionContact(kt=2e5, mu=0.3, normal_load=5.0),  # lbf each
        rubbing=ss.RubbingMotion(velocity=100.0),
    )
    first = blade.structure.natural_frequencies[0]
    assert 2000.0 < first / (2 * np.pi) < 3000.0
    problem = ss.Problem(
        blade.structure, contacts=contacts, loads=[ss.Load(shape="pressure", cos=0.1)], harmonics=ss.Harmonics(range(4))
    )
    branch = ss.forced_response(problem, omega=(0.8 * first, 1.3 * first))
    assert branch.outcome.ok
    assert float(branch.dataset.dissipated_power.min()) >= 0.0
    assert float(branch.dataset.amplitude.max()) > 0.0
