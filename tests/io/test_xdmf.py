"""The moving surface in a file of another program, read by another library."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers import reports
from helpers.blocks import block, branch, pressed, stressed
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.results.deflection import contact_nodes, contact_places, deflection_of, nearest_contacts


def test_frames_are_the_motion_over_a_period(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    made = branch()
    path = made.save_shape(tmp_path / "shape.xdmf", 3, frames=8)
    found, omega = deflection_of(made, points=[3]), float(made.dataset["omega"][3])
    with meshio.xdmf.TimeSeriesReader(str(path)) as reader:
        points, cells = reader.read_points_cells()
        np.testing.assert_allclose(points, found.skin.nodes, atol=1e-6)
        assert (cells[0].data == found.skin.triangles).all()
        assert reader.num_steps == 8
        for step in (0, 5):
            time, data, _ = reader.read_data(step)
            assert time == pytest.approx(step / 8 * 2 * np.pi / omega)
            expected = found.at(0) @ made.harmonics.H_minus(omega * time)
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
    with pytest.raises(ss.InputError, match="cannot be written"):
        branch().save_shape(tmp_path / "no" / "s.xdmf", 0)


def test_contacts_are_found_on_the_surface() -> None:
    """At the nodes next to the points that the contacts were made at, though a problem knows directions alone."""
    problem = branch().problem
    nodes = contact_nodes(problem)
    at = problem.structure.skin.nodes
    for node, point in zip(nodes, block().points.positions, strict=True):
        assert np.linalg.norm(at[node] - point) == pytest.approx(np.linalg.norm(at - point, axis=1).min(), abs=1e-9)
    places = contact_places(problem)
    np.testing.assert_allclose(places, block().points.positions, atol=1e-12)
    shown = nearest_contacts(problem.structure.skin, places)
    assert shown[nodes].tolist() == [0, 1]
    assert (nearest_contacts(problem.structure.skin, np.full((2, 3), np.nan)) == -1).all()


def test_states_and_wear_on_the_surface(tmp_path: Path) -> None:
    """Read by another library: states of a frame, worn depth over cycles, at the nodes of each contact."""
    meshio = pytest.importorskip("meshio")
    made = branch()
    nodes = contact_nodes(made.problem)
    shown = nearest_contacts(made.problem.structure.skin, contact_places(made.problem))
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


def test_a_surface_whose_residuals_are_solved_for(tmp_path: Path) -> None:
    """The same file as of the written kind: motion, states, forces over the period, shares, dissipation."""
    meshio = pytest.importorskip("meshio")
    made, read = pressed("written"), []
    for kind in ("written", "solved"):
        with meshio.xdmf.TimeSeriesReader(
            str(pressed(kind).save_shape(tmp_path / f"{kind}.xdmf", 1, frames=6))
        ) as file:
            points, _ = file.read_points_cells()
            read.append([file.read_data(step)[1] for step in range(6)])
    for one, other in zip(*read, strict=True):
        assert set(one) == set(other)
        for name, values in one.items():
            close = 1e-5 if name == "displacement" else 0.0  # six digits are written
            np.testing.assert_allclose(other[name], values, rtol=0, atol=close * np.abs(values).max())
    nodes = contact_nodes(made.problem)
    shown = nearest_contacts(made.problem.structure.skin, contact_places(made.problem))[nodes]
    for step, data in enumerate(read[1]):
        H = made.harmonics.H_minus(step / 6 * 2 * np.pi)
        for name in ("normal_force", "friction_force"):
            truth = (made.dataset[name].values[1] @ H)[shown]
            np.testing.assert_allclose(data[name][nodes], truth, rtol=1e-5, atol=1e-5 * np.abs(truth).max())
        for name in ("slip_fraction", "separation_fraction", "dissipated_power"):
            np.testing.assert_allclose(data[name][nodes], made.dataset[name].values[1][shown], rtol=1e-5, atol=1e-12)
    assert {1, 2, 3} <= {int(state) for data in read[1] for state in data["contact_state"][nodes]}
    assert points.shape == made.problem.structure.skin.nodes.shape


def test_stressed_elements_are_drawn(tmp_path: Path) -> None:
    """Read by another library: elements with their stresses, a frame for each point; some of them; nodes."""
    meshio = pytest.importorskip("meshio")
    made = stressed(12)
    found = made.stress([1, 4])
    path = made.save_stress(tmp_path / "s.xdmf", [1, 4])
    root = ElementTree.parse(path).getroot()
    assert root.find(".//Topology").get("NumberOfElements") == "5"  # type: ignore[union-attr]
    with meshio.xdmf.TimeSeriesReader(str(path)) as reader:
        _, cells = reader.read_points_cells()
        assert [(block.type, len(block.data)) for block in cells] == [("hexahedron", 5)]
        omega, _, data = reader.read_data(1)
        assert omega == pytest.approx(float(made.dataset.omega[4]))
        for name in ("von_mises_largest", "stress_alternating", "stress_mean"):
            np.testing.assert_allclose(np.concatenate(data[name]), found[name].values[1], rtol=1e-5)
    with meshio.xdmf.TimeSeriesReader(str(made.save_stress(tmp_path / "p.xdmf", [1], at=[4, 2]))) as reader:
        points, cells = reader.read_points_cells()
        middle = points[cells[0].data].mean(axis=1)
        np.testing.assert_allclose(middle, made.stress(1, [2, 4])["position"], atol=1e-6)
        _, _, data = reader.read_data(0)
        expected = made.stress(1, [2, 4])["von_mises_largest"].values[0]
        np.testing.assert_allclose(np.concatenate(data["von_mises_largest"]), expected, rtol=1e-5)
    at_nodes = stressed(24, at="nodes")
    with meshio.xdmf.TimeSeriesReader(str(at_nodes.save_stress(tmp_path / "n.xdmf", 0))) as reader:
        points, _ = reader.read_points_cells()
        _, data, _ = reader.read_data(0)
        np.testing.assert_allclose(points, at_nodes.stress(0)["position"], atol=1e-6)
        np.testing.assert_allclose(data["von_mises_static"], at_nodes.stress(0)["von_mises_static"][0], rtol=1e-5)
    some = at_nodes.problem.structure.strains.places.cells["hex8"][2]  # type: ignore[union-attr]
    with meshio.xdmf.TimeSeriesReader(str(at_nodes.save_stress(tmp_path / "c.xdmf", 0, at=some + 1))) as reader:
        points, cells = reader.read_points_cells()
        assert (len(points), len(cells[0].data)) == (8, 1)


def test_stress_as_a_table(tmp_path: Path) -> None:
    """A line for each point and place; what a place or a point alone has is on every line."""
    import csv

    made = stressed(12)
    found = made.stress([1, 4], at=[2, 3])
    with made.save_stress(tmp_path / "s.csv", [1, 4], at=[2, 3]).open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["point"], row["element"]) for row in rows] == [("1", "2"), ("1", "3"), ("4", "2"), ("4", "3")]
    assert list(rows[0])[:2] == ["point", "element"]
    unit = found["stress"].attrs["units"]
    assert float(rows[2][f"stress.xy.s1 [{unit}]"]) == float(
        found["stress"].sel(component="xy", coefficient="s1")[1, 0]
    )
    assert float(rows[3]["position.y [length]"]) == float(found["position"][1, 1])
    assert float(rows[1]["omega [rad/s]"]) == float(made.dataset.omega[1])
    with pytest.raises(ss.InputError, match=r"expected a name that ends with \.xdmf, \.csv or \.mat"):
        made.save_stress(tmp_path / "s.txt")
