"""Names of nodes, degrees of freedom and directions."""

import numpy as np

from slipstick.fem.dof_names import directions_in, names_dofs, rows_named

NODES, COMPONENTS = np.array([3, 3, 12, 12]), np.array([0, 4, 0, 6])


def test_names():
    assert directions_in("xyz") == {"x", "y", "z"}
    assert directions_in("x, ry") == {"x", "ry"}
    assert [names_dofs(name) for name in ("n12", "n12s", "n12xx", "N12", "12")] == [True, True, False, False, False]
    assert rows_named("n12", NODES, COMPONENTS).tolist() == [False, False, True, True]
    assert rows_named("n3ry", NODES, COMPONENTS).tolist() == [False, True, False, False]
    assert not rows_named("n3z", NODES, COMPONENTS).any()
