"""The disc of the page: every blade's amplitude and motion, of a wave as of a whole disc."""

from __future__ import annotations

import json
import shutil
import subprocess
from typing import Any

import numpy as np
import pytest
from helpers.reports import branch as masses
from helpers.rings import disc_and_wave

from slipstick.report import content
from slipstick.report.content import content_of, disc_content
from slipstick.report.encoding import gathered
from slipstick.report.writing import part

node = shutil.which("node")


def run(script: str, given: Any) -> Any:
    """What a script of the page prints as JSON."""
    own = "\n".join(part(f"{name}.js") for name in ("decode", "law", "model", "disc", "view"))
    plain, numbers = gathered(given)
    text = f"""{own}
      const {{ given, numbers }} = JSON.parse(require("fs").readFileSync(0, "utf8"));
      inflated(numbers).then((buffer) => {{ STORE.buffer = buffer; console.log(JSON.stringify({script})); }});"""
    told = json.dumps({"given": plain, "numbers": numbers})
    done = subprocess.run([str(node), "-e", text], input=told, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.skipif(node is None, reason="node, which runs the scripts, is not installed")
def test_the_page_moves_every_blade_of_a_wave_as_the_disc_does() -> None:
    """The wave by its delays, the disc by the motion of each, and both as the results say."""
    tau = 0.7
    script = f"""given.map((content) => {{
      const result = new Result(content, 0), blades = result.onDisc(0, "tip");
      return [blades.map(({{ amplitude }}) => amplitude), motionsAt(blades, result.orders, {tau})];
    }})"""
    wave, disc = disc_and_wave()
    found = run(script, [content_of(made, "", contacts=2, dofs=2) for made in (wave, disc)])
    X = disc.dataset.displacement.to_numpy()[0]
    names = [str(name) for name in disc.dataset.dof.to_numpy()]
    motion = [X[names.index(f"tip@{s}"), 1:] @ disc.harmonics.H_minus(tau)[1:] for s in range(6)]
    for made, (amplitude, moved) in zip((wave, disc), found, strict=True):
        np.testing.assert_array_equal(amplitude, made.on_disc("tip").to_numpy()[0])
        np.testing.assert_allclose(moved, motion, atol=1e-3 * np.abs(motion).max())


@pytest.mark.skipif(node is None, reason="node, which runs the scripts, is not installed")
def test_the_address_keeps_the_blade() -> None:
    """And forgets one that is not there."""
    script = """(() => {
      const model = modelOf([given]), at = (text) => viewFrom(text, model);
      const view = at(addressOf({ ...at(""), blade: 4, disc: "left" }));
      return [[view.blade, view.disc], [at("#blade=6&disc=nose").blade, at("#blade=6&disc=nose").disc]];
    })()"""
    given = content_of(disc_and_wave()[1], "", contacts=2, dofs=2)
    assert run(script, given) == [[4, "left"], [None, ""]]


def test_the_dofs_that_move_most_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(content, "MOST_ON_DISC", 1)
    for made in disc_and_wave():
        largest = {name: float(made.on_disc(name).max()) for name in ("tip", "left", "right")}
        found = disc_content(made)
        assert found is not None
        assert found["dofs"] == [max(largest, key=lambda name: largest[name])]
        assert found["amplitude"]["shape"] == [1, 6 if found["whole"] else 1]


def test_nothing_of_what_is_no_disc() -> None:
    """Of another structure, of dofs that are not known at every sector, and without a problem."""
    disc = disc_and_wave()[1]
    assert disc_content(masses()) is None
    assert disc_content(type(disc)(disc.dataset.isel(dof=slice(0, 3)), disc.outcome, disc.problem)) is None
    assert disc_content(type(disc)(disc.dataset, disc.outcome)) is None
