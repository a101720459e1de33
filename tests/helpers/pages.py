"""The scripts of a page in node, with a stand-in for the browser (browser.js): what is drawn, and what clicks do."""

from __future__ import annotations

import json
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import pytest

from slipstick.report.encoding import gathered
from slipstick.report.writing import SCRIPTS, STUDY_SCRIPTS, part

NODE = shutil.which("node")
needs_node = pytest.mark.skipif(NODE is None, reason="node, which runs the scripts, is not installed")
BROWSER = Path(__file__).with_name("browser.js").read_text(encoding="utf-8")


def opened(content: Any, script: str, *, study: bool = False, address: str = "") -> Any:
    """What ``script`` returns once the page of this content is drawn, with numbers that are none as None.

    ``app`` is the page; the helpers at the end of browser.js find what is drawn and press keys.
    """
    own = "\n".join(part(name) for name in (STUDY_SCRIPTS if study else SCRIPTS))
    own = own.replace("start().then((app) => {", "start().then(async (app) => {\n  globalThis.app = app;")
    made, numbers = gathered({"title": "t", "version": "1", "written": "now", **content})
    text = f"""{BROWSER}
      const told = JSON.parse(require("fs").readFileSync(0, "utf8"));
      IDS.content.textContent = JSON.stringify(told.content);
      IDS.numbers.textContent = told.numbers;
      location.hash = told.address;
      {own}
      setTimeout(function wait() {{
        if (!("data-ready" in ROOT.attributes)) {{ setTimeout(wait, 2); return; }}
        console.log(JSON.stringify((() => {{ {script} }})()));
      }}, 0);"""
    told = json.dumps({"content": made, "numbers": numbers, "address": address})
    with tempfile.TemporaryDirectory() as folder:  # an argument may not be as long as the scripts are
        page = Path(folder) / "page.js"
        page.write_text(text, encoding="utf-8")
        command = [str(NODE), str(page)]
        done = subprocess.run(command, input=told, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
