"""ModalStructure against the matrices it comes from, and what it refuses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.case.case import load_case
from slipstick.errors import InputError
from slipstick.structure.matrices import MatrixStructure
from slipstick.structure.modal import LoadShape, ModalStructure, first_modes, modal_number_faults, residual_faults
from slipstick.structure.protocol import Structure

RNG = np.random.default_rng(9)
N = 12
BLADE = Path(__file__).parents[2] / "examples" / "blade_reduced" / "blade_reduced.npz"


def beam():
    """A chain with a loaded tip; its modes mass-normalised."""
    K = 2.0 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1)
    M = np.diag(1.0 + 0.2 * RNG.random(N))
    root = np.diag(1 / np.sqrt(np.diag(M)))
    squared, modes = np.linalg.eigh(root @ K @ root)
    return M, K, np.sqrt(squared), root @ modes


def truncated(kept, *, second=False, **damping):
    """Modal structure of some modes at three dofs with its residual, and the full one."""
    M, K, omega, modes = beam()
    load = RNG.standard_normal(N)
    inverse = np.linalg.inv(K)
    at = [2, 7, 11]
    phi, w = modes[at][:, :kept], omega[:kept]
    grow = inverse @ M @ inverse
    participation = modes[:, :kept].T @ load
    shape = LoadShape(
        participation=participation,
        static_response=(inverse @ load)[at],
        second_response=(grow @ load)[at] - phi @ (participation / w**4) if second else None,
    )
    reduced = ModalStructure(
        omega=w,
        mode_shapes=phi,
        static_compliance=inverse[np.ix_(at, at)],
        second_residual=grow[np.ix_(at, at)] - (phi / w**4) @ phi.T if second else None,
        dofs=["a", "b", "c"],
        load_shapes={"pressure": shape},
        **damping,
    )
    full = MatrixStructure(
        M=M,
        K=K,
        dofs=[f"d{i}" for i in range(N)],
        loss_factor=float(np.max(damping.get("loss_factor", 0.0))),
        load_shapes={"p": load},
    )
    return reduced, full.project(np.eye(N)[:, at], np.eye(N)[:, at], ["p"]), omega


def seen(structure):
    return structure.project(np.eye(3), np.eye(3), structure.load_shapes)


def test_all_modes_equal_the_matrices():
    structure, exact, omega = truncated(N, loss_factor=0.03)
    w = np.linspace(0.1, 2.5, 9) * omega[3]
    for a, b in zip(seen(structure).at([1], w), exact.at([1], w), strict=True):
        np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(seen(structure).static, exact.static, rtol=1e-11)
    assert isinstance(structure, Structure)


@pytest.mark.parametrize("second, order", [(False, 2), (True, 4)])
def test_what_the_modes_miss_falls_with_the_frequency(second, order):
    """Without residual the error is constant; with it order 2, with the second one order 4 in the frequency."""
    structure, exact, omega = truncated(5, second=second)
    w = omega[5] * np.array([0.02, 0.04])
    errors = [np.abs(a - b).max() for a, b in zip(seen(structure).at([1], w)[0], exact.at([1], w)[0], strict=True)]
    assert np.log2(errors[1] / errors[0]) == pytest.approx(order, abs=0.05)
    np.testing.assert_allclose(seen(structure).static, exact.static, rtol=1e-11)


def test_residual_error_falls_with_the_number_of_modes():
    errors = []
    for kept in (2, 4, 6, 8, 10):
        structure, exact, omega = truncated(kept, loss_factor=1e-3)
        w = np.linspace(0.2, 1.5, 7) * omega[0]
        errors.append(np.abs(seen(structure).at([1], w)[0] - exact.at([1], w)[0]).max() / np.abs(exact.static).max())
    assert errors[0] < 0.02
    assert np.all(np.diff(errors) < 0)


@pytest.mark.parametrize("second", [False, True])
def test_frequency_derivative_by_central_differences(second):
    structure, _, omega = truncated(
        6, second=second, loss_factor=0.02 * np.arange(6), damping_ratio=0.01 * np.arange(6.0)[::-1]
    )
    h = 1e-5
    w = np.linspace(0.3, 2.0, 6) * omega[1]
    ahead, behind = seen(structure).at([1], w + h)[0], seen(structure).at([1], w - h)[0]
    slope = seen(structure).at([1], w)[1]
    # truncation h^2/6 A''' ~ 1e-10 / (half bandwidth 0.01)^3 relative to the value, rounding 1e-11
    np.testing.assert_allclose(slope, (ahead - behind) / (2 * h), rtol=1e-5, atol=1e-6 * np.abs(slope).max())


def test_formula_with_damping_written_out():
    structure, _, _ = truncated(4, second=True, loss_factor=0.01, damping_ratio=0.02)
    phi, w0 = structure.mode_shapes, structure.omega
    for w in (0.4, 1.1):
        terms = w0**2 * (1 + 0.01j) + 2j * 0.02 * w0 * w - w * w
        rest = structure.static_compliance - (phi / w0**2) @ phi.T
        expected = (phi / terms) @ phi.T + rest / (1 + 0.01j) + w * w * structure.second_residual / (1 + 0.01j) ** 2
        np.testing.assert_allclose(seen(structure).at([1], w)[0][0, :, :3], expected, rtol=1e-12)


def test_the_loss_factor_of_the_modes_left_out():
    """Against (K (1 + i eta) - w^2 M)^-1 the truncation error is that of the undamped expansion, of order w^6."""
    rng = np.random.default_rng(5)
    n, kept, eta = 12, 5, 0.02
    omega = np.linspace(1.0, 40.0, n)
    phi = np.linalg.qr(rng.normal(size=(n, n)))[0]
    w = 0.7
    full = (phi / (omega**2 * (1 + 1j * eta) - w * w)) @ phi.T
    some = phi[:, kept:]
    structure = ModalStructure(
        omega=omega[:kept], mode_shapes=phi[:, :kept], static_compliance=(phi / omega**2) @ phi.T, loss_factor=eta,
        dofs=[f"d{i}" for i in range(n)], second_residual=(some / omega[kept:] ** 4) @ some.T,
    )  # fmt: skip
    value = structure.project(np.eye(n), np.eye(n)).at([1], w)[0][0]
    np.testing.assert_allclose(value, full, atol=1.5 * w**4 / omega[kept] ** 6)


def test_directions_are_combined():
    structure, _, _ = truncated(5, second=True, loss_factor=0.01)
    rows, columns = RNG.standard_normal((3, 2)), RNG.standard_normal((3, 4))
    all_value, _ = seen(structure).at([1], 0.7)
    value, _ = structure.project(rows, columns, ["pressure"]).at([1], 0.7)
    np.testing.assert_allclose(value[0, :, :4], rows.T @ all_value[0, :, :3] @ columns, rtol=1e-11)
    np.testing.assert_allclose(value[0, :, 4], rows.T @ all_value[0, :, 3], rtol=1e-11)


def test_time_equations_have_the_same_receptance():
    structure, _, omega = truncated(5, damping_ratio=0.03)
    rows, columns = RNG.standard_normal((3, 2)), RNG.standard_normal((3, 1))
    equations = structure.time_equations(rows, columns, ["pressure"])
    w = np.linspace(0.2, 2.0, 5) * omega[0]
    value, _ = structure.project(rows, columns, ["pressure"]).at([1], w)
    for each, a in zip(w, value[:, 0], strict=True):
        Z = equations.K - each**2 * equations.M + 1j * each * equations.C
        np.testing.assert_allclose(
            equations.rows @ np.linalg.solve(Z, equations.columns) + equations.feedthrough, a, rtol=1e-11
        )
    static = equations.rows @ np.linalg.solve(equations.K, equations.columns) + equations.feedthrough
    np.testing.assert_allclose(static, structure.project(rows, columns, ["pressure"]).static, rtol=1e-11)


def test_hysteretic_damping_in_time_has_the_same_value_at_each_resonance():
    structure, _, _ = truncated(5, loss_factor=0.004)
    equations = structure.time_equations(np.eye(3), np.eye(3))
    np.testing.assert_allclose(np.diag(equations.C), 0.004 * structure.omega)


def test_hysteretic_damping_in_time_may_have_the_same_value_at_one_frequency():
    structure, _, _ = truncated(5, loss_factor=[0.004, 0.0, 0.02, 0.01, 0.004], damping_ratio=0.01)
    equations = structure.time_equations(np.eye(3), np.eye(3), damping_at=0.7)
    Z = equations.K - 0.7**2 * equations.M + 0.7j * equations.C
    value, _ = structure.project(np.eye(3), np.eye(3)).at([1], 0.7)
    answer = equations.rows @ np.linalg.solve(Z, equations.columns) + equations.feedthrough
    np.testing.assert_allclose(answer, value[0], rtol=1e-11)


def test_without_compliance_the_modes_are_all_there_is():
    structure = ModalStructure(omega=[2.0], mode_shapes=[[0.5], [1.0]], dofs=["a", "b"])
    np.testing.assert_allclose(structure.static_compliance, [[0.0625, 0.125], [0.125, 0.25]])
    assert structure.project(np.eye(2), np.eye(2)).at([1], 0.0)[0][0] == pytest.approx(structure.static_compliance)


def test_a_projection_is_part_of_a_larger_one():
    omega, phi = 1 + np.arange(40.0), RNG.standard_normal((9, 40))
    structure = ModalStructure(omega=omega, mode_shapes=phi, dofs=list("abcdefghi"), loss_factor=0.01)
    value, slope = structure.project(np.eye(9), np.eye(9)).at([3.3, 8.0], 1.0)
    small = structure.project(np.eye(9)[:, :1], np.eye(9)[:, :2]).at([3.3, 8.0], 1.0)
    np.testing.assert_allclose(value[:, :1, :2], small[0], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(slope[:, :1, :2], small[1], rtol=1e-12, atol=1e-15)


def test_modes_that_are_not_mass_normalised_are_noticed():
    _, K, omega, modes = beam()
    with raises_fault("static_compliance", says="mass-normalised"):
        ModalStructure(
            omega=omega[:5],
            mode_shapes=1000 * modes[:, :5],
            static_compliance=np.linalg.inv(K),
            dofs=[str(i) for i in range(N)],
        )


GOOD = {
    "omega": np.array([1.0, 2.0]),
    "mode_shapes": np.ones((3, 2)),
    "static_compliance": 1.25 * np.ones((3, 3)) + np.eye(3),
    "dofs": "abc",
}


@pytest.mark.parametrize(
    "change, words",
    [
        ({"omega": [1.0, 0.0]}, "omega: the smallest entry is 0"),
        ({"omega": [1.0, np.nan]}, "omega: some entries are not finite"),
        ({"omega": []}, "at least one mode"),
        ({"mode_shapes": np.ones((2, 3))}, r"mode_shapes: found shape \(2, 3\); expected \(3, 2\)"),
        ({"static_compliance": np.eye(2)}, "static_compliance: found shape"),
        ({"static_compliance": np.triu(np.ones((3, 3)))}, "static_compliance: not symmetric"),
        ({"second_residual": np.ones(3)}, "second_residual: found shape"),
        ({"loss_factor": -0.1}, "loss_factor: the smallest entry is -0.1"),
        ({"damping_ratio": [0.1, 0.1, 0.1]}, "damping_ratio: found shape"),
        ({"dofs": ["a", "b", "b"]}, "more than once"),
        ({"load_shapes": {"p": LoadShape(participation=[1.0], static_response=[1.0] * 3)}}, "'p', participation"),
        ({"load_shapes": {"p": LoadShape(participation=[1.0] * 2, static_response=[1.0])}}, "'p', static_response"),
    ],
)
def test_faults_are_said_in_a_sentence(change, words):
    given = GOOD | {"dofs": list("abc")} | change
    with pytest.raises(InputError, match=words):
        ModalStructure(**given)


def test_all_faults_at_once_and_unknown_names():
    with pytest.raises(InputError) as error:
        ModalStructure(omega=[1.0, -2.0], mode_shapes=np.ones((2, 2)), dofs=list("abb"), loss_factor=-1.0)
    assert len(error.value.sentences) == 4
    structure = ModalStructure(**GOOD | {"dofs": list("abc")})
    with raises_fault("load shape", "wind", statement="is unknown"):
        structure.project(np.eye(3), np.eye(3), ["wind"])
    with raises_fault("columns", found="shape (3,)"):
        structure.project(np.eye(3), np.ones(3))


def test_arrays_from_a_file(tmp_path):
    arrays = {
        "omega": [10.0, 20.0],
        "mode_shapes": np.ones((6, 2)),
        "static_compliance": np.eye(6),
        "load_participation": [1.0, 2.0],
        "static_load_response": np.ones(6),
        "coordinates": np.zeros((2, 3)),
        "thermal_influence": np.eye(2),
    }
    np.savez(tmp_path / "model.npz", **arrays)
    structure = ModalStructure.load(tmp_path / "model.npz", loss_factor=1e-3, load="pressure")
    assert structure.dofs == ("n1x", "n1y", "n1z", "n2x", "n2y", "n2z")
    assert structure.load_shapes == ("pressure",)
    with raises_fault("dofs", statement="is missing"):
        ModalStructure.from_arrays({"omega": [1.0], "mode_shapes": np.ones((5, 1))})
    assert ModalStructure.from_arrays(arrays | {"dofs": list("uvwxyz")}).dofs[1] == "v"
    with raises_fault("modal arrays", statement="'omega' is missing"):
        ModalStructure.from_arrays({"mode_shapes": np.eye(2)})
    with raises_fault("modal arrays", says="static_load_response"):
        ModalStructure.from_arrays({k: v for k, v in arrays.items() if k != "static_load_response"})


def test_files_that_are_not_plain_arrays(tmp_path):
    (tmp_path / "text.npz").write_text("not an archive")
    np.savez(tmp_path / "objects.npz", omega=np.array([{"a": 1}], dtype=object))
    for name, said in (
        ("text.npz", "not a readable .npz file"),
        ("objects.npz", "holds Python objects"),
        ("missing.npz", "there is no such file"),
    ):
        with pytest.raises(InputError, match=said):
            ModalStructure.load(tmp_path / name)


def test_reduced_blade():
    structure = ModalStructure.load(BLADE, loss_factor=1e-3, load="pressure")
    assert structure.natural_frequencies[0] == pytest.approx(1315.14, abs=0.01)
    rows = np.eye(24)[:, [1]]
    grid = structure.natural_frequencies[0] * (1 + np.linspace(-1e-4, 1e-4, 201))
    amplitude = 2.0 * np.abs(structure.project(rows, np.zeros((24, 0)), ["pressure"]).at([1], grid)[0][:, 0, 0, 0])
    assert amplitude.max() == pytest.approx(3.470e-3, rel=3e-4)  # the frictionless amplitude in its README


SHAPE = LoadShape(participation=[1.0], static_response=[1.0, 2.0])


def test_real_arrays_have_no_faults_and_each_complex_one_has_one():
    good = {"omega": [1.0], "mode_shapes": [[1.0], [2.0]], "second_residual": None}
    assert modal_number_faults(good, {"wind": SHAPE}) == []
    assert len(modal_number_faults(good | {"omega": [1j], "mode_shapes": [[1j], [2.0]]}, {"wind": SHAPE})) == 2
    (fault,) = modal_number_faults({}, {"wind": [1.0]})
    assert "expected a structure.modal.LoadShape" in str(fault)


def test_a_residual_is_a_sum_of_squares():
    a = np.random.default_rng(0).normal(size=(4, 2))
    square = a @ a.T
    assert residual_faults("R", square, square.diagonal()) == []
    assert residual_faults("R", square - 1e-6 * np.diag(square.diagonal()), square.diagonal()) == []
    (fault,) = residual_faults("R", -square, square.diagonal())
    assert "modes only add compliance" in str(fault)


@pytest.mark.parametrize("dofs", [3, ["x", "x"], []])
def test_wrong_names_hide_no_other_fault(dofs: Any) -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.ModalStructure(
            omega=[-1.0, 2.0], mode_shapes=[[1.0, np.nan], [0.0, 1.0]], static_compliance=np.eye(2), dofs=dofs
        )
    first, *others = caught.value.sentences
    assert first.startswith("dofs: ")
    assert [s.split(":")[0] for s in others] == ["omega", "mode_shapes"]


def test_an_array_of_texts_hides_no_other_fault() -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.ModalStructure(
            omega=["a", "b"], mode_shapes=np.ones((2, 3)), static_compliance=[[1.0, 2.0], [0.0, 1.0]], dofs=["x", "y"],
            loss_factor=-0.1,
        )  # fmt: skip
    assert sorted(s.split(":")[0] for s in caught.value.sentences) == ["loss_factor", "omega", "static_compliance"]


CASE = """format = 1
harmonics = "0..3"
[structure]
kind = "modal"
file = "m.npz"
{more}
[[contact]]
name = "a"
tangential = "{dof}"
kt = 1.0
mu = 0.3
normal_load = 1.0
rubbing = {{ velocity = 1.0 }}
[response]
from = 0.5
to = 1.5
"""


def write(folder: Path, **more: object) -> Path:
    rng = np.random.default_rng(5)
    shapes, omega = rng.standard_normal((3, 8)), np.linspace(1.0, 50.0, 8)
    static = (shapes / omega**2) @ shapes.T
    np.savez(folder / "m.npz", omega=omega, mode_shapes=shapes, static_compliance=0.5 * (static + static.T), **more)
    return folder / "m.npz"


def receptance(structure: ss.ModalStructure) -> np.ndarray:
    return structure.project(np.eye(3), np.eye(3)).at([1], [0.3, 2.0])[0]


def test_dropped_modes_are_added_to_the_second_residual() -> None:
    shapes, omega = np.arange(6.0).reshape(2, 3) + 1, np.array([1.0, 2.0, 4.0])
    whole = {"omega": omega, "mode_shapes": shapes, "second_residual": np.zeros((2, 2))}
    kept = first_modes(whole, 1)
    np.testing.assert_allclose(kept["second_residual"], (shapes[:, 1:] / omega[1:] ** 4) @ shapes[:, 1:].T)
    assert kept["omega"].tolist() == [1.0]


def test_python_and_case_file_read_the_same_structure(tmp_path: Path) -> None:
    path = write(tmp_path, loss_factor=0.01)
    (tmp_path / "case.toml").write_text(CASE.format(more="modes = 6", dof="n1y"))
    case, script = load_case(tmp_path / "case.toml").structure, ss.ModalStructure.load(path, modes=6)
    assert case.dofs == script.dofs == ("n1x", "n1y", "n1z")
    np.testing.assert_array_equal(receptance(case), receptance(script))
    whole = ss.ModalStructure.load(path)
    np.testing.assert_allclose(receptance(script), receptance(whole), rtol=1e-4)


def test_names_in_the_file_are_taken(tmp_path: Path) -> None:
    """By the case file too, which took no notice of them."""
    path = write(tmp_path, loss_factor=0.01, dofs=["tip", "root", "disc"])
    (tmp_path / "case.toml").write_text(CASE.format(more="", dof="tip"))
    assert load_case(tmp_path / "case.toml").structure.dofs == ("tip", "root", "disc")
    assert ss.ModalStructure.load(path, dofs=["a", "b", "c"]).dofs == ("a", "b", "c")
    with raises_fault("dofs", found="1 names", expected="3, one for each row of mode_shapes"):
        ss.ModalStructure.load(path, dofs=["a"])
    with raises_fault("modes", found="9", expected="1 to 8, the modes in the file"):
        ss.ModalStructure.load(path, modes=9)
