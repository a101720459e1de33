"""The page as a file: nothing is fetched, nothing but its own scripts can run, strangers' texts stay texts."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from hashlib import sha256

from slipstick.report.writing import page, part

HOSTILE = "</title></script><script>alert(1)</script><img src=x onerror=alert(2)> {{script}} & \" '"


def made(title: str = "t") -> str:
    return page(title, {"title": title, "results": []})


def elements(text: str, tag: str) -> list[tuple[str, str]]:
    """Attributes and content of each element."""
    return re.findall(rf"<{tag}\b([^>]*)>(.*?)</{tag}>", text, flags=re.DOTALL)


def test_the_policy_allows_only_the_scripts_and_styles_of_the_page() -> None:
    text = made()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    rules = {rule.split()[0]: rule.split()[1:] for rule in policy[1].split("; ")}
    assert rules["default-src"] == ["'none'"]
    assert "'unsafe-inline'" not in policy[1]
    for tag in ("script", "style"):
        found = [content for about, content in elements(text, tag) if "type" not in about]
        hashes = [f"'sha256-{b64encode(sha256(c.encode()).digest()).decode()}'" for c in found]
        assert rules[f"{tag}-src"] == hashes
        assert hashes


def test_nothing_is_fetched() -> None:
    text = made()
    assert not re.search(r"<(link|iframe|img|object|embed|base)\b", text)
    assert not re.search(r"\b(src|href|action)=", re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL))
    assert not re.search(r"url\((?!#)|@import", part("look.css") + part("panels.css") + part("print.css"))


def test_a_hostile_title_stays_a_text() -> None:
    text = made(HOSTILE)
    assert "alert(1)</script>" not in text
    assert "onerror=alert(2)>" not in text
    (title,) = elements(text, "title")
    assert "&lt;/title&gt;" in title[1]
    assert "{{script}}" in title[1]  # a slot in it is not filled
    content = next(c for about, c in elements(text, "script") if "json" in about)
    assert json.loads(content)["title"] == HOSTILE


def test_the_library_comes_with_its_licence() -> None:
    assert "MIT License" in made()
    assert "Leon Sorokin" in made()
