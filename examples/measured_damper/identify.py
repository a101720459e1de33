"""What are kt and mu of a damper? Found from a stepped sine test at three levels, with 1 % noise.

The test is made by a damper that is known, so that what is found can be held against it: kt 100, mu 0.3, a structure of
damping 0.4. Its normal load of 800 is constant: mu and the load act as one, and the load is taken as known.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

import slipstick as ss

LEVELS = [50.0, 100.0, 200.0]
FREQUENCIES = np.linspace(6.0, 13.0, 15)


def problem(kt: float = 100.0, mu: float = 0.3) -> ss.Problem:
    """The oscillator on its damper."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    contact = ss.FrictionContact(kt=kt, mu=mu, normal_load=800.0)
    damper = ss.ContactPair(name="damper", contact=contact, tangential="x")
    return ss.Problem(structure, contacts=damper, loads=ss.Load(dof="x", sin=100.0), harmonics=range(6))


def rig(seed: int = 0) -> xr.Dataset:
    """Complex amplitudes of the first harmonic, as an analyser gives them, over load and frequency."""
    rng, rows = np.random.default_rng(seed), []
    for level in LEVELS:
        branch = ss.steady_response(problem().with_parameter("load.x.amplitude", level), omega=FREQUENCIES)
        c, s = branch.dataset.displacement.values[:, 0, 1:3].T
        z = c - 1j * s  # x = Re(z exp(i omega t))
        size = 0.01 * np.sqrt(np.mean(np.abs(z) ** 2) / 2.0)
        rows.append(z + size * (rng.standard_normal(z.size) + 1j * rng.standard_normal(z.size)))
    return xr.Dataset(
        {"displacement": (("load.x.amplitude", "omega", "dof"), np.array(rows)[..., None])},
        coords={"load.x.amplitude": LEVELS, "omega": FREQUENCIES, "dof": ["x"]},
    )


def compute():
    """From values that are far off."""
    return ss.identify(problem(), rig(), {"damper.kt": 60.0, "damper.mu": 0.5, "damping": 1.5})


if __name__ == "__main__":
    print(compute().summary())
