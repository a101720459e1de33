"""The moving surface in a file of another program, read by another library."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers import reports
from helpers.blocks import block, branch
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.results.deflection import contact_nodes, deflection_of, nearest_contacts


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


def test_contacts_are_found_on_the_surface() -> None:
    """At the nodes next to the points that the contacts were made at, though a problem knows directions alone."""
    problem = branch().problem
    nodes = contact_nodes(problem)
    at = problem.structure.skin.nodes
    for node, point in zip(nodes, block().points.positions, strict=True):
        assert np.linalg.norm(at[node] - point) == pytest.approx(np.linalg.norm(at - point, axis=1).min(), abs=1e-9)
    shown = nearest_contacts(problem.structure.skin, nodes)
    assert shown[nodes].tolist() == [0, 1]
    assert (nearest_contacts(problem.structure.skin, np.array([-1, -1])) == -1).all()


def test_states_and_wear_on_the_surface(tmp_path: Path) -> None:
    """Read by another library: states of a frame, worn depth over cycles, at the nodes of each contact."""
    meshio = pytest.importorskip("meshio")
    made = branch()
    nodes = contact_nodes(made.problem)
    shown = nearest_contacts(made.problem.structure.skin, nodes)
    numbers = {"stick": 1, "slip": 2, "separation": 3}
    with meshio.xdmf.TimeSeriesReader(str(made.save_shape(tmp_path / "s.xdmf", 3, frames=8))) as reader:
        reader.read_points_cells()
        for step in (0, 5):
            _, data, _ = reader.read_data(step)
            for c, name in enumerate(("c1", "c2")):
                tau = step / 8 * 2 * np.pi
                (state,) = {k.rstrip("+-") for a, b, k in made.states(3)[name] if (tau - a) % (2 * np.pi) < b - a}
                assert data["contact_state"][nodes[c]] == numbers[state]
            assert (data["contact_state"][shown < 0] == 0).all()
            np.testing.assert_allclose(data["dissipated_power"][nodes], made.dataset.dissipated_power[3], rtol=1e-5)
    worn = ss.wear(made.problem, {"c1": 1e-3, "c2": 2e-3}, cycles=(0, 20), omega=float(made.dataset.omega[3]))
    with meshio.xdmf.TimeSeriesReader(str(worn.save_wear(tmp_path / "w.xdmf"))) as reader:
        reader.read_points_cells()
        assert reader.num_steps == len(worn)
        cycles, data, _ = reader.read_data(len(worn) - 1)
        assert cycles == pytest.approx(20.0)
        assert worn.dataset.worn_depth.values[-1].max() > 0.0
        np.testing.assert_allclose(data["worn_depth"][nodes], worn.dataset.worn_depth[-1], rtol=1e-5)
    with pytest.raises(ss.InputError, match="not of wear"):
        made.save_wear(tmp_path / "n.xdmf")
