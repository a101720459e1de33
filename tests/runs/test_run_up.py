"""Passing through: against closed forms, the balance of energy, over thousands of periods, killed and gone on with."""

from __future__ import annotations

import gc
import json
import os
import signal
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.command import slipstick
from helpers.faults import raises_fault
from helpers.study_case import CASE
from scipy.optimize import minimize_scalar
from scipy.special import wofz

import slipstick as ss
from slipstick.analysis.events import PointFound
from slipstick.analysis.time_domain.long_run import LongRun
from slipstick.analysis.time_domain.transient import transient
from slipstick.io.journal import Journal, read_journal, unpacked
from slipstick.io.loading import load_dataset
from slipstick.results.run_up import RunUp, motion_kind
from slipstick.runs.passing_through import run_up_of_case

DAMPING, STIFFNESS, SPRING, FORCE = 0.4, 40.0, 100.0, 100.0


def oscillator(
    *, normal_load: float = 800.0, velocity: float = 0.0, loads: Any = None, rubbing: Any = None, **contact: Any
) -> ss.Problem:
    """The oscillator of one mass with a friction damper."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[DAMPING]], K=[[STIFFNESS]], dofs=["x"])
    law = ss.FrictionContact(kt=SPRING, mu=0.3, normal_load=normal_load, **contact)
    pair = ss.ContactPair(
        name="damper", contact=law, tangential="x", rubbing=rubbing or ss.RubbingMotion(velocity=velocity)
    )
    return ss.Problem(structure, contacts=pair, loads=loads or ss.Load(dof="x", sin=FORCE), harmonics=range(11))


def stuck(**more: Any) -> ss.Problem:
    """One whose contact always sticks: linear, its stiffness that of both springs."""
    return oscillator(normal_load=1e9, **more)


def passing(time: Any, start: float, rate: float) -> Any:
    """Response to ``sin phi``, ``phi = start t + rate t^2 / 2``, of the stuck oscillator from rest: the imaginary part.

    It all turns forwards: of the free vibration that would turn backwards that which has the same imaginary part is
    taken, so that the magnitude is the envelope.
    Lewis, Trans. ASME 54 (1932) 253-261, in the error function of complex argument: with the eigenvalues s,
    ``int_0^t e^{(i start - s) t' + i rate t'^2 / 2} dt'`` for each.
    """
    time = np.asarray(time, dtype=complex)
    delta = 0.5 * DAMPING
    turning = np.sqrt(STIFFNESS + SPRING - delta**2)
    root = np.sqrt(-0.5j * rate)
    out = np.zeros_like(time)
    for s, sign in ((-delta + 1j * turning, 1.0), (-delta - 1j * turning, -1.0)):
        shift = (1j * start - s) / (1j * rate)
        root = root if (root * shift).real > 0.0 else -root  # either is right, this one loses no digits
        ends = [root * (t + shift) for t in (np.zeros_like(time), time)]
        before, now = (wofz(1j * z) for z in ends)
        phi = start * time + 0.5 * rate * time**2
        scale = sign * np.sqrt(np.pi) / (2.0 * root) / (2j * turning)
        free, forced = scale * np.exp(s * time) * before, -scale * np.exp(1j * phi) * now
        out += forced + (free if sign > 0 else -free.conj())
    return out


@pytest.mark.parametrize(
    ("span", "rate"),
    [pytest.param((10.0, 14.0), 0.1, marks=pytest.mark.verify), ((14.0, 10.0), 0.2), ((10.0, 14.0), 0.3)],
)
def test_the_linear_oscillator_lags_as_in_closed_form(span: tuple[float, float], rate: float) -> None:
    run = ss.runs.run_up(stuck(), span, rate=rate)
    signed = rate if span[1] > span[0] else -rate
    data = run.dataset
    exact = FORCE * passing(data["sample_time"].to_numpy(), span[0], signed).imag
    np.testing.assert_allclose(data["displacement"].to_numpy()[:, 0], exact, atol=1e-9 * np.abs(exact).max())
    times = np.linspace(0.0, (span[1] - span[0]) / signed, 2000)
    k = int(np.argmax(np.abs(passing(times, span[0], signed))))
    found = minimize_scalar(
        lambda t: -float(np.abs(passing(t, span[0], signed))), bounds=(times[k - 1], times[k + 1]), method="bounded",
        options={"xatol": 1e-10},
    )  # fmt: skip
    peak = run.peak("x")
    assert peak.amplitude == pytest.approx(-FORCE * found.fun, rel=1e-4)
    steady = float(np.sqrt(STIFFNESS + SPRING - 0.5 * DAMPING**2))
    assert peak.omega == pytest.approx(span[0] + signed * found.x, rel=1e-4)
    assert np.sign(peak.omega - steady) == np.sign(signed)  # later on the way


@pytest.mark.verify
def test_the_faster_the_later_and_lower() -> None:
    branch = ss.forced_response(stuck(), omega=(10.0, 14.0))
    lags = [ss.runs.run_up(stuck(), (10.0, 14.0), rate=rate, samples=0).lag(branch, "x") for rate in (0.1, 0.3, 0.9)]
    assert lags[0].shift < lags[1].shift < lags[2].shift
    assert 1.0 > lags[0].ratio > lags[1].ratio > lags[2].ratio
    assert lags[0].steady_amplitude == pytest.approx(FORCE / (DAMPING * np.sqrt(STIFFNESS + SPRING - 0.04)), rel=1e-6)


def test_an_unbalance_is_the_second_derivative_of_its_motion() -> None:
    """``e d^2/dt^2`` of the turning mass, with its part along the circle, against an integration by scipy."""
    from scipy.integrate import solve_ivp

    load = ss.Load(dof="x", motion="unbalance", cos=0.5, harmonic=2)
    span, rate, m = (3.0, 6.0), 0.5, 2
    run = ss.runs.run_up(stuck(loads=load), span, rate=rate)

    def rates(t: float, y: Any) -> list[float]:
        phi, speed = span[0] * t + 0.5 * rate * t * t, span[0] + rate * t
        force = 0.5 * ((m * speed) ** 2 * np.cos(m * phi) + m * rate * np.sin(m * phi))
        return [y[1], force - DAMPING * y[1] - (STIFFNESS + SPRING) * y[0]]

    times = run.dataset["sample_time"].to_numpy()
    exact = solve_ivp(rates, (0.0, times[-1]), [0.0, 0.0], method="DOP853", t_eval=times, rtol=1e-11, atol=1e-12).y[0]
    np.testing.assert_allclose(run.dataset["displacement"].to_numpy()[:, 0], exact, atol=1e-8 * np.abs(exact).max())


def test_a_slow_sweep_with_rub_is_the_steady_motion_and_a_speed_that_stays_becomes_it() -> None:
    problem = oscillator(velocity=10.0, rubbing=ss.RubbingMotion(velocity=10.0, cos={1: 0.5}, sin={2: 0.3}))
    steady = transient(problem, 9.0)
    run = ss.runs.run_up(problem, 9.0, periods=80, samples=0).dataset.isel(period=-1, dof=0)
    size = max(float(run["highest"] - run["mean"]), float(run["mean"] - run["lowest"]))
    assert size == pytest.approx(steady.amplitude[0], rel=1e-6)
    assert float(run["dissipated_power"][0]) == pytest.approx(steady.power[0], rel=1e-6)
    assert float(run["stick_fraction"][0]) == pytest.approx(steady.fractions[0, 1], abs=1e-6)
    slow = ss.runs.run_up(problem, (9.0, 9.05), rate=2e-3, samples=0).dataset.isel(period=-1, dof=0)
    there = transient(problem, float(slow["omega"]))
    assert float(slow["highest"]) == pytest.approx(there.displacement.max(), rel=2e-3)


def test_steps_do_not_matter() -> None:
    problem = oscillator(rubbing=ss.RubbingMotion(velocity=10.0, cos={1: 0.5}))
    coarse, fine = (ss.runs.run_up(problem, (9.0, 12.0), rate=0.5, samples=0, steps=n).dataset for n in (64, 100))
    for name in ("section_displacement", "section_velocity", "dissipated_power", "stick_fraction"):
        np.testing.assert_allclose(coarse[name], fine[name], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(coarse["change_time"], fine["change_time"], rtol=1e-10)


def tip() -> ss.Problem:
    """Two masses, the second rubs under a normal load that comes and goes."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.3 * np.eye(2), K=[[60.0, -10.0], [-10.0, 90.0]], dofs=["x", "y"])
    pair = ss.ContactPair(
        name="tip", contact=ss.FrictionContact(kt=80.0, mu=0.3, kn=50.0, gap=0.2), tangential="x", normal="y",
        rubbing=ss.RubbingMotion(velocity=5.0, cos={1: 0.2}, normal_cos={2: 0.3}),
    )  # fmt: skip
    loads = [ss.Load(dof="x", sin=40.0), ss.Load(dof="y", cos=30.0)]
    return ss.Problem(structure, contacts=pair, loads=loads, harmonics=range(4))


@pytest.mark.parametrize("make", [tip, lambda: oscillator(rubbing=ss.RubbingMotion(velocity=10.0, cos={1: 0.5}))])
def test_energy_is_kept_with_rub_and_separation(make: Any) -> None:
    data = ss.runs.run_up(make(), (6.0, 9.0), rate=0.15, samples=0).dataset
    assert data["energy_error"].to_numpy().max() < 1e-12
    assert data["change_time"].size > data.sizes["period"]
    if "tip" in data["contact"]:
        assert 0.05 < float(data["separation_fraction"].mean()) < 0.95


@pytest.mark.verify
def test_energy_is_kept_and_memory_flat_over_two_thousand_periods_with_rub(tmp_path: Path) -> None:
    used: dict[int, int] = {}

    def listen(done: Any) -> None:
        if done.checkpoint.period in (200, 2000):
            gc.collect()  # what waits for it comes and goes
            used[done.checkpoint.period] = tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        run = ss.runs.run_up(tip(), 7.0, periods=2000, folder=tmp_path, listener=listen, samples=8)
    finally:
        tracemalloc.stop()
    assert run.dataset["energy_error"].to_numpy().max() < 1e-9
    assert run.dataset.sizes["period"] == 2000
    assert used[2000] - used[200] < 50_000  # bytes; the samples and events of so many periods are forty times that


def test_what_is_killed_goes_on_to_the_last_bit(tmp_path: Path) -> None:
    problem, arguments = tip(), {"omega": (6.0, 7.0), "rate": 0.1}

    def stop(done: Any) -> None:
        if done.checkpoint.period == 4:
            raise KeyboardInterrupt

    part = ss.runs.run_up(problem, **arguments, folder=tmp_path, listener=stop)
    assert part.dataset.attrs["outcome"] == "INTERRUPTED"
    assert part.dataset.sizes["period"] == 4
    journal = tmp_path / "run_up.nc.journal"
    journal.write_bytes(journal.read_bytes()[:-7])  # as a kill leaves it: the last period cut short
    heard: list[int] = []
    whole = ss.runs.run_up(
        problem, **arguments, folder=tmp_path, listener=lambda done: heard.append(done.checkpoint.period)
    )
    assert heard[0] == 4
    assert not journal.exists()
    direct = ss.runs.run_up(problem, **arguments)
    for name in direct.dataset.variables:
        np.testing.assert_array_equal(whole.dataset[name], direct.dataset[name])
    again = ss.runs.run_up(problem, **arguments, folder=tmp_path, listener=stop)
    assert again.dataset.attrs["outcome"] == "COMPLETED"
    with pytest.raises(ss.InputError, match="already holds another run-up"):
        ss.runs.run_up(problem, omega=(6.0, 7.0), rate=0.2, folder=tmp_path)


def test_the_spectrum_of_a_linear_motion_is_its_amplitude() -> None:
    run = ss.runs.run_up(stuck(), 6.0, periods=90)
    size = FORCE / abs(140.0 - 36.0 + 0.4j * 6.0)
    omega, amplitude = run.spectrum("x", last=64)
    k = int(np.argmax(amplitude))
    assert omega[k] == pytest.approx(6.0, abs=0.1)
    assert amplitude[k] == pytest.approx(size, rel=0.03)
    image = run.spectrogram("x")
    assert float(image.isel(time=-1).max()) == pytest.approx(size, rel=0.03)
    assert float(image["frequency"][int(np.argmax(image.to_numpy()[:, -1]))]) == pytest.approx(6.0, abs=0.5)
    assert run.motion("x").kind == "periodic"


@pytest.mark.parametrize(
    ("turn", "kind", "periods"),
    [
        (lambda k: 0.0 * k, "periodic", 1),
        (lambda k: np.pi * k, "subharmonic", 2),
        (lambda k: 2 * np.pi * 0.2137531 * k, "quasi-periodic", 0),
        (lambda k: np.cumsum(np.random.default_rng(1).uniform(0.0, 6.0, k.size)), "irregular", 0),
    ],
)
def test_sections_tell_what_motion_it_is(turn: Any, kind: str, periods: int) -> None:
    angle = turn(np.arange(256.0))
    x, v = 1.0 + 0.2 * np.cos(angle) + 0.03 * np.sin(2 * angle), 0.5 * np.sin(angle)
    found = motion_kind(x, v, 3.0, 1.2)
    assert (found.kind, found.periods) == (kind, periods)
    if kind == "quasi-periodic":
        assert found.turns == pytest.approx(0.2137531, abs=1e-8)
        assert found.second_omega == pytest.approx(3.0 * 0.2137531, abs=1e-8)


@pytest.mark.parametrize(
    ("given", "where"),
    [
        ({"omega": (4.0, 9.0)}, "run_up, rate"),
        ({"omega": 4.0}, "run_up, periods"),
        ({"omega": 4.0, "periods": 3, "rate": 1.0}, "run_up, rate"),
        ({"omega": (4.0, 4.0), "rate": 1.0}, "run_up, omega"),
        ({"omega": (4.0, 9.0), "rate": -1.0}, "run_up, rate"),
        ({"omega": (4.0, 9.0), "rate": 1e3}, "run_up, rate"),
    ],
)
def test_what_is_no_run_up(given: dict[str, Any], where: str) -> None:
    with raises_fault(where=(where,)):
        ss.runs.run_up(stuck(), **given)


def test_a_structure_that_turns_with_the_excitation_is_refused() -> None:
    structure = ss.MatrixStructure(
        M=np.eye(2), C=np.eye(2), K=40.0 * np.eye(2), dofs=["x", "y"], gyroscopic=[[0.0, 0.3], [-0.3, 0.0]],
        engine_order=1,
    )  # fmt: skip
    pair = ss.ContactPair(name="a", contact=ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0), tangential="x")
    problem = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=1.0), harmonics=range(3))
    with pytest.raises(ss.InputError, match="turns with the excitation"):
        ss.runs.run_up(problem, (1.0, 2.0), rate=0.1)


def test_a_run_is_what_it_is_by_its_arguments() -> None:
    run = LongRun(problem=stuck(), start=2.0, stop=2.0, rate=0.0, periods=3, samples=4)
    values = [done.values["time"] for done in run.after()]
    np.testing.assert_allclose(values, 2 * np.pi * np.arange(1, 4) / 2.0)


def test_the_verb_integrates_draws_and_goes_on(tmp_path: Path) -> None:
    table = '[run_up]\nfrom = 5.0\nto = "1.2 Hz"\nrate = 0.5\nsamples = 8\n'
    text = CASE.partition("[study]")[0]
    (tmp_path / "case.toml").write_text(text + table)
    arguments = ("run-up", tmp_path / "case.toml", "-o", tmp_path / "out", "-q")
    done = slipstick(*arguments)
    assert done.exit_code == 0
    case = ss.Case.from_file(tmp_path / "case.toml")
    peak = ss.runs.run_up(case.problem(), (5.0, 2.4 * np.pi), rate=0.5, samples=8).peak()
    assert f"largest half range of x: {peak.amplitude:.6g}" in done.output
    assert {p.name for p in (tmp_path / "out").iterdir()} >= {"run_up.nc", "run_up.png", "report.html"}
    assert slipstick(*arguments, "--no-figures").exit_code == 0  # what is there is told again
    (tmp_path / "bad.toml").write_text(text + "[run_up]\nfrom = 5.0\nto = 7.0\n")
    bad = slipstick("run-up", tmp_path / "bad.toml")
    assert bad.exit_code == 2
    assert "[run_up] rate is missing" in bad.output


def test_resume_goes_on_with_a_run_up_to_the_last_bit(tmp_path: Path) -> None:
    case = tmp_path / "case.toml"
    case.write_text(CASE.partition("[study]")[0] + "[run_up]\nfrom = 5.0\nto = 7.5\nrate = 0.5\nsamples = 8\n")
    read = ss.Case.from_file(case)
    folder, table = tmp_path / "out", read.further["run_up"]

    def stop(done: Any) -> None:
        if done.checkpoint.period == 2:
            raise KeyboardInterrupt

    assert run_up_of_case(read, table, folder, stop).dataset.attrs["outcome"] == "INTERRUPTED"
    killed = tmp_path / "killed"
    killed.mkdir()
    (killed / "run_up.nc.journal").write_bytes((folder / "run_up.nc.journal").read_bytes())  # a kill leaves no more
    direct = ss.runs.run_up(read.problem(), table.omega, rate=table.rate, samples=8).dataset
    for begun in (folder, killed):
        result = slipstick("resume", begun, "-q", "--no-figures", "--no-report")
        assert result.exit_code == 0, result.output
        with pytest.raises(ss.InputError, match="holds a run-up"):
            ss.load(begun / "run_up.nc")
        whole = ss.resume(begun)
        assert isinstance(whole, RunUp)
        for name in direct.variables:
            np.testing.assert_array_equal(whole.dataset[name], direct[name])
    assert "nothing is left to do" in slipstick("resume", folder).output
    ss.runs.run_up(stuck(), 5.0, periods=4, folder=tmp_path / "python", listener=stop)
    with pytest.raises(ss.InputError, match=r"begun in Python; go on with it by ss\.runs\.run_up"):
        ss.resume(tmp_path / "python")
    assert run_up_of_case(read, table, tmp_path / "changed", stop).dataset.sizes["period"] == 2
    case.write_text(case.read_text().replace("to = 7.5", "to = 8.5"))
    with pytest.raises(ss.InputError, match="the case has changed"):
        ss.resume(tmp_path / "changed")


@pytest.mark.parametrize("period", [3, pytest.param(8, marks=pytest.mark.verify)])
def test_killed_at_a_period_it_goes_on_to_the_last_bit(tmp_path: Path, period: int) -> None:
    child = os.fork()
    if child == 0:

        def kill(done: Any) -> None:
            if done.checkpoint.period == period:
                os.kill(os.getpid(), signal.SIGKILL)

        try:
            ss.runs.run_up(tip(), (6.0, 7.0), rate=0.1, folder=tmp_path, listener=kill)
        finally:
            os._exit(1)
    assert os.WIFSIGNALED(os.waitpid(child, 0)[1])
    assert len(read_journal(tmp_path / "run_up.nc.journal")) == period
    events: list[Any] = []
    whole = ss.runs.run_up(tip(), (6.0, 7.0), rate=0.1, folder=tmp_path, listeners=events.append).dataset
    found = [event for event in events if isinstance(event, PointFound)]
    assert (found[0].number, found[-1].progress) == (period + 1, 1.0)
    assert found[-1].omega == float(whole["omega"][-1])
    direct = ss.runs.run_up(tip(), (6.0, 7.0), rate=0.1).dataset
    for name in direct.variables:
        np.testing.assert_array_equal(whole[name], direct[name])


def test_a_journal_written_before_checkpoints_were_shared_goes_on(tmp_path: Path) -> None:
    problem = tip()

    def stop(done: Any) -> None:
        if done.checkpoint.period == 3:
            raise KeyboardInterrupt

    ss.runs.run_up(problem, 6.0, periods=6, folder=tmp_path, listener=stop)
    recorded = read_journal(tmp_path / "run_up.nc.journal")
    rows, notes = recorded.rows, [unpacked(note) for note in recorded.notes()]
    journal = Journal(recorded.path, recorded.layout, recorded.about)
    for row, note in zip(rows, notes, strict=True):
        kept = ("times", "series", "changes", "period", "states", "z", "energy", "energy_names")
        journal.append(row, {name: note[name] for name in kept})
    journal.close(remove=False)
    whole = ss.runs.run_up(problem, 6.0, periods=6, folder=tmp_path).dataset
    direct = ss.runs.run_up(problem, 6.0, periods=6).dataset
    for name in direct.variables:
        np.testing.assert_array_equal(whole[name], direct[name])


def test_its_time_is_limited_and_resume_goes_on(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(CASE.partition("[study]")[0] + "[run_up]\nfrom = 5.0\nperiods = 3\n")
    arguments = ("run-up", tmp_path / "case.toml", "-o", tmp_path / "out", "-q", "--no-figures", "--no-report")
    late = slipstick(*arguments, "--time-limit", "1e-9 s", "--json")
    assert (late.exit_code, json.loads(late.stdout)["outcome"]) == (1, "TIME_LIMIT")
    assert slipstick("resume", tmp_path / "out", "--time-limit", "1 h", "-q", "--no-report").exit_code == 0
    assert RunUp(load_dataset(tmp_path / "out" / "run_up.nc")).dataset.sizes["period"] == 3
