"""Warnings: Python says what ``check`` says, at the user's own line, once, and nothing where all is well."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.oscillator import one_mass

import slipstick as ss
from slipstick.balance.physics_checks import problem_warnings

SHORT = {"max_points": 2}


def problem(
    *,
    velocity: float = 10.0,
    C: float = 0.4,
    harmonics: Any = 10,
    loads: Any = None,
    normal: str | None = None,
    **contact: Any,
) -> ss.Problem:
    structure = ss.MatrixStructure(M=np.eye(2), C=C * np.eye(2), K=40.0 * np.eye(2), dofs=["x", "y"])
    given = {"kt": 100.0, "mu": 0.3, "normal_load": 800.0} | contact
    pair = ss.ContactPair(
        name="damper",
        contact=ss.FrictionContact(**{name: value for name, value in given.items() if value is not None}),
        tangential="x",
        normal=normal,
        rubbing=ss.RubbingMotion(velocity=velocity),
    )
    loads = [ss.Load(dof="x", sin=100.0)] if loads is None else loads
    return ss.Problem(structure, contacts=pair, loads=loads, harmonics=harmonics)


def computed(given: ss.Problem) -> ss.Branch:
    return ss.linear_response(given, omega=[2.0, 3.0])


SUSPICIOUS: list[tuple[Callable[[], Any], str]] = [
    (lambda: computed(problem(normal_load=0.0)), "never acts"),
    (lambda: computed(problem(normal_load=None, gap=1.0)), "never acts"),
    (lambda: computed(problem(normal="y", kn=0.0, normal_load=None, gap=-1.0)), "kn = 0"),
    (lambda: computed(problem(harmonics=[0, 1, 3, 5, 7])), "even harmonics"),
    (lambda: computed(problem(harmonics=2)), "at least 0..5"),
    (lambda: computed(problem(loads=[], velocity=0.0)), "nothing moves"),
    (lambda: computed(problem(loads=[ss.Load(dof="x", sin=0.0)], velocity=0.0)), "nothing moves"),
    (lambda: ss.forced_response(problem(loads=[]), omega=(2.0, 3.0), options=SHORT), "was a load forgotten?"),
    (lambda: ss.linear_response(problem(loads=[ss.Load(dof="x", harmonic=0, cos=1.0)]), omega=2.0), "load forgotten?"),
    (lambda: computed(problem(loads=[ss.Load(dof="x", sin=1.0)] * 2)), "load on 'x', harmonic 1: given 2 times alike"),
    (lambda: ss.Load(dof="x", amplitude=1.0, phase=90.0), "load on 'x': a phase of 90 rad is more than"),
    (
        lambda: ss.parameter_response(problem(), "load.x.phase", (0.0, 90.0), omega=2.0, options=SHORT),
        "load on 'x': a phase of 90 rad is more than",
    ),
    (lambda: computed(problem(normal="x", kn=1.0)), "'damper': normal is the tangential direction"),
    (
        lambda: computed(problem(C=-0.4)),
        "feeds energy in (mode 1 at 6.3246 rad/s, damping ratio -0.0316; mode 2 at 6.3246",
    ),
    (lambda: ss.forced_response(problem(C=400.0), omega=(2.0, 8.0), options=SHORT), "a damping ratio of 31.6"),
    (lambda: ss.linear_response(modal(damping_ratio=2.0), omega=[8.0, 9.0]), "a damping ratio of 2 (1 is critical"),
    (
        lambda: computed(problem(normal="y", normal_load=None, gap=1.0, kn=1.0)),
        "the gap 1 is open and no load moves the structure across it",
    ),
    (
        lambda: ss.study(problem(), {"damper.mu": [0.1, 0.2], "damper.gap": [-7.0, -8.0]}, omega=(2.0, 2.1)),
        "mu N alone",
    ),
    (
        lambda: ss.forced_response(problem(), omega=(2.0, 2.1)).sensitivity(["friction", "*.normal_load"]),
        "mu N alone",
    ),
    (lambda: computed(problem(mu=30.0)), "mu = 30 is more than"),
    (lambda: computed(problem(kt=1e9)), "kt = 1e+09 is 2.5e+07 times"),
    (lambda: computed(problem(kt=1e-6)), "kt = 1e-06 is only 2.5e-08"),
    (lambda: computed(problem(normal="y", kn=1e9)), "kn = 1e+09 is"),
    (lambda: computed(problem(normal="y", kn=1e-7, normal_load=None, gap=0.0)), "kn = 1e-07 is only"),
    (
        lambda: computed(problem(normal="y", normal_load=None, gap=1e4, kn=1, loads=ss.Load(dof="y", cos=1))),
        "hardly ever close",
    ),
    (lambda: ss.forced_response(problem(), omega=(0.3, 2.0), options=SHORT), "meant in Hz"),
    (lambda: ss.forced_response(problem(), omega=(30.0, 60.0), options=SHORT), "2 pi applied twice"),
    (lambda: ss.forced_response(problem(C=0.0), omega=(2.0, 3.0), options=SHORT), "no damping"),
    (lambda: ss.parameter_response(problem(C=0.0), "damper.mu", (0.1, 0.2), omega=2.0, options=SHORT), "no damping"),
    (
        lambda: ss.parameter_response(
            problem(velocity=0.0, harmonics=[0, 1, 3, 5]), "damper.velocity", (0.0, 5.0), omega=2.0, options=SHORT
        ),
        "even harmonics",
    ),
    (lambda: ss.linear_response(problem(C=0.0), omega=[2.0, 3.0]), "no damping"),
    (lambda: ss.linear_response(free(C=None), omega=[2.0, 3.0]), "no damping"),
    (lambda: ss.linear_response(free(), omega=[0.5, 1.5]), "meant in Hz"),
    (lambda: ss.linear_response(modal(), omega=[8.0, 15.0]), "receptance of the reduced structure"),
]  # fmt: skip


@pytest.mark.parametrize("compute", [
    lambda low, high: ss.forced_response(problem(), omega=(low, high), options=SHORT),
    lambda low, high: ss.linear_response(free(), omega=[low, high]),
    lambda low, high: ss.linear_response(free(), omega=low),
    lambda low, high: ss.steady_response(problem(), omega=[low, high]),
    lambda low, high: ss.parameter_response(problem(), "damper.mu", (0.2, 0.3), omega=low, options=SHORT),
])  # fmt: skip
def test_what_was_said_in_a_unit_is_not_asked_about(compute: Callable[[Any, Any], Any]) -> None:
    """6.3 rad/s is the natural frequency: 0.5 to 2 would hold it in Hz, 30 to 60 rad/s hold 2 pi times it."""
    questions = ("meant in Hz", "applied twice")
    for low, high in (("0.0796 Hz", "0.3183 Hz"), ("5 Hz", "9.5 Hz"), ("1 rpm", "3 rpm")):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            compute(low, high)
        assert not [w for w in caught if any(words in str(w.message) for words in questions)]


def free(C: float | None = 0.4) -> ss.Problem:
    return one_mass(C=C, loads=ss.Load(dof="x", cos=1.0), harmonics=1)


def modal(residual: float = 0.01, **damping: float) -> ss.Problem:
    structure = ss.ModalStructure(
        omega=[10.0], mode_shapes=[[1.0]], static_compliance=[[0.01 + residual]], dofs=["x"],
        **{"loss_factor": 0.01} | damping,
    )  # fmt: skip
    return ss.Problem(structure, loads=ss.Load(dof="x", cos=1.0), harmonics=1)


@pytest.mark.parametrize("make, words", SUSPICIOUS, ids=[words for _, words in SUSPICIOUS])
def test_python_says_what_looks_wrong_at_the_users_line(make: Callable[[], Any], words: str) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        made = make()
    assert [w.category for w in caught] == [ss.SlipstickWarning] * len(caught)
    assert sum(words in str(w.message) for w in caught) == 1, [str(w.message) for w in caught]
    assert {w.filename for w in caught} == {__file__}
    if isinstance(made, ss.Branch):
        assert any(words in sentence for sentence in made.warnings)
        assert any(words in sentence for sentence in made.dataset.attrs["warnings"].splitlines())


def test_nothing_is_said_where_all_is_well() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert ss.forced_response(problem(), omega=(2.0, 3.0), options=SHORT).warnings == ()
        computed(problem(normal="y", kn=1e-7))  # a very soft spring under preload: a constant normal load
        ss.linear_response(modal(residual=0.0), omega=[8.0, 15.0])
        computed(problem(velocity=0.0, harmonics=[0, 1, 3, 5]))
        ss.parameter_response(problem(), "damper.mu", (0.0, 0.3), omega=2.0, options=SHORT)


def test_what_was_said_of_a_problem_is_not_said_of_its_copies() -> None:
    p = problem(mu=0.0)
    with pytest.warns(ss.SlipstickWarning, match="mu = 0"):
        ss.forced_response(p, omega=(2.0, 3.0), options=SHORT)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for copy in (replace(p, title="again"), p.with_parameter("damper.kt", 50.0), pickle.loads(pickle.dumps(p))):
            assert any("mu = 0" in s for s in ss.forced_response(copy, omega=(2.0, 3.0), options=SHORT).warnings)
    with pytest.warns(ss.SlipstickWarning, match="mu = 3"):
        computed(p.with_parameter("damper.mu", 3.0))


RANGE = {"omega": (4.0, 9.0)}
ANALYSES: dict[str, Callable[[ss.Problem], Any]] = {
    "forced_response": lambda p: ss.forced_response(p, omega=(2.0, 3.0), options=SHORT),
    "parameter_response": lambda p: ss.parameter_response(p, "damper.kt", (90.0, 110.0), omega=2.0, options=SHORT),
    "steady_response": lambda p: ss.steady_response(p, omega=2.0),
    "linear_response": lambda p: ss.linear_response(p, omega=2.0),
    "track_peak": lambda p: ss.track_peak(p, "damper.kt", (99.0, 101.0), **RANGE, options=SHORT),
    "optimal": lambda p: ss.optimal(p, "damper.normal_load", **RANGE),
    "nonlinear_modes": lambda p: ss.nonlinear_modes(p, amplitude=(1.0, 1.1), options=SHORT),
    "transient": lambda p: ss.transient(p, 2.0, periods=1),
    "study": lambda p: ss.study(p, {"damper.kt": [99.0, 101.0]}, omega=(2.0, 2.1), workers=1),
}


@pytest.mark.parametrize("analysis", ANALYSES)
def test_each_analysis_says_what_looks_wrong_and_none_says_it_again(analysis: str) -> None:
    """A problem by itself says nothing; warnings of results (harmonics left out) belong to each computation."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rubbing = {"velocity": 0.0} if analysis == "nonlinear_modes" else {}
        p = problem(harmonics=2, **rubbing)
    for expected in (1, 0):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            ANALYSES[analysis](p)
        assert [w.filename for w in caught if "at least 0..5" in str(w.message)] == [__file__] * expected


def test_free_vibration_needs_nothing_that_moves_the_structure() -> None:
    p = problem(loads=[], velocity=0.0, C=0.04)
    assert ss.nonlinear_modes(p, amplitude=(1e-3, 2e-3), options=SHORT).warnings == ()
    with pytest.warns(ss.SlipstickWarning, match="nothing moves"):
        computed(p)


def test_curves_repeat_only_what_belongs_to_them() -> None:
    p = problem(C=0.0)
    with pytest.warns(ss.SlipstickWarning, match="no damping"):
        ss.forced_response(p, omega=(2.0, 3.0), options=SHORT)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ss.forced_response(p, omega=(2.0, 3.0), options=SHORT)


def test_even_multiples_of_what_moves_count() -> None:
    """Driven on harmonic 2 alone, the even harmonics are 4, 8, ..."""
    p = problem(harmonics=4)
    structure, pair = p.structure, p.contacts[0]
    load = ss.Load(dof="x", harmonic=2, sin=1.0)
    (said,) = problem_warnings(ss.Problem(structure, contacts=pair, loads=load, harmonics=[0, 2, 6, 10]))
    assert "even multiples of 2" in said
    assert problem_warnings(ss.Problem(structure, contacts=pair, loads=load, harmonics=[0, 2, 4, 6])) == []
    # on 4 and 6 together every second one counts, and 4 is an even multiple of 2
    loads = [ss.Load(dof="x", harmonic=4, sin=1.0), ss.Load(dof="x", harmonic=6, sin=1.0)]
    assert problem_warnings(ss.Problem(structure, contacts=pair, loads=loads, harmonics=[0, 4, 6])) == []


@pytest.mark.parametrize(("count", "said"), [(16, True), (17, False)])
def test_of_many_contacts_proportions_are_looked_at_with_the_curve(count: int, said: bool) -> None:
    """The static compliance between their ports is not computed for a problem alone, only where it is needed anyway."""
    hard = ss.FrictionContact(kt=1e9, mu=0.3, normal_load=1.0)
    pair = ss.ContactPair(name="c", contact=hard, tangential=["x"] * count, rubbing=ss.RubbingMotion(velocity=10.0))
    many = one_mass(pair, force=1.0, harmonics=10)
    assert any("check the units of both" in sentence for sentence in problem_warnings(many)) == said
    assert any("check the units of both" in sentence for sentence in problem_warnings(many, (2.0, 3.0)))
