"""Every number of a spec replaced by a senseless one, every line removed: a result, or one message with a line."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from .command import SPECS, is_one_message, stiction

VALUES = ("0", "-1", ".nan", ".inf", "1e308", "1e-200", "x", "[]", "{}")
NUMBER = re.compile(r"(?<=[ \[])-?\d[\d.e-]*(?=[\n,}\]])")


def spoilt(text: str) -> Iterator[tuple[int, str]]:
    """(Line, text with one number of it replaced)."""
    for found in NUMBER.finditer(text):
        line = text.count("\n", 0, found.start()) + 1
        yield from ((line, text[: found.start()] + value + text[found.end() :]) for value in VALUES)


def without(text: str) -> Iterator[tuple[int, str]]:
    """(0, text without one of its lines)."""
    lines = text.splitlines(keepends=True)
    yield from ((0, "".join(lines[:k] + lines[k + 1 :])) for k in range(len(lines)))


def run(folder, cases: Iterator[tuple[int, str]]) -> list[tuple[int, str]]:
    """The cases that are told badly, and what was said."""
    wrong = []
    for line, text in cases:
        (folder / "s.yaml").write_text(text)
        result = stiction("check", "s.yaml")
        told = re.match(
            r"error: s\.yaml(:\d+: |: \w+: key `\w+` is missing)", result.err
        )  # an absent section has no line
        if result.code != 0 and not (is_one_message(result) and told):
            wrong.append((line, result.err))
    return wrong


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_short_spec(folder):
    text = (SPECS / "one_mass.yaml").read_text()
    assert run(folder, (case for k, case in enumerate(spoilt(text)) if k % 3 == 0)) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["one_mass", "two_mass", "emps", "rig", "belt_axis", "two_link_arm"])
def test_every_shipped_spec(folder, name):
    text = (SPECS / f"{name}.yaml").read_text()
    assert run(folder, spoilt(text)) + run(folder, without(text)) == []
