"""Reduced sectors: what is asked, stored, turned at speed, and refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.ring_mesh import ring_model

import slipstick as ss
from slipstick.balance.reduction import reduction_warnings, worst_error
from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.box import box
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.model import ImportedModel, elastic_model
from slipstick.fem.ties import project, tie_equations
from slipstick.models.parametric_sector import SectorShape, sector_shape
from slipstick.solve.linear.condensation import Condensed
from slipstick.solve.linear.lanczos import modes
from slipstick.structure.reduction.reduce import reduce_model

N = 6
SHAPE = SectorShape(
    sectors=N, element_size=0.03, bore=0.04, rim=0.08, tip=0.14, thickness=0.2, stagger=3.0, twist=5.0
)  # fmt: skip
MODEL = ss.models.bladed_sector(SHAPE)


def reduced(**more: Any) -> Any:
    return ss.reduced_sector(MODEL, **{"surface": "tip", "contacts": 1, "modes": 4, **more})


def test_phases_are_computed_when_they_are_needed_and_read_again(tmp_path: Path) -> None:
    first = reduced(cache=tmp_path)
    assert not first.seconds
    omega = first.natural_frequencies(2)
    assert list(first.seconds) == ["nodal diameter 2"]
    assert first.solver
    again = reduced(cache=tmp_path)
    assert np.array_equal(again.natural_frequencies(2), omega)
    assert again.solver == ""
    assert again.complete(2) == first.complete(2)
    other = reduced(cache=tmp_path, modes=5)
    assert other.natural_frequencies(2).size == 5


def test_all_phases_share_one_elimination_at_rest_and_one_for_their_count(monkeypatch: pytest.MonkeyPatch) -> None:
    shifts = []
    of = Condensed.of
    monkeypatch.setattr(Condensed, "of", lambda *a, solve: (shifts.append(solve), of(*a, solve=solve))[1])
    sector = reduced(modes=8)
    assert all(sector.complete(k) for k in range(N // 2 + 1))
    assert shifts == [True, False]


@pytest.mark.filterwarnings("ignore:the harmonics left out", "ignore:the receptance of the reduced structure")
def test_a_result_comes_back_with_its_sector(tmp_path: Path) -> None:
    sector = reduced(pressure="concave", loss_factor=1e-3)
    contact = ss.FrictionContact(kt=1e6, mu=0.3, normal_load=10.0)
    problem = ss.Problem(
        sector.travelling_wave(2), contacts=ss.surface_contacts(sector, contact=contact, direction="circumferential"),
        loads=[ss.Load(shape="pressure", harmonic=1, sin=1e3)], harmonics=ss.Harmonics(range(6)), outputs=["c1y"],
    )  # fmt: skip
    omega = 0.95 * sector.natural_frequencies(2)[0]
    branch = ss.steady_response(problem, omega=omega)
    branch.save(tmp_path / "r.nc")
    back = ss.load(tmp_path / "r.nc")
    again = ss.steady_response(back.problem, omega=omega)
    assert np.array_equal(again.dataset.displacement, branch.dataset.displacement)
    with pytest.raises(InputError, match="nodal diameter 1 are not stored with this sector"):
        back.problem.structure.sector.natural_frequencies(1)


def test_a_turning_sector_is_the_turning_ring() -> None:
    speed, mesh = 800.0, MODEL.mesh
    assert mesh is not None
    faces = np.union1d(mesh.surfaces["low"].nodes, mesh.surfaces["high"].nodes)
    ring, _ = ring_model(mesh, N, faces, mesh.surfaces["bore"].nodes)
    every = {kind: np.arange(len(block)) for kind, block in ring.mesh.blocks.items()}
    imported = ImportedModel(
        K=ring.K, M=ring.M, dof_nodes=ring.mesh.labels[ring.free // 3], dof_components=ring.free % 3,
        mesh=replace(ring.mesh, element_sets={"all": every}), materials=MODEL.materials,
    )  # fmt: skip
    turning = ss.at_speed(imported, speed, axis={"direction": (0, 0, 1)})
    exact = modes(turning.K, turning.M, 12).omega
    sector = reduced(speed=speed)
    found = [w for k in range(N // 2 + 1) for w in np.repeat(sector.natural_frequencies(k), 1 + (k not in (0, N // 2)))]
    assert np.allclose(np.sort(found)[:12], exact, rtol=1e-8)
    assert exact[0] > 1.0005 * min(reduced().natural_frequencies(k)[0] for k in range(N // 2 + 1))


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"low": "LOW"}, "node set 'LOW' is not in the imported model"),
        ({"low": "low", "high": "tip"}, "high: found node .* from the nearest node of low"),
        ({"sectors": 7}, "turned by 360/7 degrees.* they lie 60 degrees apart"),
        ({"sectors": 1}, "sectors"),
        ({"surface": None}, "nothing is kept"),
        ({"surface": "TIP"}, "there is no surface 'TIP' in the model; did you mean 'tip'"),
        ({"between": ("shroud_low", "shroud_hi")}, "there is no surface 'shroud_hi'"),
        ({"between": ("shroud_high", "shroud_low")}, "between"),
        ({"between": "shroud_low"}, "two surfaces, low and high"),
        ({"between": ("shroud_low", "shroud_high"), "between_contacts": "many"}, "between_contacts: found 'many'"),
        ({"keep": ["n1w"], "surface": "TIP"}, "'n1w' in the model[^$]*no surface 'TIP'"),
        ({"pressure": "bore"}, "does no work: the nodes of 'bore' are held"),
        ({"modes": 3, "up_to": 1e3}, "both modes and up_to are given"),
        ({"modes": 3, "accuracy": 1e-5, "up_to": 1e3}, "both modes and accuracy are given"),
        ({"modes": None, "accuracy": 1e-5}, "accuracy is given without up_to; give the highest frequency"),
        ({"modes": None, "accuracy": 2.0, "up_to": 1e3}, "accuracy: found 2.0; expected a relative error between 0"),
        ({"speed": -1.0}, "speed"),
        ({"axis": {"direction": (1, 0, 0)}}, "check sectors, axis and faces"),
    ],
)
def test_what_cannot_be_reduced_is_said(asked: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        reduced(**asked)


def test_a_model_that_says_nothing_needs_sectors_and_faces() -> None:
    plain = replace(MODEL, symmetry=None)
    with pytest.raises(InputError) as error:
        ss.reduced_sector(plain, surface="tip")
    assert [fault.where[0] for fault in error.value.faults] == ["sectors", "low", "high"]
    told = ss.reduced_sector(plain, sectors=N, low="low", high=["high"], surface="tip", contacts=1, modes=4)
    assert np.array_equal(told.natural_frequencies(1), reduced().natural_frequencies(1))


def test_a_sector_is_no_body() -> None:
    with pytest.raises(InputError, match=r"one of 6 sectors of a disc, and its faces are free; reduce it with ss.red"):
        ss.reduced_body(MODEL, surface="tip")


def test_a_disc_that_is_not_held_is_told() -> None:
    mesh = MODEL.mesh
    assert mesh is not None
    from slipstick.fem.assembly import assemble
    from slipstick.models.blade import BLADE_STEEL

    whole = assemble(mesh, BLADE_STEEL)
    rows = np.arange(3 * mesh.n_nodes)
    free = replace(
        MODEL, K=whole.stiffness, M=whole.mass, dof_nodes=mesh.labels[rows // 3], dof_components=rows % 3,
        constrained=np.zeros((0, 2), dtype=np.int64),
    )  # fmt: skip
    sector = ss.reduced_sector(free, surface="tip", contacts=1, modes=4)
    with pytest.raises(InputError, match="singular for nodal diameter 1: some motion meets no resistance"):
        sector.natural_frequencies(1)
    assert sector.natural_frequencies(2)[0] > 0.0  # which moves no centre of mass


@pytest.mark.parametrize(
    ("dimensions", "said"),
    [
        ({"stagger": 60.0}, "the blade does not fit on its sector"),
        ({"rim": 0.5}, "expected bore < rim < tip - shroud_height"),
        ({"sectors": 2}, "sectors"),
        ({"shroud_gap": 0.7}, "0 to 0.5 of a sector"),
        ({"element_size": 1.0}, "well below the chord"),
    ],
)
def test_dimensions_that_make_no_sector(dimensions: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        SectorShape(**dimensions)


def test_sizes_by_name() -> None:
    assert (
        ss.models.bladed_sector(sector_shape("coarse", shroud_gap=0.1)).n_dofs
        == ss.models.bladed_sector("coarse").n_dofs
    )
    with pytest.raises(InputError, match="size"):
        sector_shape("huge")


def test_too_few_modes_are_told_again_by_the_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slipstick.structure.reduction.compute.MOST_BY_DEFAULT", 3)
    said = []
    for _ in range(2):
        sector = reduced(modes=None, cache=tmp_path)
        with pytest.warns(SlipstickWarning) as told:
            sector.natural_frequencies(2)
        said.append([str(warning.message) for warning in told])
    assert sector.solver == ""  # the second was read
    assert said[0] == said[1]
    assert said[0][0].startswith("nodal diameter 2: the receptance of the reduced structure is wrong by about")


def test_what_does_not_reach_up_to_is_refused_as_of_bodies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("slipstick.structure.reduction.compute.MOST_BY_DEFAULT", 3)
    asked: dict[str, Any] = {"modes": None, "up_to": 20.0 * reduced().natural_frequencies(2)[0], "cache": tmp_path}
    for _ in range(2):
        with raises_fault("nodal diameter 2", says="the receptance of the reduced structure .*keep more modes"):
            reduced(**asked).natural_frequencies(2)
    with pytest.warns(SlipstickWarning, match="nodal diameter 2: the receptance of the reduced structure"):
        assert reduced(**asked, force=True).natural_frequencies(2).size == 3
    K, M = np.diag(np.arange(1.0, 11.0)) - 0.4 * (np.eye(10, k=1) + np.eye(10, k=-1)), np.eye(10)
    body = {"keep": ["0", "9"], "dofs": [str(i) for i in range(10)], "reach": 20.0}
    with pytest.raises(InputError, match=r"the receptance of the reduced structure .*keep more modes"):
        reduce_model(K, M, **body)
    with pytest.warns(SlipstickWarning, match="the receptance of the reduced structure"):
        reduce_model(K, M, **body, force=True)


@pytest.mark.parametrize("accuracy", [1e-4, 1e-8])
def test_an_accuracy_holds_against_the_full_sector_up_to_its_frequency(accuracy: float) -> None:
    """Between the directions kept, and for the load by itself, whose unit is another one."""
    top = 4.2 * reduced().natural_frequencies(2)[0]
    sector = reduced(modes=None, accuracy=accuracy, up_to=top, pressure="concave")
    assert sector.dofs[-1] == "pressure"
    for k in (0, 2):
        s = sector.structure.phase_modes(k)
        assert s.omega.size < MODEL.n_dofs // N
        for omega in np.linspace(0.05, 1.0, 5) * top:
            found = (s.shapes * (1 / (s.omega**2 - omega**2) - 1 / s.omega**2)) @ s.shapes.conj().T + s.static
            exact = sector.phases.direct(k, omega)
            error, n = found + omega**2 * s.second - exact, len(sector.dofs) - 1
            for block in ((slice(n), slice(n)), (slice(n), n)):
                assert np.linalg.norm(error[block]) <= accuracy * np.linalg.norm(exact[block])


def test_an_accuracy_is_judged_as_of_bodies_made_or_read(tmp_path: Path) -> None:
    first = reduced().natural_frequencies(2)[0]
    asked: dict[str, Any] = {"modes": None, "keep": [MODEL.dofs[-1]], "up_to": 76.0 * first, "cache": tmp_path}
    for _ in range(2):
        with raises_fault("nodal diameter 2", says="the receptance of the reduced structure .*keep more modes"):
            reduced(**asked, accuracy=0.9).natural_frequencies(2)
        with pytest.warns(SlipstickWarning, match="nodal diameter 2: the receptance of the reduced structure"):
            reduced(**asked, accuracy=0.9, force=True).natural_frequencies(2)
    many = reduced(modes=20).natural_frequencies(2)
    with pytest.raises(InputError, match="rad/s is a natural frequency to working accuracy"):
        reduced(modes=None, accuracy=1e-3, up_to=many[0]).natural_frequencies(2)


def test_a_wave_and_its_disc_tell_what_three_modes_leave_out() -> None:
    """The estimate of a wave is that of the phases of its orders, a disc's that of all; both stand above the error."""
    sector = reduced(modes=3, pressure="concave")
    wave, disc = sector.travelling_wave(2), sector.mistuned()
    omega, orders = 0.95 * sector.natural_frequencies(2)[0], range(1, 6)

    def judged(structure: Any, loads: Any) -> tuple[Any, list[str]]:
        problem = ss.Problem(
            structure, loads=loads, harmonics=range(6), contacts=ss.ContactPair(
                name="c", contact=ss.FrictionContact(kt=1e6, mu=0.3, normal_load=1.0), tangential=structure.dofs[0],
            ),
        )  # fmt: skip
        return worst_error(problem, (omega, omega)), reduction_warnings(problem, (omega, omega))

    load = ss.Load(shape="pressure", sin=1.0)
    (of_wave, said), (of_disc, also) = judged(wave, load), judged(disc, disc.loads(load, engine_order=2))
    assert of_wave.value <= of_disc.value
    assert [text.partition(" by about")[0] for text in (*said, *also)] == 2 * [
        "the receptance of the reduced structure is wrong"
    ]
    many = reduced(modes=40, pressure="concave").structure
    for m in orders:
        d = wave.phase_number(m)
        few, full = (s.phase_modes(d) for s in (sector.structure, many))
        scale = 1.0 / np.sqrt(np.diag(sector.structure.phase_modes(0).static).real)
        A, B = (
            scale[:, None] * ((s.shapes * (1 / (s.omega**2 - w2) - 1 / s.omega**2)) @ s.shapes.conj().T + s.static
                              + w2 * s.second) * scale
            for s in (few, full) for w2 in [(m * omega) ** 2]
        )  # fmt: skip
        (left_out,) = wave.truncations(m)
        error = np.linalg.norm(A - B) / np.linalg.norm(B)
        assert error <= 1.2 * left_out.error(m * omega) <= 100.0 * max(error, 1e-9)


def test_a_load_on_a_disc_moves_it_as_the_wave() -> None:
    sector = reduced(modes=3, pressure="concave")
    wave, disc, E, w = sector.travelling_wave(2), sector.mistuned(), 2, 0.9 * sector.natural_frequencies(2)[0]
    n, row = len(wave.dofs), np.eye(len(wave.dofs))[:, :1]
    exact = wave.project(row, np.zeros((n, 0)), ["pressure"]).at([1, 2], w)[0][:, 0, 0]
    shapes = [f"pressure@{s}" for s in range(N)]
    parts = disc.project(np.eye(len(disc.dofs))[:, :1], np.zeros((len(disc.dofs), 0)), shapes).at([1, 2], w)[0][:, 0]
    turns = np.exp(-2j * np.pi * E / N * np.outer([1, 2], np.arange(N)))
    assert np.sum(parts * turns, axis=1) == pytest.approx(exact, rel=1e-9, abs=0.0)


def two_blocks(off: float = 0.0) -> ImportedModel:
    """A sector of which the half towards the low face is coarse and the other one fine, glued in the middle."""
    coarse, fine = box((1.0, 0.5, 0.3), (2, 1, 1), "hex20"), box((1.0, 0.5, 0.3), (5, 2, 2), "hex20")
    n, flat = coarse.n_nodes, np.vstack([coarse.nodes, fine.nodes + np.array([0.0, 0.5, 0.0])])
    r, angle = 1.0 + flat[:, 0], 2.0 * np.pi / N * flat[:, 1]
    nodes = np.stack([r * np.cos(angle), r * np.sin(angle), flat[:, 2] + off * flat[:, 1]], axis=1)
    surfaces = {"low": coarse.surfaces["y0"], "low top": coarse.surfaces["y1"]}
    for name, other in (("high", "y1"), ("high bottom", "y0"), ("tip", "x1")):
        surfaces[name] = Surface(faces={kind: part + n for kind, part in fine.surfaces[other].faces.items()})
    blocks = {"hex20": np.vstack([coarse.blocks["hex20"], fine.blocks["hex20"] + n])}
    mesh = Mesh(nodes=nodes, blocks=blocks, surfaces=surfaces)
    held = elastic_model(mesh, ss.models.bladed_sector("coarse").materials["all"], np.flatnonzero(r < 1.0 + 1e-9))
    inner = mesh.surfaces["high bottom"].nodes
    glue = tie_equations(mesh, inner, project(mesh, mesh.surfaces["low top"], nodes[inner]), "glue")
    return replace(held.constrain(glue), source="two blocks")


def test_faces_with_other_numbers_of_nodes_and_the_finer_one_follows_on_whichever_side_it_lies() -> None:
    model, asked = two_blocks(), {"sectors": N, "surface": "tip", "contacts": 2, "modes": 4}
    one = ss.reduced_sector(model, low="low", high="high", **asked)
    other = ss.reduced_sector(model, low="high", high="low", **asked)
    fine, between = len(model.mesh.surfaces["high"].nodes), "of them between its nodes"
    assert f"{fine} nodes of high follow the faces of low by shape functions" in one.notes[-1]
    assert f"{fine} nodes of low follow the faces of high" in other.notes[-1]
    assert between in one.notes[-1]
    assert one.n_dofs == other.n_dofs < model.n_dofs
    for k in range(N // 2 + 1):
        assert np.allclose(one.natural_frequencies(k), other.natural_frequencies(k), rtol=1e-9)
        assert one.complete(k)
    assert one.receptance_error(2, 0.5 * one.natural_frequencies(2)[0]) < 1e-3
    assert ss.reduced_sector(model, low="low", high="high", speed=50.0, **asked).natural_frequencies(1)[0] > 0.0


def test_faces_meshed_differently_that_lie_apart_are_told_or_refused() -> None:
    asked = {"sectors": N, "low": "low", "high": "high", "surface": "tip", "contacts": 2, "modes": 4}
    with pytest.warns(SlipstickWarning, match=r"the faces lie up to 0.006, .* of an edge, apart when turned onto each"):
        told = ss.reduced_sector(two_blocks(off=0.006), **asked)
    assert told.distance == pytest.approx(0.006)
    assert any("a rigid rotation strains the joint" in sentence for sentence in told.warnings)
    with pytest.raises(InputError, match="from the nearest node of low"):
        ss.reduced_sector(two_blocks(off=0.1), **asked)
    with pytest.raises(InputError, match="high: found"):
        ss.reduced_sector(replace(two_blocks(), mesh=None), **{**asked, "surface": None, "keep": ["n30x"]})
