"""Balance and time integration on random structures: two methods that share neither element nor discretisation.

Three to five dofs, one to three contacts with and without normal motion, gaps, rubbing, static residuals; 24 harmonics.
"""

import numpy as np
import pytest

import slipstick as ss

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")  # on purpose

HARMONICS = range(25)
TRUNCATED = 2e-3  # at most, with 24 harmonics: third order


def random_structure(rng, n):
    A = rng.normal(size=(n, n))
    M, K = np.diag(rng.uniform(0.5, 2.0, n)), 3 * A @ A.T + 4 * np.eye(n)
    root = np.diag(np.diag(M) ** -0.5)
    squares, modes = np.linalg.eigh(root @ K @ root)
    dofs = [f"d{i}" for i in range(n)]
    if rng.random() < 0.5:
        return ss.MatrixStructure(M=M, C=0.02 * K + 0.05 * M, K=K, dofs=dofs), np.sqrt(squares[0])
    structure = ss.ModalStructure(
        omega=np.sqrt(squares[:-1]), mode_shapes=(root @ modes)[:, :-1], static_compliance=np.linalg.inv(K), dofs=dofs,
        damping_ratio=0.05,
    )  # fmt: skip
    return structure, np.sqrt(squares[0])


def random_pair(rng, name, n):
    tangential, normal = rng.choice(n, 2, replace=False)
    opens = rng.random() < 0.7
    gap = rng.uniform(-1.5, 0.3) if opens else -rng.uniform(0.2, 2.0)
    contact = ss.FrictionContact(kt=rng.uniform(0.5, 20), mu=rng.uniform(0.1, 0.6), kn=rng.uniform(0.5, 5), gap=gap)
    rubbing = ss.RubbingMotion(velocity=rng.choice([0, 1, 1]) * rng.normal(), cos={1: rng.choice([0.0, 0.3])})
    return ss.ContactPair(
        name=name, contact=contact, tangential=f"d{tangential}", normal=f"d{normal}" if opens else None, rubbing=rubbing
    )


def random_problem(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 6))
    structure, first = random_structure(rng, n)
    pairs = [random_pair(rng, f"c{j}", n) for j in range(rng.integers(1, 4))]
    loads = [ss.Load(dof=f"d{i}", sin=3 * rng.normal(), cos=3 * rng.normal()) for i in range(2)]
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=HARMONICS), rng.uniform(0.5, 2.0) * first


def assert_agree(seed):
    problem, omega = random_problem(seed)
    branch = ss.forced_response(problem, omega=(omega, omega * 1.0001))
    check = branch.check_in_time(0, periods=80)
    assert check.converged
    assert check.relative_difference < TRUNCATED, check


@pytest.mark.parametrize("seed", range(10))
def test_balance_against_time(seed):
    assert_agree(seed)


@pytest.mark.verify(sample=50)
@pytest.mark.parametrize("seed", range(10, 200))
def test_balance_against_time_long(seed):
    assert_agree(seed)
