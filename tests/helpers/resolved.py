"""Derivatives of solutions by solving again with a parameter moved: the truth that exact ones are held against."""

from __future__ import annotations

import numpy as np

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.results.measures import amplitude
from slipstick.results.record import Point, Recorder, contact_states
from slipstick.solve.newton import NewtonOptions, newton

Array = np.ndarray

_NEWTON = NewtonOptions(tolerance=1e-13, max_iterations=40)


def solved(problem: ss.Problem, omega: float, x: Array, dof: str, near: Array | None = None) -> dict[str, float]:
    """Amplitude, mean, power and highest temperature of the solution next to ``x`` (N,)."""
    balance = Balance(problem)
    system = FrequencySystem(balance, problem.inputs)
    found = newton(lambda z: system.evaluate(z, omega, near), x, options=_NEWTON, scale=float(np.linalg.norm(x)) or 1.0)
    assert found.correction_norm < 1e-9
    point = Point.at(found.evaluation.detail, x=found.x, residual=0.0, iterations=0, kind="", parameter=0.0, peak_of="")
    record = Recorder(balance).record(point)
    d = problem.outputs.index(dof)
    states = found.evaluation.detail.states
    return {
        "amplitude": float(amplitude(balance.harmonics, record["displacement"][d]).value),
        "mean": float(record["mean"][d]),
        "dissipated_power": float(np.sum(record["dissipated_power"])),
        "temperature": float(states[0].values.max()) if states else np.nan,
    }


def resolved(branch: ss.Branch, point: int, name: str, dof: str, step: float = 1e-5) -> dict[str, float]:
    """Central differences of order four of the same, by a parameter; ``step`` is relative."""
    problem = branch.problem_at(point)
    data = branch.table
    omega, x = float(data["omega"].to_numpy()[point]), branch.guess(point).reshape(-1)
    near = contact_states(data, Balance(problem), point)
    value = problem.parameter(name)
    h = step * (abs(value) or 1.0)
    forward = value == 0.0 and name in ("loss_factor", "damping")  # never below 0
    places, weights = ((0, 1, 2, 3, 4), (-25, 48, -36, 16, -3)) if forward else ((1, -1, 2, -2), (8, -8, -1, 1))
    at = [solved(problem.at_parameter(name, value + k * h), omega, x, dof, near) for k in places]
    return {key: sum(w * found[key] for w, found in zip(weights, at, strict=True)) / (12 * h) for key in at[0]}


def assert_sensitive(branch: ss.Branch, names: list[str], dof: str, tolerance: float = 1e-6) -> None:
    """The exact derivatives at the first point are those of solutions found again, at some step of four."""
    found, d = branch.sensitivity(names, dof), branch.dataset.isel(point=0)
    size = float(d.amplitude.sel(dof=dof)) + abs(float(d["mean"].sel(dof=dof)))
    scales = {"amplitude": size, "mean": size, "temperature": 1.0}
    scales["dissipated_power"] = float(np.abs(d.dissipated_power).sum()) + float(
        np.abs(branch.problem.inputs.P).max() * d.omega * size
    )
    for name in names:
        unit = abs(float(found.value.sel(parameter=name))) or 1.0
        exact = {q: float(found[q].sel(parameter=name)[0]) for q in set(scales) & set(found)}
        left = {q: tolerance * max(scales[q] / unit, abs(value)) for q, value in exact.items()}
        for step in (1e-5, 1e-6, 1e-4, 1e-7):
            other = resolved(branch, 0, name, dof, step)
            left = {q: bound for q, bound in left.items() if not abs(other[q] - exact[q]) <= bound}
            if not left:
                break
        assert not left, (name, {q: exact[q] for q in left})
