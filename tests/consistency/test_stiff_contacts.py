"""Contacts up to 1e8 times as stiff as the structure: whole curves, residuals without rounding, the rigid limit."""

import numpy as np
import pytest
from helpers.oscillator import damper, one_mass
from helpers.results import corrected

import slipstick as ss

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")  # on purpose

STIFFNESS = 40.0


def oscillator(ratio, velocity=0.0):
    return one_mass(damper(velocity, kt=ratio * STIFFNESS), force=400.0, harmonics=range(11))


def opening(ratio):
    """The same with a normal direction of the structure's own stiffness."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=[[40.0, -10.0], [-10.0, 60.0]], dofs=["x", "y"])
    contact = ss.FrictionContact(kt=ratio * STIFFNESS, mu=0.3, kn=40.0, gap=-8.0)
    pair = ss.ContactPair(name="damper", contact=contact, tangential="x", normal="y")
    return ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=400.0)], harmonics=range(6))


BETWEEN = [pytest.param(power, marks=pytest.mark.verify) for power in (-2, -1, 1, 2, 4, 5, 7)]


@pytest.mark.parametrize("velocity", [0.0, 10.0])
@pytest.mark.parametrize("power", [-3, 0, 3, 6, 8, *BETWEEN])
def test_the_whole_range_without_rounding_in_the_residual(power, velocity):
    branch = ss.forced_response(oscillator(10.0**power, velocity), omega=(2.0, 15.0))
    assert branch.outcome.ok, branch.dataset.attrs["outcome_text"]
    assert float(corrected(branch.dataset).residual.max()) < 1e-8
    assert len(branch) < 350


@pytest.mark.parametrize("power", [0, 4, 8])
def test_stiff_contacts_that_open(power):
    branch = ss.forced_response(opening(10.0**power), omega=(5.0, 9.0))
    assert branch.outcome.ok, branch.dataset.attrs["outcome_text"]
    assert float(corrected(branch.dataset).residual.max()) < 1e-8


def test_peaks_tend_to_the_rigid_limit_as_one_over_the_root_of_the_stiffness():
    tops = [
        max(amplitude for _, amplitude in ss.forced_response(oscillator(10.0**power), omega=(5.0, 8.0)).peaks("x"))
        for power in range(4, 9)
    ]
    steps = np.diff(tops)
    assert np.all(steps > 0)
    np.testing.assert_allclose(steps[:-1] / steps[1:], np.sqrt(10.0), rtol=0.05)
