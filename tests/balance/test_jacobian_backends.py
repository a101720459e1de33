"""Another kind of Jacobian through whole curves: nothing but the place that makes it knows which one it is."""

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy import sparse
from scipy.sparse.linalg import splu

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.jacobian_backends import BACKENDS, DenseBackend, backend_of
from slipstick.balance.start import FirstPoint
from slipstick.errors import InputError
from slipstick.solve.linear import dense
from slipstick.solve.linear.jacobian import Jacobian


class SparseJacobian(Jacobian):
    singular = False

    """Sparse LU."""

    def __init__(self, matrix):
        self.matrix = sparse.csc_array(matrix)
        try:
            self._lu = splu(self.matrix)
        except RuntimeError:
            self.singular = True

    @property
    def size(self):
        return self.matrix.shape[0]

    def multiply(self, x, *, transposed=False):
        return (self.matrix.T if transposed else self.matrix) @ x

    def solve(self, right, *, transposed=False):
        return self._lu.solve(right, "T" if transposed else "N")

    def sign(self):
        parity = np.prod([permutation_sign(p) for p in (self._lu.perm_r, self._lu.perm_c)])
        return int(parity * np.prod(np.sign(self._lu.U.diagonal())))

    def bound(self, x):
        return abs(self.matrix) @ np.abs(x)

    def bordered(self, column, row):
        return SparseJacobian(sparse.block_array([[self.matrix, column[:, None]], [row[None, :-1], row[None, -1:]]]))


def permutation_sign(p):
    seen, sign = np.zeros(len(p), dtype=bool), 1
    for start in range(len(p)):
        length, at = 0, start
        while not seen[at]:
            seen[at], at, length = True, p[at], length + 1
        sign *= -1 if length and length % 2 == 0 else 1
    return sign


class SparseKind(DenseBackend):
    name = "sparse"

    def jacobian(self, *arguments):
        return SparseJacobian(BACKENDS["dense"].jacobian(*arguments).matrix)


sparse_kind = SparseKind()


def problem(heated=False, undamped=False):
    structure = ss.MatrixStructure(
        M=np.eye(3),
        C=np.zeros((3, 3)) if undamped else 0.3 * np.eye(3),
        K=[[60.0, -20.0, 0.0], [-20.0, 60.0, -20.0], [0.0, -20.0, 60.0]],
        dofs=["a", "b", "n"],
    )
    held = ss.FrictionContact(kt=80.0, mu=0.3, kn=1.0, gap=-100.0)
    lifting = ss.FrictionContact(kt=50.0, mu=0.4, kn=90.0, gap=-0.5)
    contacts = [
        ss.ContactPair(name="held", contact=held, tangential="a", rubbing=ss.RubbingMotion(velocity=5.0)),
        ss.ContactPair(name="lifting", contact=lifting, tangential="b", normal="n"),
    ]
    thermal = None
    if heated:
        curve = ss.FrictionCurve(mu=[(20.0, 0.4), (100.0, 0.3), (400.0, 0.25)])
        thermal = ss.ThermalModel(curve={"held": curve}, background=20.0, resistance=0.2)
    loads = [ss.Load(dof="a", sin=40.0), ss.Load(dof="n", cos=30.0)]
    return ss.Problem(structure, contacts=contacts, loads=loads, harmonics=range(4), thermal=thermal)


def refused(self):
    raise AssertionError("a dense Jacobian was factorised")


@pytest.mark.filterwarnings("ignore:the structure has no damping")
@pytest.mark.parametrize(
    "kind_of_problem, to",
    [({}, 11.0), pytest.param({"heated": True}, 11.0, marks=pytest.mark.verify), ({"undamped": True}, 4.8)],
)
def test_a_sparse_kind_gives_the_same_curve(kind_of_problem, to, monkeypatch):
    expected = ss.forced_response(problem(**kind_of_problem), omega=(4.0, to), peaks_of="a")
    monkeypatch.setattr(dense._Factorised, "_factors", refused)
    found = ss.forced_response(
        problem(**kind_of_problem), omega=(4.0, to), peaks_of="a", options={"jacobian": sparse_kind}
    )
    assert found.outcome is expected.outcome
    assert found.dataset.sizes == expected.dataset.sizes
    for name in ("omega", "displacement", "dissipated_power"):
        value = expected.dataset[name].to_numpy()
        np.testing.assert_allclose(found.dataset[name], value, rtol=1e-6, atol=1e-8 * np.abs(value).max())
    np.testing.assert_allclose(np.array(found.peaks("a")), np.array(expected.peaks("a")), rtol=1e-8)


def test_a_sparse_kind_follows_a_parameter(monkeypatch):
    expected = ss.parameter_response(problem(), "held.mu", (0.1, 0.6), omega=7.0)
    monkeypatch.setattr(dense._Factorised, "_factors", refused)
    found = ss.parameter_response(problem(), "held.mu", (0.1, 0.6), omega=7.0, options={"jacobian": sparse_kind})
    assert found.dataset.sizes == expected.dataset.sizes
    np.testing.assert_allclose(found.dataset.displacement, expected.dataset.displacement, rtol=1e-6, atol=1e-8)


def test_first_points_found_the_long_way_round_use_the_kind_too(monkeypatch):
    """Every strategy of the ladder, also the one that makes a balance of its own."""

    monkeypatch.setattr(dense._Factorised, "_factors", refused)
    own = problem()
    search = FirstPoint(Balance(own, backend=sparse_kind), own.inputs, 6.0)
    tried = {name: attempt() is not None for name, attempt in search.strategies()}
    assert {"fewer harmonics first", "load ramp", "Newton homotopy"} <= tried.keys()
    assert all(tried.values()), tried


def test_the_other_kind_is_one():
    kind = SparseJacobian(np.diag([2.0, -3.0]))
    assert isinstance(kind, Jacobian)
    assert kind.sign() == -1
    assert kind.bordered(np.zeros(2), np.array([0.0, 0.0, -1.0])).sign() == 1


def test_options_say_what_makes_a_jacobian():
    with raises_fault("options, jacobian", found="'sparse'"):
        ss.forced_response(problem(), omega=(4.0, 5.0), options={"jacobian": "sparse"})


def test_undamped_structures_are_written_out_unless_asked_otherwise():
    """The form of the balance that goes smoothly through their resonances is one of dense Jacobians."""
    for loss, asked, expected in ((0.01, "auto", "iterative"), (0.0, "auto", "dense"), (0.0, "iterative", "iterative")):
        n = 60
        shapes = np.random.default_rng(0).standard_normal((n, 6))
        modes = ss.ModalStructure(
            omega=np.arange(1.0, 7.0), mode_shapes=shapes, dofs=[f"d{i}" for i in range(n)], loss_factor=loss
        )
        law = ss.FrictionContact(kt=1.0, mu=0.3, kn=1.0, normal_load=1.0)
        pairs = [ss.ContactPair(name=f"c{i}", contact=law, tangential=f"d{i}") for i in range(n)]
        loads = [ss.Load(dof="d0", sin=1.0)]
        balance = Balance(ss.Problem(modes, contacts=pairs, loads=loads, harmonics=range(8)), backend=asked)
        balance.anchor_if_undamped(1.37)
        assert balance.backend.name == expected
        assert (balance.springs is not None) == (expected == "dense")


def test_more_unknowns_than_memory_holds_are_refused():
    modes = ss.ModalStructure(omega=[1.0], mode_shapes=[[1.0]], dofs=["x"])
    rows = modes.project(np.eye(1), np.eye(1))
    assert backend_of("auto", rows, 400_000).name == "iterative"
    with raises_fault("harmonics", expected="at most 12000"):
        backend_of("dense", rows, 400_000)
    with raises_fault("harmonics", expected="at most 500000"):
        backend_of("auto", rows, 600_000)
    with pytest.raises(InputError, match="not known by its modes"):
        backend_of("iterative", FunctionReceptance(), 10)


class FunctionReceptance(ss.models.Receptance):
    static = np.eye(1)

    def at(self, orders, omega):
        raise NotImplementedError
