"""Elimination of linear constraints: exact in any order; those that leave a dof no motion are refused by name."""

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy.linalg import eigh, null_space

from slipstick.errors import InputError
from slipstick.structure.constraints import Dependent, Equation, eliminate


def rows(equations, size):
    A = np.zeros((len(equations), size))
    for row, equation in zip(A, equations, strict=True):
        np.add.at(row, list(equation.dofs), equation.coefficients)
    return A


def chain(size: int, order) -> list[Equation]:
    """Dof i follows i + 1 and i + 2."""
    return [Equation(dofs=(i, i + 1, i + 2), coefficients=(1.0, -0.5, -0.25), where=f"row {i}") for i in order]


@pytest.mark.parametrize("order", [range(8), reversed(range(8)), [3, 0, 6, 1, 7, 2, 5, 4]], ids=["down", "up", "mixed"])
def test_chains_in_any_order(order):
    equations = chain(10, list(order))
    found = eliminate(10, equations)
    T = found.T.toarray()
    assert found.independent.tolist() == [8, 9]
    assert np.abs(rows(equations, 10) @ T).max() < 1e-15
    np.testing.assert_array_equal(T[found.independent], np.eye(2))


@pytest.mark.parametrize("seed", range(5))
def test_the_motions_left_are_all_that_satisfy_the_equations(seed):
    """Against the null space of the same equations, with supports and with equations of every dependent."""
    random = np.random.default_rng(seed)
    equations = []
    for number in range(12):
        dofs = random.choice(30, size=4, replace=False)
        if number < 6:
            dofs[0] = number  # each another one, and none among the others below
            dofs[1:] = random.choice(np.arange(12, 30), size=3, replace=False)
        dependent = Dependent.FIRST if number < 6 else Dependent.ANY
        equations.append(
            Equation(dofs=tuple(dofs.tolist()), coefficients=tuple(random.normal(size=4)), dependent=dependent)
        )
    held = [29, 3]
    found = eliminate(30, equations, held)
    A = np.vstack([rows(equations, 30), np.eye(30)[held]])
    exact, T = null_space(A), found.T.toarray()
    assert T.shape[1] == exact.shape[1]
    assert np.abs(A @ T).max() < 1e-12 * np.abs(T).max()
    assert np.linalg.matrix_rank(np.hstack([exact, T])) == exact.shape[1]
    np.testing.assert_array_equal(np.sort(np.concatenate([found.independent, found.dependent, found.zero])), range(30))


def test_matrices_loads_and_motions():
    """Two masses joined by a lever: the frequency of one mass with what the lever adds."""
    K, M = np.diag([3.0, 0.0]), np.diag([1.0, 2.0])
    found = eliminate(2, [Equation(dofs=(1, 0), coefficients=(1.0, -2.0))])
    assert found.reduce(K).toarray() == [[3.0]]
    assert found.reduce(M).toarray() == [[9.0]]
    assert eigh(found.reduce(K).toarray(), found.reduce(M).toarray(), eigvals_only=True) == pytest.approx([1 / 3])
    np.testing.assert_array_equal(found.forces(np.array([1.0, 5.0])), [11.0])
    np.testing.assert_array_equal(found.motion(np.array([0.5])), [0.5, 1.0])


def test_said_twice_is_said_once():
    equation = Equation(dofs=(0, 1), coefficients=(1.0, -1.0), where="line 3")
    found = eliminate(3, [equation, equation])
    assert found.idle == {"line 3": 1}
    assert found.T.toarray().tolist() == [[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]


def test_an_equation_between_held_dofs_says_nothing():
    assert eliminate(2, [Equation(dofs=(0, 1), coefficients=(1.0, -1.0))], held=[0, 1]).T.shape == (2, 0)


def test_a_held_first_dof_holds_the_others_together():
    """0 = u1 - 2 u2: exact, whatever the order of supports and equations."""
    found = eliminate(3, [Equation(dofs=(0, 1, 2), coefficients=(1.0, -1.0, 2.0))], held=[0])
    np.testing.assert_allclose(found.T.toarray(), [[0.0], [1.0], [0.5]])


def test_ties_yield_to_supports_and_to_other_equations():
    tie = [Equation(dofs=(i, 2), coefficients=(1.0, -1.0), where="tie", dependent=Dependent.YIELDING) for i in (0, 1)]
    firm = Equation(dofs=(1, 2), coefficients=(1.0, -3.0))
    found = eliminate(3, [*tie, firm], held=[0])
    np.testing.assert_array_equal(found.T.toarray(), [[0.0], [3.0], [1.0]])
    assert found.idle == {"tie": 2}


def test_two_ties_onto_each_other_are_one():
    pair = [
        Equation(dofs=d, coefficients=(1.0, -1.0), where="t", dependent=Dependent.YIELDING) for d in ((0, 1), (1, 0))
    ]
    assert eliminate(2, pair).T.toarray().tolist() == [[1.0], [1.0]]


def test_a_dof_of_two_equations_makes_another_one_dependent():
    """u0 = u1 and u0 = 2 u2."""
    equations = [Equation(dofs=(0, i), coefficients=(1.0, -i), where=f"line {i}") for i in (1, 2)]
    found = eliminate(3, equations)
    assert np.abs(rows(equations, 3) @ found.T.toarray()).max() < 1e-15
    assert found.T.shape == (3, 1)
    assert not found.idle


@pytest.mark.parametrize("seed", range(6))
def test_first_dofs_may_be_the_same_and_in_rings(seed):
    """Against the null space, in any order, also with equations that others say already."""
    random = np.random.default_rng(seed)
    said = [
        (tuple(random.choice(8, size=4, replace=False).tolist()), tuple(random.normal(size=4).tolist()))
        for _ in range(5)
    ]
    said += [(a + b, x + tuple(2.0 * v for v in y)) for (a, x), (b, y) in zip(said[:2], said[2:4], strict=True)]
    equations = [Equation(dofs=dofs, coefficients=values, where=f"line {i}") for i, (dofs, values) in enumerate(said)]
    found = eliminate(8, [equations[i] for i in random.permutation(7)])
    T, exact = found.T.toarray(), null_space(rows(equations, 8))
    assert T.shape[1] == exact.shape[1] == 3
    assert np.linalg.matrix_rank(np.hstack([exact, T]), tol=1e-9) == 3
    assert np.abs(rows(equations, 8) @ T).max() < 1e-13 * np.abs(T).max()
    assert sum(found.idle.values()) == 2


def test_what_is_said_again_with_rounding_is_no_motion_less():
    """Two rigid bars through the same twenty points of ten digits: the bars are one."""
    x = np.random.default_rng(0).normal(size=20)
    equations = [
        Equation(dofs=(4 + i, 2 * bar, 2 * bar + 1), coefficients=(1.0, -1.0, -round(place, 10 + 5 * bar)))
        for bar in (0, 1)
        for i, place in enumerate(x.tolist())
    ]
    found = eliminate(24, equations)
    assert found.T.shape[1] == 2
    assert np.abs(rows(equations, 24) @ found.T.toarray()).max() < 1e-8


@pytest.mark.parametrize("length", [2, 3, 6])
def test_a_ring_that_leaves_no_motion_is_refused_with_all_its_lines(length):
    ring = [
        Equation(dofs=(i, (i + 1) % length), coefficients=(1.0, -0.5), where=f"line {i + 1}") for i in range(length)
    ]
    with pytest.raises(InputError, match=rf"line {length}: leaves n\d no motion, although nothing holds it") as caught:
        eliminate(length, ring, name="n{}".format)
    assert all(f"line {i + 1}" in str(caught.value) for i in range(length))
    assert eliminate(length, ring, held=[0]).zero.tolist() == [*range(length)]


def test_equations_too_many_to_be_solved_together_are_refused(monkeypatch):
    monkeypatch.setattr("slipstick.structure.constraints._LARGEST", 3)
    equations = [Equation(dofs=(0, i), coefficients=(1.0, -1.0), where=f"line {i}") for i in (1, 2, 3)]
    with raises_fault("line 2", says="and others are 2 equations between 3 dofs"):
        eliminate(4, equations)


@pytest.mark.parametrize(
    ("equation", "said"),
    [
        (Equation(dofs=(0, 5), coefficients=(1.0, 1.0), where="a"), "a: there is no dof 5; it is one of 0 to 2"),
        (Equation(dofs=(0, 1), coefficients=(1.0,), where="a"), "a: found 2 dofs and 1 coefficients"),
        (Equation(dofs=(), coefficients=(), where="a"), "found 0 dofs"),
        (Equation(dofs=(0, 1), coefficients=(1.0, np.nan), where="a"), "a: a coefficient is not finite"),
        ("u0 = u1", "expected an Equation"),
    ],
)
def test_wrong_equations(equation, said):
    with pytest.raises(InputError, match=said):
        eliminate(3, [equation])


def test_a_held_dof_that_is_not_there():
    with raises_fault("held", statement="there is no dof 7"):
        eliminate(3, [], held=[7])


def test_an_equation_of_zeros_says_nothing():
    assert eliminate(2, [Equation(dofs=(0, 1), coefficients=(0.0, 0.0), where="zero")]).idle == {"zero": 1}


@pytest.mark.parametrize("cofactors", [(0.0, 1.0), (1.0, -1.0)])
def test_a_first_dof_without_coefficient_is_refused(cofactors):
    dofs = (0, 1) if cofactors[0] == 0.0 else (0, 0, 1)
    equation = Equation(dofs=dofs, coefficients=(*cofactors, 2.0)[: len(dofs)], where="line 3")
    with raises_fault("line 3", says="makes .* dependent with the coefficient 0"):
        eliminate(2, [equation])
