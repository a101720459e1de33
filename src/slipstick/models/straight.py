"""Planar contacts whose motion is straight enough for the exact element of one direction."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from slipstick.analysis.curve.linear import LinearLimit, frequencies_of, rows_of, tops
from slipstick.balance.balance import Balance
from slipstick.balance.contacts import ContactPair
from slipstick.balance.problem import Problem
from slipstick.contact.friction import FrictionContact
from slipstick.contact.planar import PlanarFrictionContact
from slipstick.contact.rubbing import SECOND, RubbingMotion
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, names, number, one, shown, suggestion, warn
from slipstick.typing import Array, Frequency

STRAIGHT = 0.2
"""Motion across the direction over that along it, in the linear response, up to which one direction is enough: the
amplitude along it is wrong by less than 1 % (docs/which-law.md)."""
_GRID, _ROUNDS, _NEARER = 201, 5, 9


def straight_contacts(
    problem: Problem,
    *,
    omega: tuple[Frequency, Frequency],
    contacts: Iterable[str] | None = None,
    threshold: float = STRAIGHT,
) -> Problem:
    """The problem with one-directional contacts in place of those planar ones whose motion is nearly straight.

    Measured in the linear response: largest motion across ``tangential`` over the largest one along it, within a range
    of frequencies, with all contacts stuck, with all free, and with all stuck along ``tangential`` alone. A contact
    stays planar where one of the three is above the threshold, where nothing moves it, or where it rubs along the
    second direction. One that does not has neither friction nor stiffness across any more.

    Parameters
    ----------
    problem
        With contacts of ``PlanarFrictionContact``; others stay as they are.
    omega
        The first and the last frequency of interest, rad/s.
    contacts
        Names of the planar contacts that may become one-directional; None: all of them.
    threshold
        The ratio up to which a motion counts as straight, >= 0. At 0.2 the largest amplitude of an oscillator along
        ``tangential`` is wrong by less than 1 %; the error grows with the square of the ratio.

    Raises
    ------
    InputError
        For values of another kind, or a name that is not that of a planar contact.

    Warns
    -----
    SlipstickWarning
        How many contacts are planar, and the threshold.

    Examples
    --------
    >>> import warnings
    >>> import slipstick as ss
    >>> warnings.simplefilter("ignore", ss.SlipstickWarning)
    >>> structure = ss.MatrixStructure(M=[[1.0, 0.0], [0.0, 1.0]], K=[[40.0, 0.0], [0.0, 40.0]], dofs=["x", "y"])
    >>> law = ss.PlanarFrictionContact(kt=100.0, mu=0.3, normal_load=8.0)
    >>> pair = ss.ContactPair(name="foot", contact=law, tangential=("x", "y"))
    >>> problem = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=1.0), harmonics=range(4))
    >>> straight_contacts(problem, omega=(5.0, 6.0)).contacts[0].contact
    FrictionContact(kt=100.0, mu=0.3, normal_load=8.0)
    """
    new, sentence = straightened(problem, omega, contacts, threshold)
    warn([sentence])
    return new


def straightened(problem: Problem, omega: object, contacts: object, threshold: object) -> tuple[Problem, str]:
    """The problem, and the sentence that says what was chosen."""
    checks = Gathering()
    checks.take(one, "problem", problem, Problem, "an ss.Problem")
    ends = checks.take(frequencies_of, omega, problem.units if isinstance(problem, Problem) else None)
    most = checks.take(number, "threshold", threshold)
    if most is not None and most < 0:
        checks.faults.append(Fault("threshold", found=shown(most), expected="a ratio >= 0"))
    if ends is not None and ends.size != 2:
        checks.faults.append(Fault("omega", found=shown(omega), expected="two frequencies, the first and the last"))
    checks.end()
    assert ends is not None
    assert most is not None
    chosen = _chosen(problem, contacts)
    ratios = _ratios(problem, float(ends.min()), float(ends.max()))
    pairs, planar, count = [], 0, 0
    for pair in problem.contacts:
        if pair.name in chosen:
            keep = max(ratios[name] for name in pair.elements) > most or _rubs_across(pair)
            count, planar = count + len(pair), planar + len(pair) * keep
            pair = pair if keep else _one_directional(pair)
        pairs.append(pair)
    sentence = (
        f"{planar} of {count} contacts are planar, those whose motion across the first direction is more than {most:g} "
        "of that along it in the linear response"
    )
    if planar < count:
        sentence += "; the others have neither friction nor stiffness across it"
    return replace(problem, contacts=pairs), sentence


def _chosen(problem: Problem, contacts: object) -> set[str]:
    """Names of planar contacts; raises InputError for others."""
    planar = [
        pair.name
        for pair in problem.contacts
        if isinstance(pair.contact, PlanarFrictionContact) and "second" in pair.given and "tangential" in pair.given
    ]
    if contacts is None:
        return set(planar)
    wanted = names("contacts", contacts, "names of planar contacts, or None")
    wrong = [name for name in wanted if name not in planar]
    if wrong:
        gone = f"there is no planar contact {shown(wrong[0])}"
        raise InputError(Fault("contacts", gone, remedy=suggestion(wrong[0], planar)))
    return set(wanted)


def _rubs_across(pair: ContactPair) -> bool:
    return any(name.startswith(SECOND) and np.any(value) for name, value in pair.rubbing.components())


def _one_directional(pair: ContactPair) -> ContactPair:
    """The same contact without its second direction."""
    law, rubbing = pair.contact, pair.rubbing
    assert isinstance(law, PlanarFrictionContact)
    contact = FrictionContact(kt=law.kt, mu=law.mu, kn=law.kn, gap=law.gap)
    for given in ("_scaled", "_loaded"):  # which of its parameters were given
        object.__setattr__(contact, given, getattr(law, given))
    return ContactPair(
        name=pair.name,
        contact=contact,
        tangential=pair.tangential,
        normal=pair.normal,
        ports={port: d for port, d in (pair.ports or {}).items() if port != "second"} or None,
        rubbing=RubbingMotion(
            velocity=rubbing.velocity, velocity_per_omega=rubbing.velocity_per_omega, cos=rubbing.cos, sin=rubbing.sin,
            normal_cos=rubbing.normal_cos, normal_sin=rubbing.normal_sin,
        ),
    )  # fmt: skip


def _ratios(problem: Problem, low: float, high: float) -> dict[str, float]:
    """Largest motion across over the largest along, of every planar contact by name; the largest of three states."""
    balance = Balance(problem)
    along: list[int] = []
    across: list[int] = []
    elements: list[str] = []
    for batch in balance.batches:
        if isinstance(batch.law, PlanarFrictionContact):
            first, second = rows_of(balance, batch)[:2]
            along, across = [*along, *first], [*across, *second]
            elements += [problem.contacts[p].elements[k] for p, k in batch.members]
    both = (np.array(along, dtype=int), np.array(across, dtype=int))
    free, stuck, held = (LinearLimit(balance, state) for state in ("free", "stuck", "stuck"))
    there = both[1][both[1] >= 0]
    held.stiffness[there], held.constant[there] = 0.0, 0.0
    ratios = [_ratio_of(limit, both, low, high) for limit in (free, stuck, held)]
    return dict(zip(elements, np.max(ratios, axis=0), strict=True))


def _ratio_of(limit: LinearLimit, rows: tuple[Array, Array], low: float, high: float) -> Array:
    """Largest second motion of each contact over its first, (n,), refined at the peaks; inf without a first."""
    known = np.asarray(limit.balance.problem.structure.natural_frequencies, dtype=float)
    new = np.concatenate([np.linspace(low, high, _GRID), known[(known > low) & (known < high)]])
    w, sizes = np.empty(0), np.empty((2, 0, rows[0].size))
    for _ in range(_ROUNDS):
        new = np.setdiff1d(new, w)
        if not new.size:
            break
        with np.errstate(divide="ignore", invalid="ignore"):  # an undamped structure at its natural frequencies
            moved = np.sqrt(np.sum(limit.ports(new)[:, :, 1:] ** 2, axis=2))
        bounded = np.isfinite(moved).all(axis=1)
        found = np.stack([np.where(row >= 0, moved[bounded][:, row], 0.0) for row in rows])
        w, sizes = np.concatenate([w, new[bounded]]), np.concatenate([sizes, found], axis=1)
        order = np.argsort(w)
        w, sizes = w[order], sizes[:, order]
        highest = {int(k) for total in np.linalg.norm(sizes, axis=2) for k in tops(total)}
        near = [np.linspace(w[max(k - 1, 0)], w[min(k + 1, w.size - 1)], _NEARER) for k in sorted(highest)]
        new = np.concatenate([w[:0], *near])
    first, second = sizes.max(axis=1, initial=0.0)
    return np.divide(second, first, out=np.full_like(first, np.inf), where=first > 0.0)
