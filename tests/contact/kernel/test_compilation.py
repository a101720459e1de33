"""Whether the kernel is compiled is seen from the files of the cache."""

from __future__ import annotations

from pathlib import Path

import pytest

from slipstick.contact.kernel.compilation import compile_kernel, is_compiled
from slipstick.trig import compiled as compilation


def test_a_compiled_kernel_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert compile_kernel() > 0.0
    assert is_compiled()
    monkeypatch.setattr(compilation, "cache_folder", lambda: tmp_path)
    assert not is_compiled()
