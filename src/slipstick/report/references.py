"""The linear limits beside a response: without contact and with every contact stuck, where the problem is known."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from slipstick.report.encoding import Indices, packed

if TYPE_CHECKING:
    from slipstick.branch import Branch

_MOST_PORTS = 100
"""Beyond, a limit is a large system at every frequency, and takes longer than the page is worth."""
_SECONDS = 0.2
"""About the time each limit may take."""


def references_of(branch: Branch, kept: Indices) -> list[dict[str, Any]]:
    """Label, frequencies and amplitudes (n, dofs) of each limit; none where the problem is not known, or is large."""
    from slipstick.analysis.curve.linear import linear_references
    from slipstick.balance.ports import Balance

    problem, dataset = branch.problem, branch.table
    if problem is None or not len(branch) or not problem.contacts:
        return []
    balance = Balance(problem)
    if balance.n_ports > _MOST_PORTS:
        return []
    omega = dataset["omega"].to_numpy()
    limits = linear_references(balance, (float(omega.min()), float(omega.max())), seconds=_SECONDS)
    return [
        {
            "label": label,
            "omega": packed(limit.table["omega"].to_numpy(), "f8"),
            "amplitude": packed(limit.table["amplitude"].to_numpy()[:, kept]),
        }
        for label, limit in limits
    ]
