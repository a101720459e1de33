"""Parts of compiled functions: code for their callers alone, one version for all numbers."""

from __future__ import annotations

import numpy as np
import pytest
from numba.core.codegen import CPUCodeLibrary, JITCPUCodegen

from slipstick.trig.compiled import PartCode, as_part, compiled, part


def chosen(way, x):
    if way == 0:
        return x[0]
    return x[way] + x[0]


def with_parts():
    """A function of two parts, called with numbers written out and with others."""
    look = compiled(chosen)

    def room(n):
        return np.arange(n)

    new = part(room)

    def run(n):
        x = new(n)
        total = look(0, x) + look(1, x) + look(2, x)
        for i in range(n):
            total += look(i, x)
        return total

    return compiled(run, allocates=True, fastmath=False), look, new


def test_parts_give_the_numbers_of_plain_python() -> None:
    run, _, _ = with_parts()
    plain = sum(chosen(i, range(7)) for i in (0, 1, 2, *range(7)))
    assert run(7) == plain == 24


def test_numbers_written_in_a_call_make_no_versions_of_their_own() -> None:
    run, look, _ = with_parts()
    run(3)
    assert len(look.signatures) == 1


def test_only_the_whole_is_made_machine_code_of(monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    add = JITCPUCodegen._add_module
    monkeypatch.setattr(JITCPUCodegen, "_add_module", lambda self, m: (made.append(m.name), add(self, m))[1])
    run, look, new = with_parts()
    run(3)
    assert "with_parts.<locals>.run" in made
    assert "part" not in made
    assert all(isinstance(f.overloads[f.signatures[0]].library, PartCode) for f in (look, new))


@pytest.mark.parametrize("name", ["_finalize_dynamic_globals", "_optimize_final_module"])
def test_a_numba_with_other_ways_does_the_work_it_could_be_spared(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as other:
        other.delattr(CPUCodeLibrary, name)
        assert "pipeline_class" not in as_part()
        run, look, new = with_parts()
    assert run(7) == 24
    assert not any(isinstance(f.overloads[f.signatures[0]].library, PartCode) for f in (look, new))
