"""The deflected shape in a page."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.blocks import block, branch, pressed, worn
from helpers.reports import branch as masses
from helpers.reports import decoded, decoded_coefficients

from slipstick.report import content
from slipstick.report.content import _looking_at, shape_of
from slipstick.results.deflection import deflection_of, outward


def test_fields_and_coefficients_make_the_motion() -> None:
    made = branch()
    found, whole = shape_of(made), deflection_of(made)
    assert found is not None
    assert decoded(found["nodes"]) == pytest.approx(whole.skin.nodes)
    assert (decoded(found["triangles"]) == whole.skin.triangles).all()
    fields, coefficients = decoded(found["fields"]), decoded_coefficients(found["coefficients"])
    size = max(np.abs(whole.at(p)).max() for p in range(len(made)))
    for point in range(0, len(made), 5):
        motion = (fields.T @ coefficients[point]).reshape(-1, 3, made.harmonics.size)
        assert np.abs(motion - whole.at(point)).max() < 5e-3 * size


def test_nothing_where_no_surface_is_known() -> None:
    assert shape_of(masses()) is None
    made = branch()
    assert shape_of(type(made)(made.dataset, made.outcome)) is None


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_worn_depth_lies_round_the_contacts() -> None:
    """Each node shows the contact next to it, with its depth at every point; it is looked at from above."""
    made = worn()
    found = shape_of(made)
    assert found is not None
    nodes, contact = decoded(found["nodes"]).reshape(-1, 3), decoded(found["on"]["contact"])
    apart = np.linalg.norm(nodes[:, None] - block().points.positions, axis=2)
    nearest = contact[apart.argmin(axis=0)]
    assert nearest.tolist() == [1, 2]
    assert ((contact == 1) <= (apart[:, 0] <= apart[:, 1] + 1e-6)).all()
    of = {one["key"]: one for one in found["on"]["of"]}
    assert list(of) == ["worn_depth", "normal_load", "slip_fraction", "separation_fraction", "dissipated_power"]
    for key, one in of.items():
        values, truth = decoded(one["values"]).reshape(len(made), 2) * one["most"] / 65535, made.dataset[key]
        np.testing.assert_allclose(values, truth, atol=1e-5 * float(truth.max()))
    yaw, pitch = np.radians(found["on"]["turn"])
    eye = [-np.cos(pitch) * np.sin(yaw), -np.cos(pitch) * np.cos(yaw), np.sin(pitch)]
    assert eye[2] > 0.8  # the contacts lie on the top
    plain = shape_of(branch())
    assert plain is not None
    assert plain["on"]["of"][0]["key"] == "normal_force"
    assert plain["less"] == found["less"] == ""


@pytest.mark.parametrize("y", [0.0, 0.2])
def test_contacts_at_an_edge_look_along_their_normals(y: float) -> None:
    """The next node of the surface may be one at an edge, whose triangles lie on two faces."""
    problem = branch().problem
    assert problem is not None
    nodes = problem.structure.skin.nodes  # type: ignore[attr-defined]
    at = [int(np.argmin(np.linalg.norm(nodes - place, axis=1))) for place in ([0.8, y, 0.2], [0.2, y, 0.2])]
    mean = outward(problem, np.array(at))[1]
    assert mean[2] > 0.0
    np.testing.assert_allclose(mean[:2], 0.0, atol=1e-6 * mean[2])


def test_a_surface_is_looked_at() -> None:
    for normal in np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.64, 0.48]]]):
        yaw, pitch = np.radians(_looking_at(normal))
        eye = [-np.cos(pitch) * np.sin(yaw), -np.cos(pitch) * np.cos(yaw), np.sin(pitch)]
        assert np.dot(eye, normal) > 0.7


def test_a_page_shows_some_of_a_fine_surface_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of both kinds of residuals the same; nodes and contacts that are shown are those of the whole."""
    made = pressed("written")
    whole, skin = shape_of(made), made.problem.structure.skin  # type: ignore[union-attr]
    assert whole is not None
    assert whole["less"] == ""
    assert whole["on"]["shown"] == whole["on"]["count"] == 100
    monkeypatch.setattr(content, "MOST_SHAPE_NODES", 80)
    few, solved = shape_of(made), shape_of(pressed("solved"))
    assert few is not None
    assert solved is not None
    nodes = decoded(few["nodes"]).reshape(-1, 3)
    assert len(nodes) <= 80
    shown = few["on"]["shown"]
    assert (
        f"{len(nodes)} of {len(skin.nodes)} nodes of the surface and {shown} of 100 contacts are shown" in few["less"]
    )
    assert shown < 100
    assert decoded(few["on"]["contact"]).max() == shown
    motion = [
        np.einsum("kn,kl->nl", decoded(one["fields"]), decoded_coefficients(one["coefficients"])[1])
        for one in (few, solved)
    ]
    np.testing.assert_allclose(motion[1], motion[0], rtol=0, atol=2e-3 * np.abs(motion[0]).max())
    for one, other in zip(few["on"]["of"], solved["on"]["of"], strict=True):
        assert one == other
