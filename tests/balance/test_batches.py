"""Elements of one kind of law are together, whoever they belong to; their ports stand in order."""

import numpy as np
from helpers.problems import random_problem

import slipstick as ss
from slipstick.balance.layout import batches_of, places


def cubic(name, dof):
    law = ss.SampledLaw(force=lambda x, velocity, k: k * x**3, parameters={"k": 1.0}, ports=("x",))
    return ss.ContactPair(name=name, contact=law, ports={"x": dof})


def friction(name, *dofs, normal=None):
    law = ss.FrictionContact(kt=np.ones(len(dofs)), mu=0.3, normal_load=1.0)
    return ss.ContactPair(name=name, contact=law, tangential=list(dofs), normal=normal)


def test_laws_are_gathered_and_every_port_has_its_row():
    pairs = [friction("a", "x", "y"), cubic("b", "x"), friction("c", "z", normal="w")]
    batches, directions = batches_of(pairs)
    assert [batch.members for batch in batches] == [((0, 0), (0, 1), (2, 0)), ((1, 0),)]
    assert [batch.numbers for batch in batches] == [(0, 1, 3), (2,)]
    seen = []
    for batch in batches:
        for i, port in enumerate(batch.ports):
            rows = np.arange(len(directions))[port.rows]
            members = np.arange(batch.count)[port.members]
            assert len(rows) == len(members) == port.size
            for row, e in zip(rows, members, strict=True):
                p, k = batch.members[e]
                assert directions[row] == pairs[p].direction(batch.law.ports[i], k)
            seen += rows.tolist()
    assert seen == list(range(len(directions)))
    np.testing.assert_array_equal(np.arange(4)[batches[0].elements], [0, 1, 3])


def test_couplings_name_the_elements_with_both_ports():
    """Of three contacts one has a normal."""
    (batch,), _ = batches_of([friction("a", "x", "y"), friction("c", "z", normal="w")])
    found = {pair: [own.tolist() for own in coupling] for pair, coupling in batch.couplings.items()}
    assert found == {
        (0, 0): [[0, 1, 2], [0, 1, 2], [0, 1, 2]], (0, 1): [[2], [2], [3]],
        (1, 0): [[2], [3], [2]], (1, 1): [[2], [3], [3]],
    }  # fmt: skip


def test_neighbours_are_a_slice():
    assert places(np.array([3, 4, 5])) == slice(3, 6)
    assert places(np.array([], dtype=int)) == slice(0, 0)
    np.testing.assert_array_equal(places(np.array([1, 3])), [1, 3])
    assert len(random_problem(0).batches) == 1
