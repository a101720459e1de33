"""Normal stiffness beside the compliance that the modes leave out, against a structure where both are known."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.balance.contact_stiffness import stiffness_sentence, stiffness_shares

LEFT_OUT = 0.004


def problem(kn, *, left_out=LEFT_OUT, normal="n", structure=None):
    """One mode of compliance 0.01 along x and 0.04 along n, and ``left_out`` besides."""
    modes = np.array([[1.0], [2.0]])
    modal = ss.ModalStructure(
        omega=[10.0], mode_shapes=modes, static_compliance=modes @ modes.T / 100.0 + left_out * np.eye(2),
        dofs=["x", "n"], damping_ratio=0.01,
    )  # fmt: skip
    tip = ss.ContactPair(
        name="tip", contact=ss.FrictionContact(kt=1.0, mu=0.3, kn=kn, gap=-1.0), tangential="x", normal=normal
    )
    loads = [ss.Load(dof="x", cos=1.0)]
    return ss.Problem(structure or modal, contacts=[tip], loads=loads, harmonics=range(4), units={"force": "N"})


def test_share_of_each_contact():
    shares, left_out = stiffness_shares(problem([50.0, 5000.0]))
    np.testing.assert_allclose(left_out, LEFT_OUT, rtol=1e-10)
    np.testing.assert_allclose(shares, [5.0, 0.05], rtol=1e-10)
    slanted, left_out = stiffness_shares(problem(50.0, normal={"x": 0.6, "n": 0.8}))
    assert (slanted[0], left_out[0]) == (pytest.approx(5.0), pytest.approx(LEFT_OUT))


@pytest.mark.parametrize(
    ("kn", "said"),
    [
        (
            50.0,
            "1/kn is 5 times the compliance that the modes leave out at the contacts: how far the bodies approach",
        ),
        (
            500.0,
            "1/kn is 0.5 times the compliance that the modes leave out at the contacts; a contact is hard from kn = ",
        ),
        (5000.0, "1/kn is 0.05 times the compliance that the modes leave out at the contacts: much stiffer than the"),
        ([50.0, 5000.0], "1/kn is 0.05 to 5 times the compliance"),
    ],
)
def test_what_is_said(kn, said):
    assert said in stiffness_sentence(problem(kn))


def test_the_stiffness_that_is_named_is_hard():
    named = float(stiffness_sentence(problem(50.0)).split("kn = ")[1].split()[0])
    assert stiffness_shares(problem(named))[0] == pytest.approx(0.1)


def test_nothing_is_said_where_nothing_tells():
    assert stiffness_sentence(problem(50.0, left_out=0.0)) is None
    assert stiffness_sentence(problem(50.0, normal=None)) is None
    plain = ss.MatrixStructure(M=np.eye(2), K=100.0 * np.eye(2), C=np.eye(2), dofs=["x", "n"])
    assert stiffness_sentence(problem(50.0, structure=plain)) is None
