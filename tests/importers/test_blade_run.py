"""A blade nobody here made, from another code's archive to a rubbing response curve."""

from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.importers.import_model import ImportOptions, import_model, load_model

BLADE = Path(__file__).parents[3] / "shared" / "data" / "turbine_blade" / "blade.cdb"
ROOT = ["FIRTREE1", "FIRTREE2", "FIRTREE3", "FIRTREE4"]


@pytest.mark.verify
@pytest.mark.skipif(not BLADE.is_file(), reason="the turbine blade is not beside this checkout")
def test_turbine_blade_rubs_at_its_tip(tmp_path):
    """Fir tree fixed, pressure side loaded, four contacts on the tip rubbing along x; inch, lbf, s."""
    from slipstick.fem.boundary import surface_towards
    from slipstick.models.surface_model import cosines, of_import, with_contacts
    from slipstick.structure.reduction import reduce_model

    pytest.importorskip("mapdl_archive")
    import_model(BLADE, tmp_path / "blade.h5", ImportOptions(fixed=ROOT), quiet=True)
    model = of_import(load_model(tmp_path / "blade.h5", quiet=True))
    tip = surface_towards(model.mesh, [0.0, 1.0, 0.0], depth=0.02)
    whole = with_contacts(model, surface=tip, contacts=4, pressures={"pressure": "PRESSURE_SURF"})
    np.testing.assert_allclose(whole.patches.normals[:, 1], 1.0, atol=0.05)
    reduced = reduce_model(model.K, model.M, modes=8, loss_factor=0.002, **whole.request).structure
    first = reduced.natural_frequencies[0]
    assert 2000.0 < first / (2 * np.pi) < 3000.0
    contact = ss.FrictionContact(kt=2e5, mu=0.3, gap=-5.0)  # 5 lbf each
    directions = cosines(whole.patches.tangents([1.0, 0.0, 0.0]))
    pairs = [
        ss.ContactPair(name=name, contact=contact, tangential=along, rubbing=ss.RubbingMotion(velocity=100.0))
        for name, along in zip(whole.contacts, directions, strict=True)
    ]
    problem = ss.Problem(
        reduced, contacts=pairs, loads=[ss.Load(shape="pressure", cos=0.1)], harmonics=ss.Harmonics(range(4))
    )
    branch = ss.forced_response(problem, omega=(0.8 * first, 1.3 * first))
    assert branch.outcome.ok
    assert float(branch.dataset.dissipated_power.min()) >= 0.0
    assert float(branch.dataset.amplitude.max()) > 0.0
