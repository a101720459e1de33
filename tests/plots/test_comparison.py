"""Branches beside each other."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.figures import branch, drawn, named, title

import slipstick as ss


def test_branches_are_compared_by_label() -> None:
    top, middle, bottom = ss.plots.compare([branch(), branch(5.0)], labels=["still", "rubbed"], dof="x1")
    assert named(top) == ["still", "rubbed", "peak"]
    assert [ax.get_ylabel() for ax in (top, middle, bottom)] == [
        "Amplitude [mm]", "Mean [mm]", "Dissipated power [mW]",
    ]  # fmt: skip
    assert bottom.get_xlabel() == "Fundamental frequency [rad/s]"
    assert title(top) == "Chain (x1)"
    assert [ax.get_legend() is None for ax in (top, middle, bottom)] == [False, True, True]  # said once
    for k, b in enumerate((branch(), branch(5.0))):
        np.testing.assert_array_equal(drawn(top.lines[k])[1], b.dataset["amplitude"].sel(dof="x1"))
        np.testing.assert_allclose(drawn(bottom.lines[k])[1], b.dataset["dissipated_power"].sum("contact"))
    assert not drawn(middle.lines[0])[1].any()


def test_without_labels_they_are_numbered_unless_their_titles_tell() -> None:
    (top, _) = ss.plots.compare([branch(), branch()], frequency="Hz")
    assert named(top)[:2] == ["branch 1", "branch 2"]
    named_ones = [branch().dataset.assign_attrs(title=t) for t in "ab"]
    assert named(ss.plots.compare(named_ones)[0])[:2] == ["a", "b"]
    assert named(ss.plots.compare({"v": branch(), "w": branch(5.0)})[0])[:2] == ["v", "w"]


def test_labels_that_do_not_fit() -> None:
    for labels in (["a"], ["a", "a"], ["a", "b", "c"], "a"):
        with pytest.raises(ss.InputError, match="for 2 branches"):
            ss.plots.compare([branch(), branch()], labels=labels)
    with pytest.raises(ss.InputError, match="labels"):
        ss.plots.compare([branch(), branch()], labels=[1, 2])
    with pytest.raises(ss.InputError, match="there is no dof 'q'"):
        ss.plots.compare([branch(), branch()], dof="q")
