"""Points that are asked for: there on every passage, or named on every road."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from helpers.cases import oscillator as case_text
from helpers.command import slipstick

import slipstick as ss
from slipstick.io.loading import load_dataset
from slipstick.report.content import content_of
from slipstick.solve.continuation.brackets import Bracket
from slipstick.solve.continuation.locate import Locator
from slipstick.verify.cases import oscillator


def stop() -> ss.Problem:
    """Two masses, one before an elastic stop (NLvib, example 03)."""
    K = np.zeros((3, 3))
    K[:2, :2], K[2, 2] = [[1.0, -1.0], [-1.0, 2.0]], 1.0
    structure = ss.MatrixStructure(M=np.eye(3), C=0.03 * K, K=K, dofs=["q1", "q2", "rest"])
    contact = ss.FrictionContact(kt=1e-3, mu=0.0, kn=100.0, gap=1.0)
    pair = ss.ContactPair(name="stop", contact=contact, tangential="rest", normal="q1")
    return ss.Problem(structure, contacts=pair, loads=ss.Load(dof="q2", cos=0.1), harmonics=range(8))


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_no_request_is_lost_beside_a_corner_peak() -> None:
    """The contact opens there, and the cubic over the step is far from the branch: down as well as up."""
    asked = np.arange(0.5815, 0.5835, 5e-5).tolist()
    motions = []
    for ends in ((0.7, 0.5), (0.5, 0.8)):
        branch = ss.forced_response(stop(), omega=ends, at=asked)
        data = branch.dataset
        there = data.kind.values == "requested"
        assert sorted(data.omega.values[there]) == asked
        assert not [text for text in branch.warnings if "requested" in text]
        motions.append(data.displacement.values[there][np.argsort(data.omega.values[there])])
    np.testing.assert_allclose(*motions, atol=1e-9 * np.abs(motions).max())


MISSED = r"^a point was requested at 3.1 rad/s, but no solution was found on the branch there: try a smaller"


@pytest.fixture
def unfound(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing converges at a fixed parameter but the ends."""
    monkeypatch.setattr(Locator, "_at", lambda *_: None)


@pytest.mark.usefixtures("unfound")
def test_what_is_not_found_is_named() -> None:
    with pytest.warns(ss.SlipstickWarning, match=MISSED):
        branch = ss.forced_response(oscillator(), omega=(3.0, 3.3), at=[3.1, 3.3])
    assert branch.outcome is ss.Outcome.COMPLETED
    assert "3.1 rad/s" in branch.warnings[0]
    with pytest.warns(ss.SlipstickWarning, match=r"^a point was requested at 0.31 \(damper.mu\)"):
        ss.parameter_response(oscillator(), "damper.mu", (0.3, 0.35), omega=3.0, at=0.31)


@pytest.mark.usefixtures("unfound")
def test_what_is_not_found_is_named_by_run_and_in_the_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    case = tmp_path / "case.toml"
    case.write_text(CASE)
    result = slipstick("run", case, "--no-figures")
    assert result.exit_code == 0, result.output
    said = " ".join(result.output.split())
    assert said.count("a point was requested at 5.1 rad/s") == 1
    path = next(tmp_path.rglob("results.nc"))
    data = load_dataset(path)
    assert "a point was requested at 5.1 rad/s" in data.attrs["warnings"]
    assert data.attrs["requested"] == "5.1"
    page = content_of(ss.load(path), "case", contacts=1, dofs=1)
    assert "a point was requested at 5.1 rad/s" in " ".join(page["warnings"])


CASE = case_text(head='harmonics = "0..3"\n', rubbing="velocity = 10.0", response="from = 5.0\nto = 5.3\nat = [5.1]\n")


def test_a_load_factor_that_is_not_found_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """And nothing else stands for it."""
    monkeypatch.setattr(Locator, "_event", lambda *_: None)
    given = {"amplitude": (1.0, 5.0), "load_factors": [1.0, 1.5, 9.0]}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = ss.nonlinear_modes(oscillator(harmonics=(0, 1)), **given).dataset
        monkeypatch.setattr(Bracket, "room", 1.0)
        missed = ss.nonlinear_modes(oscillator(harmonics=(0, 1)), **given)
    assert found.load_factor.values[found.kind.values == "requested"] == pytest.approx([1.0, 1.5], rel=1e-8)
    assert "requested" not in missed.dataset.kind.values
    assert any(text.startswith("load_factors: a point was requested at 1, 1.5") for text in missed.warnings)
