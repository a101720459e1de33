"""The one private option of numba that is used, and a numba that does not know it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.cpu import CPUTargetOptions

from slipstick.trig import compiled as compilation
from slipstick.trig.compiled import compiled, uncounted

BATCH = """
import sys
import numpy as np
from numba.core.cpu import CPUTargetOptions

if sys.argv[1] == "refused":
    for kind in CPUTargetOptions.__mro__:
        if "_nrt" in vars(kind):
            del kind._nrt
from slipstick import Harmonics
from slipstick.contact.forces import element_forces

rng, h, one = np.random.default_rng(0), Harmonics(range(6)), np.ones(50)
X, Y = rng.normal(size=(2, 50, h.size))
f = element_forces(h, X, Y, v=rng.normal(size=50), kt=one, mu=0.3 * one, kn=one, gap=-one)
print(np.concatenate([f.Fx, f.Fy, f.dFx_dX[:, 0], f.dFx_dY[:, 1], f.dFx_dmu]).tolist())
"""


def first_half(x):
    return x[: x.size // 2]


@pytest.fixture
def other_numba(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A numba without the option: it refuses what it does not know. Nothing it compiles is kept for others."""
    for kind in CPUTargetOptions.__mro__:
        if "_nrt" in vars(kind):
            monkeypatch.delattr(kind, "_nrt")
    monkeypatch.setattr(compilation, "cache_folder", lambda: tmp_path)
    with pytest.raises(KeyError, match="Unrecognized options"):
        numba.njit(_nrt=False)(first_half)(np.ones(4))


def total():
    """Two compiled functions, one of them without arrays of its own."""
    inner = compiled(first_half)

    def run(n):
        return inner(np.ones(n)).sum()

    return compiled(run, allocates=True)


def test_inner_functions_do_not_count_references() -> None:
    assert compiled(first_half).targetoptions["_nrt"] is False
    assert "_nrt" not in compiled(first_half, allocates=True).targetoptions


@pytest.mark.usefixtures("other_numba")
def test_a_numba_that_refuses_the_option_compiles_without() -> None:
    assert uncounted() == {}
    assert total()(6) == 3.0


@pytest.mark.verify
def test_the_kernel_without_the_option_agrees(tmp_path: Path) -> None:
    """In processes of their own, compiled from nothing."""

    def forces(how: str) -> np.ndarray:
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / how)}
        done = subprocess.run(
            [sys.executable, "-c", BATCH, how], check=True, capture_output=True, text=True, env=environment
        )
        return np.array(json.loads(done.stdout))

    known, refused = forces("known"), forces("refused")
    np.testing.assert_allclose(refused, known, rtol=1e-12, atol=1e-14 * np.abs(known).max())
