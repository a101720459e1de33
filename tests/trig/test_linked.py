"""Inner functions have no machine code of their own; what is computed with them does not change by a bit."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from slipstick.trig import compile_cache
from slipstick.trig.compiled import compiled

Linked = pytest.importorskip("slipstick.trig.linked", exc_type=ImportError).Linked

FORCES = """
import sys
if sys.argv[1] == "own code":
    sys.modules["slipstick.trig.linked"] = None
import hashlib
import numpy as np
from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics

rng, h, one = np.random.default_rng(0), Harmonics(range(6)), np.ones(200)
X, Y = rng.normal(size=(2, 200, h.size))
f = element_forces(h, X, Y, v=rng.normal(size=200), kt=one, mu=0.3 * one, kn=one, gap=-one)
print(hashlib.sha256(b"".join(v.tobytes() for v in vars(f).values() if isinstance(v, np.ndarray))).hexdigest())
"""


def test_inner_functions_are_linked_and_kept_with_their_caller(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compile_cache, "cache_folder", lambda: tmp_path)

    @compiled
    def doubled(x):
        return 2.0 * x.sum()

    @compiled(allocates=True)
    def outer(n):
        return doubled(np.ones(n))

    assert outer(3) == 6.0
    (inner,) = doubled.overloads.values()
    assert isinstance(inner.library, Linked)
    assert inner.library.get_pointer_to_function("anything") == 0
    assert [path.name.split("-")[0].rpartition(".")[2] for path in tmp_path.glob("*.nbc")] == ["outer"]


def test_another_numba_compiles_them_in_its_own_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "slipstick.trig.linked", None)
    monkeypatch.setattr(compile_cache, "cache_folder", lambda: tmp_path)
    inner = compiled(lambda x: 2.0 * x.sum())
    assert compiled(lambda n: inner(np.ones(n)), allocates=True)(3) == 6.0
    (made,) = inner.overloads.values()
    assert not isinstance(made.library, Linked)


@pytest.mark.verify
def test_the_kernel_is_the_same_to_the_bit(tmp_path: Path) -> None:
    """In processes of their own, compiled from nothing."""
    found = set()
    for how in ("linked", "own code"):
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / how)}
        done = subprocess.run([sys.executable, "-c", FORCES, how], check=True, capture_output=True, env=environment)
        found.add(done.stdout)
    assert len(found) == 1
