"""Jacobian backends: the forms of the Jacobian of the balance and of its receptances, dense or iterative."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np
from scipy.linalg.blas import dgemm

from slipstick.balance.compliance import Compliance, FactoredCompliance, sums
from slipstick.balance.contact_jacobian import ContactJacobian
from slipstick.balance.layout import PortPair, paired
from slipstick.balance.states import power_rows, state_columns
from slipstick.contact.law import add_to
from slipstick.errors import Fault, InputError
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.state.contact_state import Carried
from slipstick.structure.receptance import Receptance
from slipstick.typing import Array, BoolArray

if TYPE_CHECKING:
    from slipstick.balance.balance import Balance
    from slipstick.balance.layout import Tangents

DENSE_UP_TO = 500
"""Unknowns up to which a dense Jacobian costs less than an iterative one. Chains of 840: 8.3 against 4.8 ms a point.

A bolted lap of 35 planar contacts, 1188 unknowns: 33 s and 236 points against 23 s and 240.
"""

MOST_UNKNOWNS = {"dense": 12_000, "iterative": 500_000}
"""Unknowns that fit into memory: a matrix of 1.2 GB, or the modes of that many ports."""

AnyCompliance = Compliance | FactoredCompliance


@runtime_checkable
class JacobianBackend(Protocol):
    """Makes Jacobians and their receptances; ``options={"jacobian": ...}`` takes one of a user's own."""

    @property
    def name(self) -> str:
        """Its name in results."""
        ...

    def compliance(
        self, receptance: Receptance, orders: Array, omega: float, along: Mapping[str, float] | None
    ) -> AnyCompliance:
        """Receptances at the harmonics of ``omega``, and their derivative by omega or along structural parameters."""
        ...

    def jacobian(
        self, balance: Balance, tangents: Tangents, compliance: AnyCompliance, states: Sequence[Carried] = ()
    ) -> Jacobian:
        """``I + A dF/dX`` of tangents by batch, with the terms of contact states."""
        ...


class DenseBackend:
    """All entries, factorised: for few contacts, and for structures known by their receptances alone."""

    name = "dense"

    def compliance(
        self, receptance: Receptance, orders: Array, omega: float, along: Mapping[str, float] | None
    ) -> AnyCompliance:
        """With all entries."""
        return Compliance(receptance, orders, omega, along)

    def jacobian(
        self, balance: Balance, tangents: Tangents, compliance: Any, states: Sequence[Carried] = ()
    ) -> Jacobian:
        """With all entries, written at their first use."""
        entries = _Dense(balance, tangents, compliance, states)
        return DenseJacobian(entries.write, balance.size, None if states else entries.product)


class IterativeBackend:
    """Products alone, solved by GMRES: for many contacts on a structure known by its modes."""

    name = "iterative"

    def compliance(
        self, receptance: Any, orders: Array, omega: float, along: Mapping[str, float] | None
    ) -> AnyCompliance:
        """By its modes."""
        return FactoredCompliance(receptance.factors(orders, omega, along))

    def jacobian(
        self, balance: Balance, tangents: Tangents, compliance: Any, states: Sequence[Carried] = ()
    ) -> Jacobian:
        """By its products."""
        return ContactJacobian(balance, tangents, compliance, states)


class _Dense:
    """``I + A dF/dX`` with the terms of contact states, to be written or multiplied with."""

    def __init__(self, balance: Balance, tangents: Tangents, compliance: Compliance, states: Sequence[Carried]) -> None:
        self._balance, self._tangents, self._compliance, self._states = balance, tangents, compliance, states
        self._known: list[tuple[Array, PortPair]] | None = None

    def _coupled(self) -> list[tuple[Array, PortPair]]:
        """Tangents between ports that some element has, as compiled code takes them, with their places."""
        if self._known is None:  # no cached_property: it is read once in most Jacobians
            self._known = []
            for k, by_ports in enumerate(self._tangents):
                coupled = self._balance.batches[k].coupled
                for pair, tangent in _anchored(self._balance, k, by_ports).items():
                    if pair in coupled:
                        fit = tangent if tangent.flags.carray else np.array(tangent, dtype=float, order="C")
                        self._known.append((fit, coupled[pair]))
        return self._known

    def write(self, out: Array) -> BoolArray:
        """Write all entries into the first rows and columns of ``out``, in Fortran order; marks the filled columns."""
        N, add = self._balance.size, sums().add_products
        out.T.reshape(-1)[: N * (len(out) + 1) : len(out) + 1] = 1.0
        filled = np.zeros(len(out), bool)
        for tangent, places in self._coupled():
            add(self._compliance.value, tangent, *places, out.T, filled)
        for carried in self._states:
            rows = power_rows(self._balance, carried)
            filled[:N] |= rows.any(axis=0)
            left, right = np.zeros((carried.values.size, len(out))), np.zeros((carried.values.size, len(out)))
            left[:, :N], right[:, :N] = state_columns(self._balance, carried, self._compliance).T, rows
            dgemm(1.0, left.T, right.T, 1.0, out, trans_b=True, overwrite_c=True)
        return filled

    def product(self, x: Array) -> Array:
        """Product with x (N,), without contact states."""
        motion = x.reshape(self._balance.n_ports, -1)
        forces = np.zeros(motion.shape)
        for tangent, places in self._coupled():
            sums().add_force_changes(tangent, *places, motion, forces)
        return x + self._compliance.answer(paired(forces))


def _anchored(
    balance: Balance, number: int, tangents: Mapping[tuple[int, int], Array]
) -> Mapping[tuple[int, int], Array]:
    """Tangents of one batch minus the springs of the balance: ``i k``, and those that support it in harmonic 0."""
    k, support_springs = balance.springs, balance.support_springs
    if k is None and support_springs is None:
        return tangents
    batch, anchored = balance.batches[number], dict(tangents)
    sine, cosine = np.arange(2, balance.L, 2), np.arange(1, balance.L, 2)
    for i, port in enumerate(batch.ports):
        anchor = np.zeros((batch.count, balance.L, balance.L))
        rows, first = np.unique(np.arange(balance.n_ports)[port.rows], return_index=True)  # a spring for each port
        members = np.arange(batch.count)[port.members][first]
        if support_springs is not None:
            anchor[members, 0, 0] = -support_springs[rows]
        if k is not None:
            springs = k[rows]
            anchor[np.ix_(members, sine, cosine)] = np.einsum("c,sk->csk", springs, np.eye(sine.size))
            anchor[np.ix_(members, cosine, sine)] = -np.einsum("c,sk->csk", springs, np.eye(sine.size))
        add_to(anchored, (i, i), anchor)
    return anchored


BACKENDS: Mapping[str, JacobianBackend] = {backend.name: backend for backend in (DenseBackend(), IterativeBackend())}


def backend_of(choice: JacobianBackend | str, receptance: Receptance, unknowns: int) -> JacobianBackend:
    """The backend chosen; with "auto" the one that costs least.

    Raises
    ------
    InputError
        If modes are needed and the structure is not known by them, or there are more unknowns than memory holds.
    """
    modal = receptance.summed
    if choice == "iterative" and not modal:
        raise InputError(
            'options, jacobian: found "iterative", but the structure is not known by its modes; give "dense", or the '
            "structure as modes (ss.ModalStructure, ss.reduce)"
        )
    if choice == "auto":
        choice = "iterative" if modal and unknowns > DENSE_UP_TO else "dense"
    if isinstance(choice, str) and unknowns > MOST_UNKNOWNS[choice]:
        raise InputError(size_fault(unknowns, choice))
    return BACKENDS[choice] if isinstance(choice, str) else choice


def size_fault(unknowns: int, backend: str) -> Fault:
    """The fault of too many unknowns."""
    modes = ", or give the structure as modes (reduce it)" if backend == "dense" else ""
    return Fault(
        ("harmonics",), f"contacts and harmonics make {unknowns} unknowns",
        expected=f"at most {MOST_UNKNOWNS[backend]}",
        remedy=f"keep fewer harmonics or contacts{modes}",
    )  # fmt: skip
