"""Newton's method at the hot resonance: scaled corrections with the consistent tangent, and with mu(T) frozen in it.

python examples/blade/newton_history.py [--cache FOLDER]
"""

import argparse
from pathlib import Path

import numpy as np
from shrouded_blade import DEFAULT_CACHE, OUTPUT, RANGE, reduced_blade, rubbed

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.compliance import Compliance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.balance.states import power_rows, state_columns
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.newton import NewtonOptions, newton_at


class FrozenSystem(FrequencySystem):
    """The balance with a tangent that leaves out what heat does to the friction coefficient."""

    def evaluate(self, x, parameter, context=None):
        found = super().evaluate(x, parameter, context)
        [heat] = found.detail.states
        compliance, tangent = self.balance.compliance(parameter), found.jacobian
        assert isinstance(compliance, Compliance) and isinstance(tangent, DenseJacobian)  # noqa: PT018
        columns = state_columns(self.balance, heat, compliance)
        return found._replace(jacobian=DenseJacobian(tangent.matrix - columns @ power_rows(self.balance, heat)))


def corrections(branch, system=FrequencySystem, *, disturbed=0.05, seed=1):
    """Corrections over the solution's norm at the largest amplitude of a hot branch, from a disturbed solution."""
    at = int(np.argmax(branch.dataset.amplitude.sel(dof=OUTPUT).values))
    point = branch.dataset.isel(point=at)
    solution = np.concatenate([point.contact_tangential.values, point.contact_normal.values]).ravel()
    start = solution * (1 + disturbed * np.random.default_rng(seed).standard_normal(solution.size))
    result = newton_at(
        system(Balance(branch.problem), branch.problem.inputs),
        start,
        float(point.omega),
        options=NewtonOptions(tolerance=1e-12, max_iterations=60),
        scale=float(np.linalg.norm(solution)),
    )
    if not np.allclose(result.x, solution, rtol=0, atol=1e-7 * np.abs(solution).max()):
        raise RuntimeError("Newton's method went to another solution")
    return np.array(result.corrections)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Newton's method at the hot resonance")
    parser.add_argument("--cache", type=Path, default=DEFAULT_CACHE)
    hot = rubbed(reduced_blade("small", cache=parser.parse_args().cache), 20, 2.0, hot=True)
    branch = ss.forced_response(hot, omega=RANGE, peaks_of=OUTPUT)
    for name, system in (("consistent", FrequencySystem), ("mu(T) frozen", FrozenSystem)):
        print(f"{name:13s}", " ".join(f"{value:.1e}" for value in corrections(branch, system)))
