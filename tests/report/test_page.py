"""The scripts of the page without a browser: the loop in closed form, and the address that keeps the view."""

from __future__ import annotations

import json
import shutil
import subprocess
from typing import Any

import numpy as np
import pytest
from helpers import blocks
from helpers.oscillator import damper, one_mass
from helpers.pages import opened
from helpers.reports import branch

import slipstick as ss
from slipstick.report.content import content_of
from slipstick.report.encoding import gathered
from slipstick.report.writing import part
from slipstick.results.deflection import deflection_of

node = shutil.which("node")
pytestmark = pytest.mark.skipif(node is None, reason="node, which runs the scripts, is not installed")


def run(script: str, given: Any = None) -> Any:
    """What a script prints as JSON, with ``given`` as its input."""
    own = "\n".join(part(f"{name}.js") for name in ("decode", "law", "model", "view", "charts", "curves"))
    plain, numbers = gathered(given)
    text = f"""globalThis.document = {{}};
      globalThis.getComputedStyle = () => ({{ getPropertyValue: () => "#000" }});
      {own}
      const {{ given, numbers }} = JSON.parse(require("fs").readFileSync(0, "utf8"));
      inflated(numbers).then((buffer) => {{ STORE.buffer = buffer; console.log(JSON.stringify({script})); }});"""
    told = json.dumps({"given": plain, "numbers": numbers})
    done = subprocess.run([str(node), "-e", text], input=told, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def assert_loops_agree(made: ss.Branch, points: list[int], names: list[str]) -> set[str]:
    """Loops of the page are those of Python to 1e-9 of their size; the states that were met."""
    content = content_of(made, "a", contacts=12, dofs=12)
    wanted = [[point, name] for point in points for name in names]
    script = """given.wanted.map(([point, name]) => {
      const found = period(new Result(given.content, 0).element(point, name), times(0, PERIOD, 721));
      return Object.fromEntries(Object.entries(found).map(([key, values]) => [key, [...values]]));
    })"""
    seen = set()
    for (point, name), found in zip(wanted, run(script, {"content": content, "wanted": wanted}), strict=True):
        own = made.loop(point, name)
        for key in ("tau", "motion", "total", "friction", "limit"):
            values = own[key]
            size = np.abs(values).max()
            np.testing.assert_allclose(found[key], values, rtol=0, atol=1e-9 * size, err_msg=f"{point} {name} {key}")
        seen |= {state for _, _, state in made.states(point)[name]}
    return seen


def test_the_loop_of_the_page_is_that_of_python() -> None:
    made = branch()
    seen = assert_loops_agree(made, list(range(0, len(made), 5)), ["joint", "tip"])
    assert seen == {"stick", "slip+", "slip-", "separation"}


def stuck(gap: float = -800.0, velocity: float = 0.0, kt: float = 100.0) -> ss.Branch:
    """An oscillator whose contact never slips, or always does, or is always open."""
    pair = damper(velocity, name="c", law=ss.FrictionContact(kt=kt, mu=0.3, kn=1.0, gap=gap))
    problem = one_mass(pair, force=20.0)
    return ss.forced_response(problem, omega=(2.0, 3.0), options={"max_step": 0.5})


@pytest.mark.filterwarnings("ignore:contact 'c'. the normal load is 0", "ignore:contact 'c'. it was open")
@pytest.mark.parametrize(
    "options, state",
    [({}, "stick"), ({"velocity": 90.0}, "slip+"), ({"velocity": -90.0}, "slip-"), ({"gap": 9.0}, "separation")],
)
def test_one_state_all_period(options: dict[str, float], state: str) -> None:
    assert assert_loops_agree(stuck(**options), [0, 1], ["c"]) == {state}


def test_a_stiff_contact_keeps_its_digits() -> None:
    assert_loops_agree(stuck(gap=-1.0, kt=1e5), [0, 1], ["c"])


def test_pieces_cover_one_period() -> None:
    made = branch()
    content = content_of(made, "a", contacts=12, dofs=12)
    script = 'Array.from({ length: given.points }, (_, p) => pieces(new Result(given, 0).element(p, "tip")))'
    for spans in run(script, content)[::9]:
        assert spans[0][0] == 0.0
        assert spans[-1][1] == pytest.approx(2 * np.pi)
        assert [span[1] for span in spans[:-1]] == pytest.approx([span[0] for span in spans[1:]])


def test_the_shape_moves_as_python_says() -> None:
    made = blocks.branch()
    point, tau = len(made) // 2, 0.7
    script = f"""(() => {{
      const result = new Result(given, 0), motion = result.fieldMotion({point}), {{ fields, nodes }} = result.shape;
      const size = motion.map((X) => series(X, result.orders, {tau}));
      return [...nodes].map((_, i) => fields.reduce((sum, field, k) => sum + size[k] * field[i], 0));
    }})()"""
    found = np.reshape(run(script, content_of(made, "a", contacts=2, dofs=2)), (-1, 3))
    motion = deflection_of(made).at(point) @ made.harmonics.H_minus(tau)
    np.testing.assert_allclose(found, motion, atol=5e-3 * np.abs(motion).max())


def test_amplitudes_of_harmonics() -> None:
    found = run("amplitudes((t) => 3 + 4 * Math.cos(2 * t) - 3 * Math.sin(2 * t) + Math.sin(5 * t), [0, 1, 2, 5])")
    assert found == pytest.approx([3.0, 0.0, 5.0, 1.0], abs=1e-12)


MODEL = "modelOf(given)"
LINES = """given.wanted.map(([curve, over]) => {
  const model = modelOf(given.results), view = { ...viewFrom("", model), curve, over };
  const app = { model, view: viewFrom(addressOf(view), model) };
  const curves = Object.assign(Object.create(Curves.prototype), { app });
  return curves.linesOf(curves.curve).map(({ result, name, x, y }) => [result.index, name, [...x], [...y]]);
})"""


def assert_every_quantity_is_drawn(branches: list[ss.Branch]) -> set[str]:
    """Whatever is chosen, and after a reload, lines are drawn, and they are the numbers of the results."""
    contents = [content_of(made, str(i), contacts=12, dofs=12) for i, made in enumerate(branches)]
    keys = list(dict.fromkeys(curve["key"] for content in contents for curve in content["curves"]))
    wanted = [[key, over["key"]] for key in keys for over in contents[0]["abscissae"]]
    for (key, over), lines in zip(wanted, run(LINES, {"results": contents, "wanted": wanted}), strict=True):
        assert lines, key
        for index, name, x, y in lines:
            assert_line_of(branches[index], key, over, name, x, y)
    return set(keys)


def assert_line_of(made: ss.Branch, key: str, over: str, name: str, x: list[Any], y: list[Any]) -> None:
    data = made.dataset
    np.testing.assert_allclose(np.array(x, float), data[over].values, rtol=1e-12)
    if key == "phase":
        angle = np.radians(np.array(y, float))
        X = data["displacement"].sel(dof=name)
        z = X.sel(coefficient="c1").values - 1j * X.sel(coefficient="s1").values
        np.testing.assert_allclose(np.exp(1j * angle), z / np.abs(z), atol=1e-9)
        return
    own = data[key]
    if "dof" in own.dims:
        own = own.sel(dof=name)
    elif "contact" in own.dims:
        own = own.sel(contact=name) if name else own.sum("contact")
    size = float(np.abs(data["amplitude"]).max()) if key == "mean" else 0.0  # a mean of rounding is drawn as zero
    np.testing.assert_allclose(np.array(y, float), own.values, rtol=1e-9, atol=1e-11 * size, err_msg=f"{key} {name}")


def test_every_quantity_is_drawn_as_it_is() -> None:
    seen = assert_every_quantity_is_drawn([branch(spring=True)])
    assert {"friction_coefficient", "stick_fraction", "slip_fraction", "separation_fraction", "phase"} <= seen


def oscillator(velocity: float = 0.0) -> ss.Problem:
    return one_mass(damper(velocity))


@pytest.mark.filterwarnings("ignore:the damping ratio of the mode")
def test_every_quantity_of_every_kind_of_result() -> None:
    problem = oscillator()
    over = ss.parameter_response(problem, "damper.mu", (0.2, 0.4), omega=9.0)
    assert_every_quantity_is_drawn([over])
    peaks = ss.track_peak(problem, "damper.normal_load", (300.0, 600.0), dof="x", omega=(6.0, 12.0))
    assert "omega" in assert_every_quantity_is_drawn([peaks])
    mode = ss.nonlinear_modes(problem, amplitude=(2.0, 5.0), load_factors=1.0)
    assert {"modal_damping", "load_factor"} <= assert_every_quantity_is_drawn([mode])
    curves = [ss.forced_response(oscillator(v), omega=(8.0, 11.0), stability=v == 0.0) for v in (0.0, 10.0)]
    assert "multiplier_max" in assert_every_quantity_is_drawn(curves)
    linear = ss.linear_response(problem, omega=[3.0, 6.0, 9.0])
    assert assert_every_quantity_is_drawn([linear]) == {"amplitude", "mean", "phase"}


def test_the_address_keeps_the_view() -> None:
    contents = [content_of(branch(), "a", contacts=12, dofs=12)]
    change = """{ point: 7, curve: "mean", dofs: ["z", "a"], contacts: ["", "tip"], contact: "tip", loop: "motion",
      unit: "Hz", log: "y", all: true }"""
    script = f"""(() => {{
      const model = {MODEL}, view = {{ ...viewFrom("", model), ...{change} }};
      return [view, viewFrom(addressOf(view), model)];
    }})()"""
    view, again = run(script, contents)
    assert again == view


@pytest.mark.parametrize(
    "address",
    ["#point=99999&result=7&curve=nothing&dof=q&at-contact=q&unit=parsec&log=zz", "#point=-1&result=1.5&%E0%A4%A", "#"],
)
def test_a_strange_address_shows_the_beginning(address: str) -> None:
    contents = [content_of(branch(), "a", contacts=12, dofs=12)]
    start, view = run(
        f"(() => {{ const m = {MODEL}; return [viewFrom('', m), viewFrom({json.dumps(address)}, m)]; }})()", contents
    )
    assert view == start


def test_the_view_starts_at_the_largest_amplitude() -> None:
    made = branch()
    view = run(f"viewFrom('', {MODEL})", [content_of(made, "a", contacts=12, dofs=12)])
    point, dof = np.unravel_index(made.dataset["amplitude"].values.argmax(), made.dataset["amplitude"].shape)
    assert (view["point"], view["dof"], view["curve"]) == (point, "abz"[dof], "amplitude")


@pytest.mark.parametrize(("low", "high"), [(3295.0, 3677.0), (1.2, 4.5), (2.1e-4, 4.9e-4), (0.02, 7e3)])
def test_a_logarithmic_axis_has_numbers_that_are_right(low: float, high: float) -> None:
    """Three at least, within the axis, each written as it is."""
    ticks = run("ticksOf({ log: true }, given, ...given, 8)", [low, high])
    assert len(ticks) >= 3
    powers = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    for value, text in ticks:
        assert low <= value <= high
        mantissa, _, exponent = text.rpartition("10") if any(c in "⁰¹²³⁴⁵⁶⁷⁸⁹" for c in text) else (text, "", "0")
        told = float(mantissa.rstrip("·") or 1.0) * 10.0 ** int(exponent.translate(powers) or 0)
        assert told == pytest.approx(value, rel=1e-9)


def test_a_logarithmic_axis_is_as_long_as_its_values() -> None:
    low, high = run("rangeOf([[345, 385]], { log: true, air: 0.015 })")
    assert 344.0 < low < 345.0
    assert 385.0 < high < 386.0


def test_every_peak_is_listed() -> None:
    """However many: the list scrolls."""
    content = content_of(branch(), "a", contacts=2, dofs=3)
    content["notes"] = [[point, point % 3, "peak"] for point in range(100)]
    rows = opened({"results": [content]}, 'return app.curves.side.querySelectorAll("tbody tr").length')
    assert rows == 100


def test_the_list_is_of_the_dof_that_the_page_begins_with() -> None:
    """Where none was asked for: of that which moves most, as in figures and on the terminal."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.1 * np.eye(2), K=[[20.0, -1.0], [-1.0, 4.0]], dofs=["x", "y"])
    contact = ss.ContactPair(name="c", contact=ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0), tangential="x")
    problem = ss.Problem(structure, contacts=contact, loads=ss.Load(dof="y", sin=1.0), harmonics=range(6))
    content = content_of(ss.forced_response(problem, omega=(1.5, 2.5)), "a", contacts=1, dofs=2)
    content |= {"analysis": "cycles", "asked": [], "notes": [[5, -1, "requested"]]}
    head, drawn = opened(
        {"results": [content]},
        """return [app.curves.side.querySelectorAll("th").map((cell) => cell.textContent).at(-1), app.view.dofs[0]]""",
    )
    assert (drawn, head.split(" [")[0]) == ("y", "amplitude of y")


@pytest.mark.filterwarnings("ignore:the damping ratio of the mode")
def test_the_list_of_a_mode_tells_the_amplitude_that_the_terminal_tells() -> None:
    mode = ss.nonlinear_modes(one_mass(damper()), amplitude=(1.5, 4.5), load_factors=[0.5, 1.0])
    at = np.flatnonzero(mode.dataset["kind"].values == "requested")
    texts = opened(
        {"results": [content_of(mode, "a", contacts=1, dofs=1)]},
        """return [app.curves.side.querySelectorAll("th").map((cell) => cell.textContent),
          app.curves.side.querySelectorAll("tbody tr").map((row) => row.children.map((cell) => cell.textContent))]""",
    )
    heads, rows = texts
    assert heads[-1].startswith("amplitude of x")
    told = [float(row[-1]) for row in rows]
    np.testing.assert_allclose(told, mode.dataset["amplitude"].values[at, 0], rtol=1e-4)
