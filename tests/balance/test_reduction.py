"""Reductions that are too coarse: the estimate against the full model, what is refused or warned of on every road."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.command import slipstick
from scipy import sparse

import slipstick as ss
from slipstick.balance.physics_checks import problem_warnings
from slipstick.balance.reduction import harmonic_weights, reduction_faults, reduction_warnings, worst_error
from slipstick.case.case import Case
from slipstick.errors import InputError, SlipstickWarning
from slipstick.structure.modal import ModalStructure

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")  # on purpose

N = 200
DOFS = [f"u{k}" for k in range(N)]
STIFFNESS = 1e4


def chain() -> tuple[Any, Any]:
    """A rod of masses, held at both ends: natural frequencies nearly 1, 2, 3, ... times the first."""
    off = -np.ones(N - 1)
    K = STIFFNESS * sparse.diags_array([off, 2.0 * np.ones(N), off], offsets=[-1, 0, 1], format="csr")
    return K, sparse.eye_array(N, format="csr")


FIRST = 2.0 * np.sqrt(STIFFNESS) * np.sin(np.pi / (2 * (N + 1)))


def reduced(modes: int, **options: Any) -> ModalStructure:
    K, M = chain()
    return ss.reduce(K, M, dofs=DOFS, keep=["u66", "u137"], modes=modes, loss_factor=0.01, **options)


def problem(structure: Any, harmonics: Any = range(4), order: int = 1, **rubbing: Any) -> ss.Problem:
    pair = ss.ContactPair(
        name="pad", contact=ss.FrictionContact(kt=100.0, mu=0.3, gap=-1.0), tangential="u66",
        rubbing=ss.RubbingMotion(**({"velocity": 1.0} | rubbing)),
    )  # fmt: skip
    load = ss.Load(dof="u137", harmonic=order, cos=1.0)
    return ss.Problem(structure, contacts=[pair], loads=[load], harmonics=ss.Harmonics(harmonics))


def exact_error(s: ModalStructure, omega: float) -> float:
    """By inverting the full matrices, dofs scaled by their compliance."""
    K, M = (A.toarray() for A in chain())
    full = np.linalg.inv(K - omega**2 * M)[np.ix_([66, 137], [66, 137])]
    undamped = ModalStructure(
        omega=s.omega, mode_shapes=s.mode_shapes, static_compliance=s.static_compliance,
        second_residual=s.second_residual, dofs=s.dofs,
    )  # fmt: skip
    found = undamped.project(np.eye(2), np.eye(2)).at([1], omega)[0][0].real
    scale = 1.0 / np.sqrt(np.diag(s.static_compliance))
    scaled = scale * scale[:, None]
    return float(np.linalg.norm(scaled * (found - full)) / np.linalg.norm(scaled * full))


@pytest.mark.parametrize("modes", [1, 2, 4, 8, 16, 32])
def test_estimate_bounds_the_error_below_the_last_mode(modes: int) -> None:
    s = reduced(modes)
    for part in (0.1, 0.3, 0.55, 0.83):
        omega = part * s.last_mode
        error = exact_error(s, omega)
        assert error <= 1.1 * s.reduction_error(omega) + 1e-12
        if s.reduction_error(omega) > 1e-9:
            assert s.reduction_error(omega) <= 40.0 * error


@pytest.mark.parametrize("modes", [1, 3, 10])
def test_estimate_shows_what_lies_beyond_the_modes(modes: int) -> None:
    s = reduced(modes)
    for part in (1.55, 2.62, 4.1):
        estimate = float(s.reduction_error(part * s.last_mode))
        assert estimate > 0.1
        assert 0.05 < estimate / exact_error(s, part * s.last_mode) < 50.0


def test_all_modes_leave_nothing_out() -> None:
    s = reduced(N)
    assert s.reduction_error(1.5 * s.last_mode) < 1e-6
    assert s.reduction_error([s.last_mode, s.omega[3]]).max() < 1e-6
    assert reduction_warnings(problem(s, range(20)), (FIRST, 50.0 * FIRST)) == []


def test_valid_to_is_where_the_estimate_reaches_one_percent() -> None:
    s = reduced(8)
    assert s.reduction_error(0.98 * s.valid_to) <= 1e-2
    assert s.reduction_error(np.linspace(1.0, 1.05, 20) * s.valid_to).max() > 0.99e-2
    assert reduced(4).valid_to < s.valid_to < s.last_mode


def test_units_do_not_matter() -> None:
    """One dof in other units, as a rotation beside a displacement."""
    s, units = reduced(4), np.array([1.0, 1e-6])
    other = ModalStructure(
        omega=s.omega, mode_shapes=units[:, None] * s.mode_shapes, dofs=s.dofs,
        static_compliance=units * units[:, None] * s.static_compliance,
        second_residual=units * units[:, None] * s.second_residual,
    )  # fmt: skip
    grid = FIRST * np.array([0.5, 2.5, 7.3])
    np.testing.assert_allclose(other.reduction_error(grid), s.reduction_error(grid), rtol=1e-9)


def test_weights_of_harmonics() -> None:
    s = reduced(8)
    for given, base, weights in (
        ({}, [1, 1, 1, 1], [1, 1 / 4, 1 / 9, 1 / 16]),
        ({"order": 2}, [1, 2, 2, 2], [1, 1, 4 / 9, 1 / 4]),
        ({"cos": {3: 1.0}}, [1, 1, 3, 3], [1, 1 / 4, 1, 9 / 16]),
    ):
        np.testing.assert_allclose(harmonic_weights(problem(s, range(5), **given)), [base, weights])


def test_one_mode_over_a_range_with_four() -> None:
    """Refused by its number, with a remedy that works; the same model with enough modes has nothing to say."""
    span = (0.5 * FIRST, 4.5 * FIRST)
    (sentence,) = map(str, reduction_faults(problem(reduced(1)), span))
    assert "it is of no use" in sentence
    assert "force = true" in sentence
    worst = worst_error(problem(reduced(1)), span)
    assert worst is not None
    enough = int(np.sum(reduced(N).omega < worst.needed))
    assert 4 < enough < 0.5 * N
    assert reduction_warnings(problem(reduced(enough)), span) == []
    assert reduction_faults(problem(reduced(6)), (0.5 * FIRST, 1.5 * FIRST)) == []


@pytest.mark.parametrize(("modes", "refused"), [(4, True), (6, False), (12, False)])
def test_what_an_error_counts_is_what_it_does_to_the_curve(modes: int, refused: bool) -> None:
    """Stuck and sliding on a contact as stiff as the rod: the curve is wrong by that much, within a factor of 3."""
    span = (0.8 * FIRST, 1.5 * FIRST)
    stiffness = float(1.0 / reduced(60).static_compliance[0, 0])
    curves = []
    for kept in (60, modes):
        rubbed = problem(reduced(kept), range(6), velocity=0.0)
        pair = replace(rubbed.contacts[0], contact=ss.FrictionContact(kt=stiffness, mu=0.3, gap=-1.5))
        rubbed = replace(rubbed, contacts=[pair])
        data = ss.forced_response(rubbed, omega=span).dataset
        curves.append(np.interp(np.linspace(*span, 100), data.omega, data.amplitude.sel(dof="u66")))
    worst = worst_error(rubbed, span)
    assert worst is not None
    error = np.abs(curves[1] - curves[0]).max() / curves[0].max()
    assert worst.refused == refused
    assert error < 3.0 * worst.value
    assert not refused or error > 3e-3


def test_a_high_harmonic_counts_less() -> None:
    """Harmonic 12 lies beyond the 8 modes: its error counts 1/144, or in full where the rubbing motion excites it."""
    s, span = reduced(8), (0.9 * FIRST, 1.1 * FIRST)
    assert s.reduction_error(12 * 1.1 * FIRST) > 1e-2
    (said,) = reduction_warnings(problem(s, range(13)), span)
    worst = worst_error(problem(s, range(13)), span)
    assert worst is not None
    assert not worst.refused
    assert f"harmonic {worst.order} of" in said
    assert reduction_faults(problem(s, range(13), cos={12: 1.0}), span) != []


def test_forced_response_warns_in_the_end() -> None:
    """The warning is among those of the problem, so that every road has it."""
    said = problem_warnings(problem(reduced(1)), (0.5 * FIRST, 4.5 * FIRST))
    assert sum("of no use" in sentence for sentence in said) == 1


def test_modes_of_which_nothing_more_is_known() -> None:
    s = reduced(3)
    bare = ModalStructure(omega=s.omega, mode_shapes=s.mode_shapes, dofs=s.dofs)
    (said,) = reduction_warnings(problem(bare), (FIRST, 4.0 * FIRST))
    assert "but the modes of the structure end at" in said
    assert reduction_warnings(problem(bare), (FIRST, 2.0 * FIRST)) == []
    whole = ModalStructure(omega=s.omega[:2], mode_shapes=s.mode_shapes[:, :2], dofs=s.dofs)
    assert reduction_warnings(problem(whole), (FIRST, 4.0 * FIRST)) == []  # as many modes as dofs
    bound = ModalStructure(omega=s.omega, mode_shapes=s.mode_shapes, dofs=s.dofs, static_compliance=s.static_compliance)
    (said,) = reduction_warnings(problem(bound), (FIRST, 4.0 * FIRST))
    assert "may be wrong by up to" in said
    assert "give second_residual" in said
    assert reduction_faults(problem(bound), (FIRST, 4.0 * FIRST)) == []


def test_reduce_over_a_range() -> None:
    """Refused above 1e-2 with the number of modes that would do, warned above 1e-4, silent below."""
    span = (0.0, 4.5 * FIRST)
    with pytest.raises(InputError, match=r"of no use; keep more modes, all \d+ below .*force = true"):
        reduced(1, frequency_range=span)
    with pytest.warns(SlipstickWarning, match="of no use; keep more modes"):
        forced = reduced(1, frequency_range=span, force=True)
    np.testing.assert_array_equal(forced.omega, reduced(1).omega)
    with pytest.warns(SlipstickWarning, match="the receptance of the reduced structure is wrong by about"):
        reduced(12, frequency_range=span)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        reduced(80, frequency_range=span)
        K, M = chain()
        ss.reduce(K, M, dofs=DOFS, keep=["u66", "u137"], frequency_range=span)
    with pytest.warns(SlipstickWarning, match="of itself at"):  # measured, as asked for
        ss.reduce(K, M, dofs=DOFS, keep=["u66", "u137"], frequency_range=span, accuracy=0.01)


def modal_case(folder: Path, modes: int, more: str = "") -> Path:
    """The chain with all its modes in a file, of which a case takes some."""
    K, M = chain()
    s = ss.reduce(K, M, dofs=DOFS, keep=["u66", "u137"], modes=N)
    np.savez(folder / "rod.npz", omega=s.omega, mode_shapes=s.mode_shapes, static_compliance=s.static_compliance)
    text = (
        f'format = 1\nharmonics = "0..3"\n[structure]\nkind = "modal"\nfile = "rod.npz"\ndofs = ["u66", "u137"]\n'
        f'modes = {modes}\nloss_factor = 0.01\n{more}[[load]]\ndof = "u137"\ncos = 1.0\n'
        '[[contact]]\nname = "pad"\ntangential = "u66"\nkt = 100.0\nmu = 0.3\nnormal_load = 1.0\n'
        f"rubbing = {{ velocity = 1.0 }}\n[response]\nfrom = {0.5 * FIRST}\nto = {4.5 * FIRST}\n"
    )
    (folder / "case.toml").write_text(text)
    return folder / "case.toml"


@pytest.mark.parametrize("verb", ["check", "run"])
def test_check_and_run_refuse_alike(tmp_path: Path, verb: str) -> None:
    path = modal_case(tmp_path, 1)
    result = slipstick(verb, path)
    assert result.exit_code == 2
    with pytest.raises(InputError) as error:
        Case.from_file(path)
    assert " ".join(error.value.sentences[0].split()) in " ".join(result.stderr.split())
    assert "of no use" in error.value.sentences[0]
    assert "can start" not in result.stdout


def test_a_forced_case_says_the_same_as_a_warning(tmp_path: Path) -> None:
    case = Case.from_file(modal_case(tmp_path, 1, "force = true\n"))
    assert any("of no use" in sentence for sentence in case.warnings())
    quiet = Case.from_file(modal_case(tmp_path, 90))
    assert not any("reduced structure" in sentence for sentence in quiet.warnings())
    result = slipstick("check", tmp_path / "case.toml")
    assert result.exit_code == 0, result.output
    assert "error by the modes left out, estimated" in result.stdout


def test_results_tell_how_far_the_reduction_holds_and_the_time_check_its_error() -> None:
    s = reduced(60)
    branch = ss.forced_response(problem(s), omega=(0.9 * FIRST, 1.1 * FIRST))
    assert float(branch.dataset.attrs["reduction_valid_to"].split()[0]) == pytest.approx(s.valid_to, rel=1e-5)
    check = branch.check_in_time(2)
    assert check.reduction_error is not None
    assert 0.0 < check.reduction_error < 1e-4
