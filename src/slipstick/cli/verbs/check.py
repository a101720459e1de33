"""The verb ``check``: what a case describes, what is suspicious, and what the linear limits are."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import copysign, isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from slipstick.balance.contact_words import (
    SLIDING,
    direction_words,
    orders_of,
    rubbing_words,
    shown_quantities,
    speed_words,
    velocities_of,
)
from slipstick.cli.names import command_name
from slipstick.cli.options import CasePath
from slipstick.cli.terminal.answers import Answer, case_answer
from slipstick.cli.terminal.guard import DONE, prepare_kernel, say, warn_user, warnings_said
from slipstick.cli.verb import verb
from slipstick.html import dofs_words, some
from slipstick.units import after_number, power_unit

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.problem import Problem
    from slipstick.case.case import Case
    from slipstick.case.structure import Body
    from slipstick.fem.contact_points import ContactPoints
    from slipstick.models.reduced_body import ReducedBody
    from slipstick.structure.cyclic import TravellingWave
    from slipstick.structure.protocol import Structure
    from slipstick.units import Units

_LISTED_FREQUENCIES = 10
_LISTED_LIMITS = 3
"""Output dofs whose linear responses are printed."""
_LISTED_DIRECTIONS = 4
"""Of contacts that slide alike."""
_LARGE = 20_000
"""Dofs from which a direct solution takes seconds."""
_FREQUENCIES_LARGE, _FREQUENCIES_SMALL = 3, 6
"""Frequencies at which the reduction is compared with the full model, of a large and a small one."""


@verb
def check(
    answer: Answer,
    case: CasePath,
    in_time: Annotated[
        bool,
        typer.Option("--in-time", help="Follow the curve too, and check its highest peaks by time integration."),
    ] = False,
) -> int:
    """Everything run would refuse or warn of, and the modes of the structure."""
    from slipstick.case.case import Case

    return _described(Case.from_file(case, say), case, answer, in_time)


def _described(case: Case, path: Path, answer: Answer, in_time: bool) -> int:
    """Print what a case means, read with the code that ``run`` uses."""
    from slipstick.case.study import cases_text

    problem = case.problem()
    answer |= case_answer(case)
    answer["warnings"] = print_warnings(case)
    say(f"{case.title} ({path})")
    _structure(case, problem)
    _reduction(case, problem)
    _full_model(case.body, case.omega, max(problem.harmonics.orders), case.frequency_text, problem.units)
    _request(case, problem)
    _load_steps(case)
    _contacts(problem)
    answer["dragged"] = list(dragged(problem, case.omega))
    for sentence in answer["dragged"]:
        say(sentence)
    _stiffness(problem)
    if case.plan is not None:
        say(f"study: {cases_text(case.plan)}: 'slipstick study {path}' computes them")
        answer["cases"] = len(case.plan)
        answer["warnings"] += _complained(case.plan.warnings)
    for name in case.further:
        data = " DATA" if name == "identify" else ""
        say(
            f"[{name}]: 'slipstick {command_name(name)} {path}{data}' computes it; "
            "'slipstick run' computes [response] alone"
        )
    if case.parameter is None:
        answer["linear"] = _linear_limits(case, problem)
    say(f"ok: 'slipstick run {path}' can start")
    return _in_time(case, answer) if in_time else DONE


def _load_steps(case: Case) -> None:
    """What the load steps leave."""
    if case.preloaded is None:
        return
    say(f"load steps: {some(case.preloaded.dataset['step'].to_numpy())}")
    if case.steps is not None:
        for line in case.steps.fields():
            say(line)
    for line in case.preloaded.table().splitlines():
        say(line)
    for note in case.preloaded.notes:
        say(note)


def _in_time(case: Case, answer: Answer) -> int:
    from slipstick.cli.verbs.verify import AGREES, check_curve

    say(f"following {case.request} for the check in time ...")
    prepare_kernel(say)
    with warnings_said():
        branch = case.run()
    return check_curve(branch, AGREES, answer)


def print_warnings(case: Case) -> list[str]:
    """Print the warnings of a case on standard error; the sentences."""
    return _complained(case.warnings())


def _complained(sentences: Sequence[str]) -> list[str]:
    for sentence in sentences:
        warn_user(sentence)
    return list(sentences)


def _structure(case: Case, problem: Problem) -> None:
    import numpy as np

    structure = problem.structure
    shapes = f", load shapes: {', '.join(structure.load_shapes)}" if structure.load_shapes else ""
    say(f"structure: {dofs_words(len(structure.dofs))} ({some(structure.dofs)}){shapes}")
    frequencies = np.asarray(structure.natural_frequencies)
    ratios = structure.damping_ratios
    listed = min(len(frequencies), _LISTED_FREQUENCIES)
    say(f"undamped natural frequencies without contact, {listed} of {len(frequencies)}:")
    for number, omega in enumerate(frequencies[:_LISTED_FREQUENCIES], start=1):
        damped = "" if ratios is None else f", damping ratio {ratios[number - 1]:.3g}"
        say(f"  {number:>3}  {case.frequency_text(float(omega))}{damped}")
    if unknown := untold(structure):
        say(f"not known of this structure: {', '.join(unknown)}")
    from slipstick.structure.cyclic import TravellingWave
    from slipstick.structure.disc import Disc

    if isinstance(structure, TravellingWave):
        _around(structure, problem.harmonics.orders)
    if isinstance(structure, Disc):
        say(f"whole disc: blades are numbered from 0 to {structure.sectors - 1}, contacts from 1")


def untold(structure: Structure) -> list[str]:
    """What is looked at before a computation and a structure does not tell, in words."""
    about = {
        "damping ratios": structure.damping_ratios,
        "whether its damping feeds energy in": structure.energy_fed,
        "whether its stiffness makes it grow": structure.self_excited,
        "the error by modes left out": structure.truncations(1),
    }
    return [words for words, known in about.items() if known is None]


def _around(wave: TravellingWave, orders: Sequence[int]) -> None:
    """How harmonics of a wave go round the disc."""
    say(f"wave of engine order {wave.engine_order} on {wave.sectors} sectors; harmonics and their nodal diameters:")
    for order, diameter, direction in wave.harmonics(orders):
        say(f"  {order:>3}  {diameter} {direction}")


def _reduction(case: Case, problem: Problem) -> None:
    from slipstick.balance.reduction import valid_to, worst_error

    worst = worst_error(problem, case.omega)
    if worst is None or worst.kind == "unknown":
        return
    limit = valid_to(problem)
    say(
        f"error by the modes left out, estimated: {worst.value:.1e} of the receptance in the range and at its harmonics"
        + (f"; it reaches 1e-02 at {case.frequency_text(limit)}" if isfinite(limit) else "")
    )


def _full_model(
    body: Body, omega: tuple[float, float], highest_order: int, frequency_text: Callable[[float], str], units: Units
) -> None:
    """Print the full model behind a reduced structure, the error of the reduction and the contact points."""
    from slipstick.progress import duration

    full = body.reduced
    if full is None:
        return
    kept = "read from disk" if full.reused else "made"
    say(
        f"full model: {full.n_dofs} dofs ({full.source}); {len(full.structure.omega)} modes, solver {full.solver}; "
        f"{kept} in {duration(body.seconds)}"
    )
    for note in full.notes:
        say(f"  {note}")
    _errors(full, omega, highest_order, frequency_text)
    if full.points is not None:
        _points(full.points, units)


def compared_at(omega: tuple[float, float], highest_order: int, count: int) -> list[float]:
    """Where the reduction is compared: over the range asked for and up to the highest harmonic of its end.

    >>> compared_at((10.0, 20.0), 5, 3)
    [10.0, 20.0, 100.0]
    """
    import numpy as np

    low, high = sorted(omega)
    top = high * max(highest_order, 1)
    wanted = [low, high, top]
    if count > len(wanted):
        wanted = [*np.linspace(low, high, 3), *np.linspace(high, top, count - 2)[1:]]
    return [float(value) for value in dict.fromkeys(wanted)]


def _errors(
    full: ReducedBody, omega: tuple[float, float], highest_order: int, frequency_text: Callable[[float], str]
) -> None:
    large = full.n_dofs > _LARGE
    wanted = compared_at(omega, highest_order, _FREQUENCIES_LARGE if large else _FREQUENCIES_SMALL)
    few = "; the model is large, so at few frequencies" if large else ""
    say(f"reduction against direct solutions of the full model, relative error of the receptance{few}:")
    if large:
        say("  putting the full model together, then a direct solution for each of the frequencies ...")
    for value, error in full.receptance_errors(wanted):
        say(f"  {frequency_text(value)}: {error:.1e}")


def _points(points: ContactPoints, units: Units) -> None:
    import numpy as np

    where, share = (_in(units.label(dimension)) for dimension in ("length", "length^2"))
    say(f"{points.count} contact points on the surface: position{where}, outward normal, share of the area{share}")
    for k, (at, normal, area) in enumerate(zip(points.positions, points.normals, points.areas, strict=True), 1):
        say(f"  {k:>3}  {_vector(at)}  {_vector(normal)}  {area:.4g}")
    if points.influence is not None:
        diagonal = np.diag(points.influence)
        power = power_unit(units.label("force length/time"))
        unit = after_number(f"{units.label('temperature')}/{f'({power})' if '/' in power else power}")
        say(f"temperature over power of the points themselves: {diagonal.min():.4g} to {diagonal.max():.4g}{unit}")


def _in(unit: str) -> str:
    """A unit behind the name of a quantity; nothing where it has no name."""
    return f" [{unit}]" if after_number(unit) else ""


def _vector(values: Sequence[float]) -> str:
    import numpy as np

    size = max(np.abs(values).max(), 1e-300)
    clean = np.where(np.abs(values) < 1e-9 * size, 0.0, values)  # rounding of normals
    return "(" + ", ".join(f"{value:.4g}" for value in clean) + ")"


def _request(case: Case, problem: Problem) -> None:
    say(f"range: {case.request}")
    orders = problem.harmonics.orders
    unknowns = sum(pair.n_ports for pair in problem.contacts) * problem.harmonics.size
    say(f"harmonics: {some([str(m) for m in orders], 14)}; {unknowns} unknowns")
    if problem.period_ratio != (1, 1):
        ratio = "{}/{}".format(*problem.period_ratio)
        say(f"period of the load over that of the rub: {ratio}; omega belongs to the common period")
    say(f"loads: {len(problem.loads)}; output dofs: {some(problem.outputs or ())}")
    if problem.relative:
        say("the support moves: all motion, in results and figures too, is relative to it")


def _contacts(problem: Problem) -> None:
    for pair in problem.contacts:
        for k, name in enumerate(pair.elements):
            ports = {port: direction_words(pair.direction(port, k)) for port in pair.contact.ports}
            surface = " and ".join(filter(None, (ports.pop(port, "") for port in ("tangential", "second"))))
            along = [f"slides along {surface}"] if surface else []
            along += [f"{port} {cosines}" for port, cosines in ports.items() if cosines]
            law, units = pair.contact, problem.units
            numbers = [
                f"{quantity} {float(pair.values(quantity)[k]):g}{units.after(law.unit(quantity))}"
                for quantity in shown_quantities(pair, k)
            ]
            say(f"contact '{name}': {', '.join([*along, *numbers, rubbing_words(pair, k, units)])}")


def _stiffness(problem: Problem) -> None:
    from slipstick.balance.contact_stiffness import stiffness_sentence

    if sentence := stiffness_sentence(problem):
        say(f"normal stiffness: {sentence}")


def dragged(problem: Problem, omega: tuple[float, float]) -> Iterator[str]:
    """Which way contacts with rubbing slide and are dragged [THEORY.md (1.5)], one sentence for all that do so alike.

    ``omega`` is the range of frequencies: a velocity that sweeps with them may turn round within it.
    """
    alike: dict[tuple[str, bool, bool], list[tuple[str, str, str]]] = {}
    for pair in problem.contacts:
        held = pair.contact.coulomb
        for k, name in enumerate(pair.elements):
            periodic = some(m for m in orders_of(pair, k, *SLIDING) if m > 0)
            velocity, swept, direction = _course(pair, k, omega)
            signs = {copysign(1.0, v) for v in (velocity + swept * w for w in omega) if v}
            if not signs and not periodic:
                continue
            sign, turns = (1.0, True) if len(signs) != 1 else (signs.pop(), False)
            speed = [f"at {speed_words(sign * velocity, sign * swept, problem.units)}"] if velocity or swept else []
            how = " and ".join([*speed, *([f"to and fro with order {periodic}"] if periodic else [])])
            if not direction:  # a surface that turns: the law's own sense, no dof
                yield _turned(name, how, sign)
                continue
            ways = _towards(direction, sign), _towards(direction, -sign)
            alike.setdefault((how, turns, held), []).append((name, *ways))
    for (how, turns, held), contacts in alike.items():
        yield _dragged(how, turns, held, *zip(*contacts, strict=True))


def _course(pair: ContactPair, k: int, omega: tuple[float, float]) -> tuple[float, float, Mapping[str, float]]:
    """Velocity of the k-th contact, what each rad/s adds to it, and along which direction, cosines by dof.

    In two directions it is that of the velocity in the middle of the range, if it turns with the frequency.
    """
    import numpy as np

    ports = pair.contact.surface_ports
    first = pair.direction(ports.get("tangential", ""), k) or {}
    velocity, swept = velocities_of(pair, k)
    only_second = not (velocity.any() or swept.any() or orders_of(pair, k, "cos", "sin"))
    if not (velocity[1:].any() or swept[1:].any() or (only_second and len(velocity) > 1)):
        return float(velocity[0]), float(swept[0]), first
    along = velocity + swept * 0.5 * sum(omega)
    along = along if along.any() else velocity if velocity.any() else swept
    along = np.array([0.0, 1.0]) if only_second else along / np.linalg.norm(along)
    second = pair.direction(ports["second"], k) or {}
    cosines = {dof: along[0] * first.get(dof, 0.0) + along[1] * second.get(dof, 0.0) for dof in {**first, **second}}
    return float(velocity @ along), float(swept @ along), {dof: c for dof, c in cosines.items() if c}


def _turned(name: str, how: str, sign: float) -> str:
    """A contact whose surface turns about the line of sight of x and y."""
    sense = "from x to y" if sign > 0.0 else "from y to x"
    return f"contact '{name}': the surface of the rotor runs {how} in the sense {sense}"


def _dragged(how: str, turns: bool, held: bool, names: Sequence[str], ahead: Sequence[str], back: Sequence[str]) -> str:
    """Contacts ``names`` that slide towards ``ahead``; ``turns``: to both sides, ``held``: by friction."""
    who, it = f"contact '{names[0]}': slides", "it"
    if len(names) > 1:
        listed = some([f"'{name}'" for name in names])
        who, it = f"contacts {listed}: slide", "them"
    ahead, back = (some(dict.fromkeys(ways), _LISTED_DIRECTIONS) for ways in (ahead, back))
    if turns:
        return f"{who} {how} over the opposing surface, positive towards {ahead}, without a mean direction"
    friction = f", and friction pushes {it} that way" if held else ""
    seen = f"seen from {it} that surface moves towards {back}{friction}"
    return f"{who} towards {ahead} {how} over the opposing surface; {seen}"


def _linear_limits(case: Case, problem: Problem) -> list[Answer]:
    """Highest point of the linear response without contacts and with all of them stuck."""
    from slipstick.analysis.curve.linear import linear_references
    from slipstick.results.view import unit_shown

    limits, known = [], dict(linear_references(case.balance, case.omega))
    beside = [limit.table for limit in known.values()]
    for label, limit in known.items():
        grid, amplitudes = (limit.table[name].to_numpy() for name in ("omega", "amplitude"))
        outputs = problem.outputs or ()
        for place, (dof, values) in enumerate(zip(outputs, amplitudes.T, strict=False)):
            at = int(values.argmax())
            limits.append({"state": label, "dof": dof, "amplitude": values[at], "omega": grid[at]})
            if place >= _LISTED_LIMITS:
                continue
            factor, unit = unit_shown(limit.table, "amplitude", str(dof), beside)
            size = f"{values[at] * factor:.4g}{after_number(unit)}"
            near = f"near {case.frequency_text(grid[at])}"
            if at in (0, len(grid) - 1):
                near = f"at {case.frequency_text(grid[at])}, an end of the range"
            say(f"linear response, {label}: largest amplitude of {dof} {size} {near}")
        if len(outputs) > _LISTED_LIMITS:
            say(f"linear response, {label}: --json tells it of all {len(outputs)} output dofs")
    return limits


def _towards(cosines: Mapping[str, float], sign: float) -> str:
    """A direction with its sense.

    >>> _towards({"x": 1.0}, 1.0), _towards({"x": 1.0}, -1.0), _towards({"x1": 1.0, "x2": -1.0}, -1.0)
    ('+x', '-x', '-x1 + x2')
    """
    words = direction_words({dof: sign * c for dof, c in cosines.items()})
    return words if len(cosines) > 1 or words.startswith("-") else f"+{words}"
