"""Problems in results files: what comes back is what was stored, bit for bit; what is damaged is told and left out."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray
from helpers.faults import raises_fault
from scipy import sparse

import slipstick as ss
from slipstick.io.netcdf import read_netcdf
from slipstick.io.problem import describe, fingerprint
from slipstick.structure.modal import LoadShape

CURVE = ss.FrictionCurve(temperature=[25, 4000], mu=[0.5, 0.4], interpolation="natural")
RUB = ss.RubbingMotion(velocity=3.0, cos={1: 0.1, 2: 1 / 3}, normal_sin={2: 1e-3})


def contact(name: str = "damper", **more: Any) -> ss.ContactPair:
    element = ss.FrictionContact(kt=100.0, mu=0.3, kn=7.0, normal_load=80.0)
    return ss.ContactPair(**{"name": name, "contact": element, "tangential": "x", "rubbing": RUB} | more)


def oscillator(**more: Any) -> ss.Problem:
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"], load_shapes={"a/b": [2.0]})
    given = {"contacts": [contact()], "loads": [ss.Load(shape="a/b", sin=100.0)], "harmonics": [0, 1, 2, 3]}
    return ss.Problem(structure, **given | more)


def modal() -> ss.Problem:
    structure = ss.ModalStructure(
        omega=[10.0, 20.0], mode_shapes=[[1.0, 0.5], [0.2, -1.0]], static_compliance=[[0.02, 0.0], [0.0, 0.01]],
        second_residual=[[1e-9, 0.0], [0.0, 1e-9]], dofs=["x", "y"], loss_factor=0.01, damping_ratio=[0.0, 0.02],
        load_shapes={"pressure": LoadShape(participation=[2.0, 1.0], static_response=[0.03, 0.01])},
    )  # fmt: skip
    many = contact("m", contact=ss.FrictionContact(kt=[1.0, 2.0], mu=0.3, kn=1.0, gap=[-1.0, -2.0]),
                   tangential=["x", {"x": 0.6, "y": -0.8}], normal="y", rubbing=None)  # fmt: skip
    return ss.Problem(
        structure, contacts=[contact(), many], loads=[ss.Load(shape="pressure", sin=1.0), ss.Load(dof="y", cos=0.1)],
        harmonics=[0, 1, 2, 3, 4, 6], outputs=["y"], period_ratio=(1, 2), title='"two" bodies, größer', load=0.7,
        friction=0.9,
    )  # fmt: skip


def large() -> ss.Problem:
    n = 130
    K = sparse.diags_array([np.full(n, 2.0), np.full(n - 1, -1.0), np.full(n - 1, -1.0)], offsets=[0, 1, -1])
    structure = ss.MatrixStructure(M=sparse.eye_array(n), K=K, dofs=["x", *map(str, range(1, n))], loss_factor=0.02)
    return ss.Problem(structure, contacts=[contact()], loads=[ss.Load(dof="5", sin=1.0)], outputs=["x"])


def solved() -> ss.Problem:
    """A chain whose residuals are applied by solutions."""
    n = 60
    K = sparse.diags_array([np.full(n, 2.0), np.full(n - 1, -1.0), np.full(n - 1, -1.0)], offsets=[0, 1, -1])
    structure = ss.reduce(
        1e3 * K, sparse.eye_array(n), keep=["x", "7", "50"], dofs=["x", *map(str, range(1, n))], modes=9,
        loss_factor=0.02, load_shapes={"all": np.ones(n)}, residuals="solved",
    )  # fmt: skip
    return ss.Problem(structure, contacts=[contact()], loads=[ss.Load(shape="all", sin=1.0)], outputs=["x", "50"])


def heated(resistance: Any = 0.1) -> ss.Problem:
    thermal = ss.ThermalModel(
        curve={"damper": CURVE}, background={"damper": 25.0, "b": 30.0}, resistance=resistance,
        contacts=["damper", "b"] if np.ndim(resistance) == 2 else None,
    )  # fmt: skip
    return oscillator(contacts=[contact(), contact("b")], thermal=thermal)


PROBLEMS: dict[str, Callable[[], ss.Problem]] = {
    "matrices": oscillator,
    "modes": modal,
    "sparse": large,
    "solved": solved,
    "heated": heated,
    "heated by name": lambda: heated({"damper": 0.2}),
    "influence": lambda: heated(np.array([[0.1, 0.02], [0.02, 0.1]])),
}


def saved(problem: ss.Problem, folder: Path) -> Path:
    return ss.linear_response(problem, omega=[4.0, 5.0]).save(folder / "r.nc")


def same(a: Any, b: Any) -> bool:
    """Equal in everything that computes, by value and bit."""
    if hasattr(a, "tocsc"):
        return bool(np.array_equal(a.toarray(), b.toarray()))
    if isinstance(a, np.ndarray) or np.ndim(a):
        return bool(np.array_equal(np.asarray(a), np.asarray(b)))
    if is_dataclass(a):
        return type(a) is type(b) and all(same(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if hasattr(a, "arguments"):
        return type(a) is type(b) and same(a.arguments, b.arguments)
    if isinstance(a, ss.FrictionCurve):
        return a.content == b.content
    return bool(a == b)


@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
@pytest.mark.parametrize("make", PROBLEMS.values(), ids=PROBLEMS)
def test_problems_come_back_bit_for_bit(tmp_path: Path, make: Callable[[], ss.Problem]) -> None:
    problem = make()
    path = saved(problem, tmp_path)
    again = ss.load(path)
    assert again.problem is not None, again.without
    for f in fields(problem):
        mine, other = getattr(problem, f.name), getattr(again.problem, f.name)
        if isinstance(mine, tuple):
            assert len(mine) == len(other)
            assert all(same(a, b) for a, b in zip(mine, other, strict=True)), f.name
        else:
            assert same(mine, other), f.name
    twice = again.save(tmp_path / "twice.nc")
    assert again.dataset.identical(ss.load(twice).dataset)
    mine, other = (read_netcdf(p, "problem") for p in (path, twice))
    assert mine.attributes == other.attributes
    assert list(mine.variables) == list(other.variables)
    assert all(np.array_equal(v.values, other.variables[name].values) for name, v in mine.variables.items())


@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
@pytest.mark.parametrize("name", ["modes", "influence", "solved"])
def test_a_loaded_problem_computes_the_same_branch(tmp_path: Path, name: str) -> None:
    branch = ss.forced_response(PROBLEMS[name](), omega=(4.0, 4.2))
    again = ss.load(branch.save(tmp_path / "r.nc"))
    assert again.problem is not None
    assert ss.forced_response(again.problem, omega=(4.0, 4.2)).dataset.equals(branch.dataset)


def spring(x: Any, v: Any, k3: Any) -> Any:
    return k3 * x**3


def test_a_law_that_is_code_is_told_and_can_be_given_again(tmp_path: Path) -> None:
    law = ss.SampledLaw(force=spring, parameters={"k3": 2.0})
    problem = oscillator(contacts=[ss.ContactPair(name="spring", contact=law, ports={"x": "x"})])
    branch = ss.forced_response(problem, omega=(4.0, 4.2))
    with pytest.warns(ss.SlipstickWarning, match=r"r\.nc: saved without the problem: the law of contact 'spring'"):
        path = branch.save(tmp_path / "r.nc")
    again = ss.load(path)
    assert again.dataset.identical(branch.dataset)
    assert again.problem is None
    with pytest.raises(ss.InputError, match="not known: the law of contact 'spring' is a SampledLaw"):
        again.guess(0)
    assert ss.load(again.save(tmp_path / "twice.nc")).without == again.without
    whole = ss.load(path, problem=problem)
    assert np.array_equal(whole.guess(0), branch.guess(0))
    with pytest.raises(ss.InputError, match="its contact labels are damper"):
        ss.load(path, problem=oscillator())


def rewritten(change: Callable[[Any], object]) -> Callable[[h5py.File], None]:
    def spoil(file: h5py.File) -> None:
        description = json.loads(file["problem"].attrs["description"])
        change(description["arguments"])
        file["problem"].attrs["description"] = json.dumps(description)

    return spoil


def replaced(value: Any) -> Callable[[h5py.File], None]:
    return lambda file: file["problem"].attrs.__setitem__("description", value)


def claims(file: h5py.File) -> None:
    del file["problem/structure.K"]
    file["problem"].create_dataset("structure.K", (10**6, 10**6), "f8", chunks=(100, 100))


def elsewhere(file: h5py.File) -> None:
    del file["problem/structure.K"]
    file["problem/structure.K"] = h5py.ExternalLink("secret.h5", "K")


HOSTILE: dict[str, tuple[Callable[[h5py.File], None], str]] = {
    "no JSON": (replaced("nothing"), "cannot be read"),
    "deep": (replaced("[" * 100_000), "cannot be read"),
    "a list": (replaced("[]"), "ss.Problem"),
    "another class": (replaced('{"kind": "os.system", "arguments": {"command": "true"}}'), "os.system"),
    "another argument": (rewritten(lambda a: a.update(command=1)), "command"),
    "a wrong number": (rewritten(lambda a: a["contacts"][0]["arguments"]["contact"]["arguments"].update(kt=-1)), "kt"),
    "another contact": (rewritten(lambda a: a["contacts"][0]["arguments"].update(name="b")), "contact labels are b"),
    "an array that is not there": (rewritten(lambda a: a.update(load={"array": "q"})), "q"),
    "more dofs than fit": (
        rewritten(lambda a: a["structure"].update(kind="modes", arguments={"dofs": ["x"] * 10**5})),
        "at most 20000",
    ),
    "a later format": (lambda file: file["problem"].attrs.__setitem__("format", 2), "reads up to 1"),
    "claims": (claims, "more than the file holds"),
    "elsewhere": (elsewhere, "leads elsewhere"),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_damaged_problem_leaves_the_numbers(tmp_path: Path, kind: str) -> None:
    structure = ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=40.0 * np.eye(2), dofs=["x", "y"])
    problem = ss.Problem(structure, contacts=[contact()], loads=[ss.Load(dof="x", sin=1.0)], harmonics=[0, 1, 2, 3])
    branch = ss.forced_response(problem, omega=(4.0, 4.1))
    path = branch.save(tmp_path / "r.nc")
    spoil, words = HOSTILE[kind]
    with h5py.File(path, "a") as file:
        spoil(file)
    with pytest.warns(ss.SlipstickWarning, match="the numbers are there without it"):
        again = ss.load(path)
    assert words in again.without
    assert again.problem is None
    assert again.dataset.identical(branch.dataset)


def test_results_without_a_group_say_so(tmp_path: Path) -> None:
    path = saved(oscillator(), tmp_path)
    with h5py.File(path, "a") as file:
        del file["problem"]
    assert ss.load(path).without == "the file does not hold it"


@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
def test_other_readers_see_the_problem(tmp_path: Path) -> None:
    path = saved(modal(), tmp_path)
    with xarray.open_dataset(path, group="problem", engine="h5netcdf") as group:
        assert group["structure.omega"].to_numpy().tolist() == [10.0, 20.0]
        assert json.loads(group.attrs["description"])["kind"] == "problem"


def test_where_nothing_can_be_written(tmp_path: Path) -> None:
    with pytest.raises(ss.InputError, match=r"r\.nc: cannot be written"):
        saved(oscillator(), tmp_path / "none")
    with raises_fault("save", found="5"):
        ss.linear_response(oscillator(), omega=3.0).save(5)


def test_what_is_code_inside_a_part_is_told_where_it_is() -> None:
    class Mine(ss.FrictionCurve):
        """Of one's own."""

    problem = heated()
    assert problem.thermal is not None
    other = replace(problem.thermal, curve=Mine(temperature=[0.0, 100.0], mu=[0.3, 0.2]))
    group = describe(replace(problem, thermal=other))
    assert group.variables == {}
    assert list(group.attributes.values()) == ["thermal.curve: a Mine is code and not numbers"]
    assert fingerprint(replace(problem, thermal=other)) != fingerprint(problem)
