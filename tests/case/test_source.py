"""Texts of cases that cost too much, or that are none: refused at once, with the line."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from helpers.counting import traced

from slipstick.case.source import DEEPEST, LONGEST_NUMBER, parse, read_text
from slipstick.errors import InputError

DIGITS = "9" * 5000


@pytest.mark.parametrize(
    "text, words",
    [
        ("\n\na = " + "[" * 20_000 + "]" * 20_000, "line 3: nested more than 50 deep"),
        ("a = " + "{ a = " * 20_000 + "1" + "}" * 20_000, "line 1: nested more than"),
        ("a = [\n" + "[{ a =\n" * 60, "nested more than"),
        (".".join("a" * 5000) + " = 1", "line 1: a key of more than 50 parts"),
        ("\n[" + ' . "x"' * 60 + "]", "line 2: "),
        (f"a = {DIGITS}", "line 1: a number of 5000 characters; expected at most 400"),
        (f"a = -{DIGITS}", "a number of 5001 characters"),
        (f"a = [1, {DIGITS}.5]", "a number of"),
        (f"a = 0x{'f' * 5000}", "a number of"),
        (f"a = 0b{'1_' * 5000}1", "a number of"),
        (f"a = {DIGITS[:310]}", "case.toml: a: found a whole number beyond 64 bits; write it as 1e20"),
        (f"[b]\nc = [1, [{2**63}]]", "case.toml: b.c: found a whole number beyond 64 bits"),
        ("a = 2024-13-45", "not valid TOML"),
        ("a = 25:61:61", "not valid TOML"),
        ("a = [1", "not valid TOML"),
        ('a = "\0"', "not valid TOML"),
        ("a = '''" + "[" * 99, "not valid TOML"),
    ],
)
def test_what_costs_too_much_is_refused(text: str, words: str) -> None:
    with traced() as memory, pytest.raises(InputError) as caught:
        parse(text, "case.toml")
    assert words in str(caught.value)
    assert len(str(caught.value)) < 300
    assert memory.peak < 20e6


@pytest.mark.parametrize(
    "text, value",
    [
        ("[" * DEEPEST + "]" * DEEPEST, None),
        ('"' + "[" * 999 + '"', "[" * 999),
        ("'" + "9" * 999 + "'", "9" * 999),
        ("'''\n" + "{" * 999 + "'x''\n'''", "{" * 999 + "'x''\n"),
        ('"""' + "[" * 99 + '\\"" ""x\\\\"""', "[" * 99 + '"" ""x\\'),
        ("1  # " + "[" * 999 + " ' \" ''' " + "9" * 999, 1),
        ("0." + "3" * (LONGEST_NUMBER - 10), 1 / 3),
        (str(2**63 - 1), 2**63 - 1),
        ("-0x7f", None),
    ],
)
def test_what_a_case_may_hold_is_taken(text: str, value: object) -> None:
    if text == "-0x7f":
        with pytest.raises(InputError, match="not valid TOML"):
            parse(f"a = {text}", "case.toml")
        return
    found = parse(f"a = {text}", "case.toml")["a"]
    assert value is None or found == value


def test_large_sound_texts_are_taken() -> None:
    row = "[" + ", ".join(["-1.2345678901234567e-05"] * 200) + "]"
    text = "mass = [" + ",\n".join([row] * 100) + "]\n" + 'x = "' + "a" * 100_000 + '"\n' + "b" * 100_000 + " = 1\n"
    assert len(parse(text, "case.toml")["mass"]) == 100


def test_devices_and_pipes_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    for path in (Path("/dev/zero"), tmp_path / "pipe.toml"):
        with pytest.raises(InputError, match="found a device or a pipe"):
            read_text(path)
