"""The moving surface in a file of another program, read by another library."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers import reports
from helpers.blocks import branch
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.results.deflection import deflection_of


def test_frames_are_the_motion_over_a_period(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    made = branch()
    path = made.save_shape(tmp_path / "shape.xdmf", 3, frames=8)
    found, omega = deflection_of(made), float(made.dataset["omega"][3])
    with meshio.xdmf.TimeSeriesReader(str(path)) as reader:
        points, cells = reader.read_points_cells()
        np.testing.assert_allclose(points, found.skin.nodes, atol=1e-6)
        assert (cells[0].data == found.skin.triangles).all()
        assert reader.num_steps == 8
        for step in (0, 5):
            time, data, _ = reader.read_data(step)
            assert time == pytest.approx(step / 8 * 2 * np.pi / omega)
            expected = found.at(3) @ made.harmonics.H_minus(omega * time)
            np.testing.assert_allclose(data["displacement"], expected, atol=2e-5 * np.abs(expected).max())


def test_a_title_is_a_text(tmp_path: Path) -> None:
    made = branch()
    odd = ss.Branch(made.dataset.assign_attrs(title='<&"> blade'), made.outcome, made.problem)
    root = ElementTree.parse(odd.save_shape(tmp_path / "s.xdmf", 0, frames=1)).getroot()
    assert root[0][0].get("Name") == '<&"> blade'


def test_faults_are_sentences(tmp_path: Path) -> None:
    with pytest.raises(ss.InputError, match="has no surface to be seen"):
        reports.branch().save_shape(tmp_path / "s.xdmf", 0)
    with raises_fault("point", found="10000"):
        branch().save_shape(tmp_path / "s.xdmf", 10_000)
    with pytest.raises(ss.InputError, match="the shape cannot be written"):
        branch().save_shape(tmp_path / "no" / "s.xdmf", 0)
