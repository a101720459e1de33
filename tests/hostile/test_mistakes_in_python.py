"""What a new user gets wrong in Python, as data: each is refused in one sentence, warned of, or means the obvious."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Callable
from dataclasses import FrozenInstanceError, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse
import xarray

import slipstick as ss

H = range(6)
STRUCTURE = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
CONTACT = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
PAIR = ss.ContactPair(name="damper", contact=CONTACT, tangential="x", rubbing=ss.RubbingMotion(velocity=100.0))
LOAD = ss.Load(dof="x", sin=100.0)
PROBLEM = ss.Problem(STRUCTURE, contacts=PAIR, loads=LOAD, harmonics=H)
RANGE = (5.0, 7.0)


@cache
def branch() -> ss.Branch:
    return ss.forced_response(PROBLEM, omega=RANGE)


def two(**changes: Any) -> ss.MatrixStructure:
    return ss.MatrixStructure(**({"M": np.eye(2), "K": [[3.0, -1.0], [-1.0, 2.0]], "dofs": ["tip", "root"]} | changes))


def contact(**changes: Any) -> ss.FrictionContact:
    return ss.FrictionContact(**({"kt": 100.0, "mu": 0.3, "normal_load": 800.0} | changes))


def problem(**changes: Any) -> ss.Problem:
    given = {"structure": STRUCTURE, "contacts": PAIR, "loads": LOAD, "harmonics": H} | changes
    return ss.Problem(given.pop("structure"), **given)


def pair(law: Any = CONTACT, **changes: Any) -> ss.ContactPair:
    return ss.ContactPair(**({"name": "d", "contact": law, "tangential": "x"} | changes))


def forced(**changes: Any) -> ss.Branch:
    return ss.forced_response(**({"problem": PROBLEM, "omega": RANGE, "options": {"max_points": 2}} | changes))


def swept(name: Any, span: Any = (1.0, 3.0), **changes: Any) -> ss.Branch:
    return ss.parameter_response(changes.pop("problem", PROBLEM), name, span, **({"omega": 6.0} | changes))


def study(values: Any, **changes: Any) -> Any:
    return ss.study(PROBLEM, values, **({"omega": RANGE, "workers": 1} | changes))


BELT = problem(contacts=replace(PAIR, name="belt"))

REFUSED: dict[str, tuple[Callable[[], Any], type[Exception], tuple[str, ...]]] = {
    # calls
    "contacts by position": (lambda: ss.Problem(STRUCTURE, PAIR), TypeError, ("positional",)),
    "contact= for contacts=": (lambda: problem(contact=PAIR), TypeError, ("'contact'",)),
    "options by position": (lambda: ss.forced_response(PROBLEM, RANGE, [7.0]), TypeError, ("positional",)),
    "frequency= for omega=": (lambda: forced(frequency=RANGE), TypeError, ("'frequency'",)),
    "k_t= for kt=": (lambda: contact(k_t=1.0), TypeError, ("'k_t'",)),
    "parameters by position": (lambda: ss.FrictionContact(100.0, 0.3), TypeError, ("positional",)),
    "misspelt function": (lambda: ss.forced_responce, AttributeError, ("did you mean 'forced_response'?",)),
    "misspelt figure": (lambda: ss.plots.respons, AttributeError, ("did you mean 'response'?",)),
    "misspelt model": (lambda: ss.models.beam_roter, AttributeError, ("did you mean 'beam_rotor'?",)),
    "no omega": (lambda: ss.parameter_response(PROBLEM, "damper.mu", (0.1, 0.3)), TypeError, ("'omega'",)),
    "X without Y": (lambda: ss.contact_forces(CONTACT, 1, [0, 0, 1], omega=2.0), TypeError, ("'Y'",)),
    # contacts
    "text for a number": (lambda: contact(kt="100"), ss.InputError, ("kt: found '100'", "finite number")),
    "negative mu": (lambda: contact(mu=-0.3), ss.InputError, ("mu: found -0.3", ">= 0")),
    "normal load and gap": (lambda: contact(gap=-1.0), ss.InputError, ("gap = -1.0", "normal_load = 800.0", "one of")),
    "no normal load": (lambda: contact(normal_load=None), ss.InputError, ("normal load is missing", "gap=-800.0")),
    "sizes that differ": (lambda: contact(kt=[1, 2], mu=[1, 2, 3]), ss.InputError, ("2 of kt, 3 of mu",)),
    "column of loads": (lambda: contact(normal_load=[[8.0]]), ss.InputError, ("normal_load: found [[8.0]]",)),
    "complex stiffness": (lambda: contact(kt=100 + 1j), ss.InputError, ("kt: found (100+1j)",)),
    "nan": (lambda: contact(mu=float("nan")), ss.InputError, ("mu: found nan",)),
    "array of texts": (lambda: contact(kt=np.array(["1.0"])), ss.InputError, ("kt: found ['1.0']",)),
    "class for an object": (lambda: pair(ss.FrictionContact), ss.InputError, ("contact: found <class", "ss.Friction")),
    "number for rubbing": (lambda: pair(rubbing=10.0), ss.InputError, ("rubbing: found 10.0", "ss.RubbingMotion(")),
    "velocity by position": (lambda: ss.RubbingMotion(10.0), TypeError, ("positional",)),
    "velocity with a unit": (lambda: ss.RubbingMotion(velocity="10 m/s"), ss.InputError, ("velocity: found '10 m/s'",)),
    "list of amplitudes": (lambda: ss.RubbingMotion(cos=[2.0]), ss.InputError, ("cos: found [2.0]", "{1: 2.0}")),
    "order as a text": (lambda: ss.RubbingMotion(cos={"1": 2.0}), ss.InputError, ("found '1'", "whole number >= 0")),
    "sine of order 0": (lambda: ss.RubbingMotion(sin={0: 2.0}), ss.InputError, ("sin", "found 0", ">= 1")),
    "cosine beside its dof": (lambda: pair(tangential=("x", 1.0)), ss.InputError, ("number 2: found 1.0", '{"x": 1.0')),
    "direction of zero": (lambda: problem(contacts=pair(tangential={"x": 0.0})), ss.InputError, ("no direction",)),
    "normal without kn": (
        lambda: problem(structure=two(), contacts=pair(tangential="tip", normal="root"), loads=()),
        ss.InputError, ("kn is missing", "normal contact stiffness"),
    ),
    "no tangential": (
        lambda: problem(contacts=pair(contact(kn=1.0), tangential=None, normal="x")),
        ss.InputError, ("tangential has no direction",),
    ),
    # loads
    "load with a unit": (lambda: ss.Load(dof="x", sin="100 N"), ss.InputError, ("sin: found '100 N'",)),
    "phase alone": (lambda: ss.Load(dof="x", phase=90), ss.InputError, ("phase is given without amplitude",)),
    "amplitude and sine": (lambda: ss.Load(dof="x", amplitude=1, sin=3), ss.InputError, ("together with cos or sin",)),
    "complex load": (lambda: ss.Load(dof="x", sin=1 + 2j), ss.InputError, ("sin: found (1+2j)",)),
    "list of dofs": (lambda: ss.Load(dof=["x"], sin=1.0), ss.InputError, ("dof: found ['x']",)),
    "list of amplitudes of a load": (lambda: ss.Load(dof="x", sin=[1.0]), ss.InputError, ("sin: found [1.0]",)),
    "load of nothing": (lambda: problem(loads=ss.Load(sin=1.0)), ss.InputError, ("where it acts is missing",)),
    "static sine": (lambda: problem(loads=ss.Load(dof="x", harmonic=0, sin=3)), ss.InputError, ("as cos",)),
    "load beyond the harmonics": (
        lambda: problem(loads=ss.Load(dof="x", harmonic=9, sin=1.0)), ss.InputError, ("harmonic 9", "keep it too"),
    ),
    # problems
    "contacts nested": (lambda: problem(contacts=[[PAIR]]), ss.InputError, ("contacts, number 1", "ss.ContactPair")),
    "a load as the factor on all": (
        lambda: problem(load=LOAD), ss.InputError,
        ("load: found Load(dof='x'", "a number, the factor on all loads; give loads as loads="),
    ),
    "loads as the factor on all": (lambda: problem(load=[LOAD]), ss.InputError, ("load: found [Load(", "as loads=")),
    "the factor as loads": (
        lambda: problem(loads=1.5), ss.InputError,
        ("loads: found 1.5; expected an ss.Load", "give a factor on all loads as load="),
    ),
    "the factor among loads": (lambda: problem(loads=[LOAD, 2]), ss.InputError, ("loads, number 2", "as load=")),
    "a text as the factor": (lambda: problem(load="2"), ss.InputError, ("expected a number, the factor on all",)),
    "loads nested": (lambda: problem(loads=[[LOAD]]), ss.InputError, ("loads, number 1", "ss.Load")),
    "contact before structure": (lambda: ss.Problem(PAIR, contacts=PAIR), ss.InputError, ("structure: found Cont",)),
    "loads for contacts": (lambda: problem(contacts=LOAD), ss.InputError, ("contacts: found Load(", "ss.ContactPair")),
    "law for a pair": (lambda: problem(contacts=CONTACT), ss.InputError, ("found FrictionContact(kt=100.0", "ss.Cont")),
    "misspelt dof": (
        lambda: problem(structure=two(), contacts=pair(tangential="tipp"), loads=()),
        ss.InputError, ("no dof 'tipp'", "did you mean 'tip'?"),
    ),
    "dof of another case": (lambda: problem(loads=ss.Load(dof="X", sin=1.0)), ss.InputError, ("'X'", "mean 'x'?")),
    "unknown output": (lambda: problem(outputs="y"), ss.InputError, ("outputs", "'y'", "there are x")),
    "a name twice": (lambda: problem(contacts=[PAIR, PAIR]), ss.InputError, ("'damper' is used 2 times",)),
    "harmonics without 0": (lambda: problem(harmonics=[1, 2, 3]), ss.InputError, ("[1, 2, 3]", "starting at 0")),
    "negative harmonic": (lambda: problem(harmonics=[0, -1]), ss.InputError, ("[0, -1]", "starting at 0")),
    "harmonics in any order": (lambda: problem(harmonics=[0, 3, 1]), ss.InputError, ("increasing",)),
    "half a harmonic": (lambda: problem(harmonics=[0, 1.5]), ss.InputError, ("[0, 1.5]", "whole numbers")),
    "range of harmonics misspelt": (lambda: problem(harmonics="0-10"), ss.InputError, ("'0-10'", '"0..10"')),
    "units misspelt": (lambda: problem(units={"lenght": "mm"}), ss.InputError, ("did you mean 'length'?",)),
    "changed after building": (
        lambda: setattr(PROBLEM, "harmonics", 3), FrozenInstanceError, ("cannot assign to field 'harmonics'",),
    ),
    "array changed after building": (
        lambda: contact(kt=np.array([1.0, 2.0])).kt.__setitem__(0, 3.0), ValueError, ("read-only",),
    ),
    # matrices
    "triangle of K": (lambda: two(K=[[3.0, -1.0], [0.0, 2.0]]), ss.InputError, ("K: not symmetric", "one triangle")),
    "complex K": (lambda: two(K=np.eye(2) * (1 + 0.1j)), ss.InputError, ("K is complex", "loss_factor")),
    "no M": (lambda: two(M=None), ss.InputError, ("M is missing",)),
    "M as a list of numbers": (lambda: two(M=[1.0, 1.0]), ss.InputError, ("M: found shape (2,)", "square")),
    "M of texts": (lambda: two(M=[["1", "0"], ["0", "1"]]), ss.InputError, ("M: found [['1', '0']", "real numbers")),
    "massless dof": (lambda: two(M=np.diag([1.0, 0.0])), ss.InputError, ("M: the mass matrix is not positive",)),
    "wrong sign in K": (lambda: two(K=np.diag([3.0, -2.0])), ss.InputError, ("K:", "wrong signs")),
    "M of another size": (lambda: two(M=np.eye(3)), ss.InputError, ("M: found shape (3, 3) but 2 dofs are named",)),
    "dof named twice": (lambda: two(dofs=["tip", "tip"]), ss.InputError, ("'tip' is used more than once",)),
    # curves
    "empty range": (lambda: forced(omega=(15.0, 15.0)), ss.InputError, ("15 to 15, which is empty",)),
    "range from 0": (lambda: forced(omega=(0.0, 15.0)), ss.InputError, ("0 to 15", "> 0 in rad/s")),
    "one frequency": (lambda: forced(omega=5.0), ss.InputError, ("found 5.0", "two frequencies such as (2.0, 15.0)")),
    "all frequencies": (lambda: forced(omega=np.linspace(2, 15, 50)), ss.InputError, ("50 values", "at=")),
    "unit misspelt": (lambda: forced(omega=("1 Hz", "2 herz")), ss.InputError, ("found '2 herz'", '"0.32 Hz"')),
    "text without unit": (lambda: forced(omega=("1", "2")), ss.InputError, ("found '1'", "unit")),
    "Hz where time is in ms": (
        lambda: forced(problem=problem(units={"time": "ms"}), omega=("1 Hz", "2 Hz")),
        ss.InputError, ("'1 Hz', which counts in seconds", '"ms"', "rad/ms"),
    ),
    "option misspelt": (lambda: forced(options={"maxstep": 0.1}), ss.InputError, ("did you mean 'max_step'?",)),
    "point outside": (lambda: forced(at=8.0), ss.InputError, ("8 lies outside of the range 5 to 7",)),
    "point with a wrong unit": (lambda: forced(at=["1 m"]), ss.InputError, ("number 1: found '1 m'",)),
    "guess of a wrong length": (lambda: forced(guess=np.zeros(3)), ss.InputError, ("shape (3,)", "(1, 11)")),
    "peaks of an unknown dof": (lambda: forced(peaks_of="y"), ss.InputError, ("'y' is not among the outputs",)),
    "structure for a problem": (lambda: forced(problem=STRUCTURE), ss.InputError, ("an ss.Problem",)),
    "no contact": (lambda: forced(problem=problem(contacts=())), ss.InputError, ("linear_response",)),
    "X of a wrong length": (
        lambda: ss.contact_forces(CONTACT, 5, [0, 0, 1], np.zeros(11), omega=2.0),
        ss.InputError, ("X: found shape (3,)",),
    ),
    "pair for a contact": (
        lambda: ss.contact_forces(PAIR, 1, [0, 0, 1], [0, 0, 0], omega=2.0), ss.InputError, ("an ss.FrictionContact",),
    ),
    "range for a frequency": (lambda: ss.transient(PROBLEM, (2.0, 3.0)), ss.InputError, ("omega: found (2.0, 3.0)",)),
    # parameters
    "parameter without its contact": (lambda: swept("mu"), ss.InputError, ("did you mean 'damper.mu'?",)),
    "parameter misspelt": (lambda: swept("damper.normalload"), ss.InputError, ("mean 'damper.normal_load'?",)),
    "speed": (lambda: swept("belt.speed", problem=BELT), ss.InputError, ("'belt.speed'", "mean 'belt.velocity'?")),
    "force": (lambda: swept("load.x.force"), ss.InputError, ("did you mean 'load.x.amplitude'?",)),
    "friction of one contact": (lambda: swept("damper.friction"), ss.InputError, ("did you mean 'damper.mu'?",)),
    "one value for a span": (lambda: swept("damper.mu", 0.3), ss.InputError, ("found 0.3", "the first and the last")),
    "span below 0": (lambda: swept("damper.mu", (-0.1, 0.3)), ss.InputError, ("mu: found -0.1",)),
    "sensitivity to what is not there": (
        lambda: branch().sensitivity("damper.speed"), ss.InputError, ("did you mean 'damper.velocity'?",),
    ),
    "text for a value": (lambda: PROBLEM.with_parameter("damper.mu", "0.3"), ss.InputError, ("found '0.3'",)),
    "range of a study as a text": (lambda: study({"damper.mu": "0.1..0.3"}), ss.InputError, ("a list of numbers",)),
    "study of names alone": (lambda: study(["damper.mu"]), ss.InputError, ("a table of parameters",)),
    "study without count": (
        lambda: study({"damper.mu": {"from": 0.1, "to": 0.3}}), ss.InputError, ("count is missing",),
    ),
    "study over no frequency": (lambda: study({"damper.mu": [0.1]}, omega=None), ss.InputError, ("omega is missing",)),
    # results
    "peaks of what is not there": (lambda: branch().peaks("y"), ss.InputError, ("no dof 'y'", "there are x")),
    "plot of what is not there": (lambda: branch().plot.response("y"), ss.InputError, ("no dof 'y'", "there are x")),
    "variable misspelt": (lambda: branch().dataset["dispacement"], KeyError, ("displacement",)),
    "contact misspelt": (lambda: branch().plot.loop(0, "dampr"), ss.InputError, ("did you mean 'damper'?",)),
    "no such point": (lambda: branch().states(999), ss.InputError, ("found 999", "whole number from")),
    "frequency of no unit": (lambda: branch().at("abc"), ss.InputError, ("found 'abc'", "3000 rpm")),
    "saved over a folder": (lambda: branch().save("."), ss.InputError, ("cannot be written", "another place")),
    "saved into nowhere": (lambda: branch().save("none/r.nc"), ss.InputError, ("cannot be written",)),
    "loaded from nowhere": (lambda: ss.load("none.nc"), ss.InputError, ("there is no such file",)),
    "loaded from something else": (lambda: ss.load(__file__), ss.InputError, ("not a results file",)),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_is_refused_in_one_sentence(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    call, kind, fragments = REFUSED[name]
    with pytest.raises(kind) as told:
        call()
    said = str(told.value)
    for fragment in fragments:
        assert fragment in said
    assert len(said.splitlines()) == 1
    assert not any(raw in said for raw in ("<U", "dtype", "np.float64", "object at 0x", "Outcome."))


def computed(given: ss.Problem) -> ss.Branch:
    return ss.linear_response(given, omega=6.0)


WARNED: dict[str, tuple[Callable[[], Any], str]] = {
    "kt = 0": (lambda: computed(problem(contacts=pair(contact(kt=0.0)))), "kt = 0, so no sliding changes"),
    "mu = 0": (lambda: computed(problem(contacts=pair(contact(mu=0)))), "mu = 0, so there is no friction force"),
    "mu in per cent": (
        lambda: computed(problem(contacts=pair(contact(mu=30)))), "mu = 30 is more than dry surfaces reach",
    ),
    "open and fixed": (
        lambda: computed(problem(contacts=pair(ss.FrictionContact(kt=1.0, mu=0.3, gap=1.0)))), "so it never acts",
    ),
    "omega in Hz": (lambda: forced(omega=(0.5, 1.5)), "were they meant in Hz?"),
}  # fmt: skip


@pytest.mark.parametrize("name", WARNED)
def test_is_warned_of(name: str) -> None:
    call, fragment = WARNED[name]
    with pytest.warns(ss.SlipstickWarning, match=fragment.replace("?", r"\?")):
        call()


def curve(given: ss.Problem, **changes: Any) -> np.ndarray:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)
        found = ss.forced_response(given, **({"omega": RANGE} | changes))
    return found.dataset.amplitude.values


def many(**changes: Any) -> ss.FrictionContact:
    return ss.FrictionContact(**({"kt": [100.0, 50.0], "mu": 0.3, "normal_load": [800.0, 400.0]} | changes))


HZ = tuple(f"{w / (2 * np.pi):.17g} Hz" for w in RANGE)
RPM = tuple(f"{w * 30 / np.pi:.17g} rpm" for w in RANGE)
PLAIN = ss.Problem(STRUCTURE, contacts=[PAIR], loads=[LOAD], harmonics=ss.Harmonics(range(6)))
TAKEN: dict[str, Callable[[], tuple[Any, Any]]] = {
    "a single contact, a single load": (lambda: (curve(PROBLEM), curve(PLAIN))),
    "a generator of loads": lambda: (curve(problem(loads=(load for load in [LOAD]))), curve(PLAIN)),
    "harmonics as a text": lambda: (curve(problem(harmonics="0..5")), curve(PLAIN)),
    "harmonics as a count": lambda: (curve(problem(harmonics=5)), curve(PLAIN)),
    "harmonics of numpy": lambda: (curve(problem(harmonics=np.arange(6))), curve(PLAIN)),
    "range in Hz": lambda: (curve(PLAIN, omega=HZ), curve(PLAIN)),
    "range in rpm": lambda: (curve(PLAIN, omega=list(RPM)), curve(PLAIN)),
    "range of an array": lambda: (curve(PLAIN, omega=np.array(RANGE)), curve(PLAIN)),
    "downwards": lambda: (curve(PLAIN, omega=RANGE[::-1], at=6.0)[-1], curve(PLAIN, at=6.0)[0]),
    "points in Hz": lambda: (
        forced(at="1 Hz", options=None).dataset.omega.values,
        forced(at=2 * np.pi, options=None).dataset.omega.values,
    ),
    "linear response in Hz": lambda: (
        ss.linear_response(PLAIN, omega=list(HZ)).dataset.amplitude,
        ss.linear_response(PLAIN, omega=RANGE).dataset.amplitude,
    ),
    "a point by Hz": lambda: (branch().at(HZ[1]), branch().at(RANGE[1])),
    "a study in Hz": lambda: (
        study({"damper.mu": 0.3}, omega=HZ).peak_amplitude.values, study({"damper.mu": [0.3]}).peak_amplitude.values,
    ),
    "numpy numbers": lambda: (contact(kt=np.float32(100), mu=np.float64(0.3), normal_load=np.int64(800)), CONTACT),
    "whole numbers": lambda: (contact(kt=100, normal_load=800), CONTACT),
    "arrays that are not contiguous": lambda: (many(kt=np.array([100.0, 0.0, 50.0])[::2]).kt, many().kt),
    "arrays of xarray": lambda: (many(kt=xarray.DataArray([100.0, 50.0])).kt, many().kt),
    "matrices of whole numbers": lambda: (two(M=np.eye(2, dtype=int)).natural_frequencies, two().natural_frequencies),
    "matrices by columns": lambda: (two(K=np.asfortranarray(two().K)).natural_frequencies, two().natural_frequencies),
    **{
        f"matrices as {kind.__name__}": lambda kind=kind: (
            two(K=kind(two().K)).natural_frequencies, two().natural_frequencies,
        )
        for kind in (scipy.sparse.csr_matrix, scipy.sparse.coo_array, scipy.sparse.dia_array, scipy.sparse.lil_matrix)
    },
    "names as an array": lambda: (two(dofs=np.array(["tip", "root"])).dofs, two().dofs),
    "pickled": lambda: (curve(pickle.loads(pickle.dumps(PROBLEM))), curve(PLAIN)),
    **{
        f"typed again: {made!r}": lambda made=made: (eval(repr(made), {n: getattr(ss, n) for n in ss.__all__}), made)
        for made in (
            CONTACT, contact(kn=3.0), contact(kn=3e7, normal_load=811.3), ss.FrictionContact(kt=1.0, mu=0.3, gap=-3.0),
            LOAD, ss.Load(dof="x", amplitude=3.0, phase=0.3), ss.Load(base={"x": 1.0}, motion="displacement", cos=1.0),
            ss.RubbingMotion(), ss.RubbingMotion(velocity=3.0, cos={1: 2.0}), PAIR, ss.Harmonics("0, 1, 3"),
            pair(tangential=[{"x": 1.0, "y": -1.0}, "x"]),
        )
    },
}  # fmt: skip


@pytest.mark.parametrize("name", TAKEN)
def test_means_the_same_as_the_plain_form(name: str) -> None:
    found, plain = TAKEN[name]()
    if isinstance(plain, np.ndarray | xarray.DataArray):
        np.testing.assert_allclose(found, plain, rtol=1e-9)  # frequencies in Hz differ by their rounding
    else:
        assert found == plain


def test_a_list_changed_afterwards_changes_nothing() -> None:
    stiffness = np.array([100.0, 50.0])
    made = many(kt=stiffness)
    stiffness[:] = 0.0
    assert made.kt.tolist() == [100.0, 50.0]


def test_a_normal_load_prints_itself_so() -> None:
    assert repr(CONTACT) == "FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)"
    changed = problem().with_parameter("damper.normal_load", 700.0)
    assert repr(changed.contacts[0].contact).endswith("normal_load=700.0)")
    assert repr(ss.FrictionContact(kt=1.0, mu=0.3, gap=-8.0)) == "FrictionContact(kt=1.0, mu=0.3, gap=-8.0)"


def test_an_outcome_prints_its_sentence() -> None:
    few = forced(options={"max_points": 2})
    assert repr(few) == "Branch(3 points, point limit)"
    assert f"{few.outcome}" == few.outcome.text
