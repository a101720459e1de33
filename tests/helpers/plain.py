"""A model of two nodes in plain matrices."""

import numpy as np

from slipstick.fem.materials import Material

STEEL = Material(young=2e11, poisson=0.3, density=7800.0)


def check(model, K, M):
    assert model.dofs == ("n4x", "n4y", "n4z", "n2x", "n2y", "n2z")
    np.testing.assert_allclose(model.K.toarray(), K, rtol=1e-14)
    np.testing.assert_allclose(model.M.toarray(), M, rtol=1e-14)
