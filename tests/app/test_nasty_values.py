"""Every number of a spec replaced by a senseless one, every line removed: a result, or messages with a line."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from itertools import islice

import pytest

from .command import SPECS, Result, are_messages, is_one_message, stiction

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


def run(folder, cases: Iterator[tuple[int, str]], right: Callable[[Result], bool]) -> list[tuple[int, str]]:
    """The cases that are told badly, and what was said."""
    wrong = []
    place = re.compile(r"error: s\.yaml(:\d+: |: \w+: key `\w+` is missing)")  # an absent section has no line
    for line, text in cases:
        (folder / "s.yaml").write_text(text)
        result = stiction("check", "s.yaml")
        if result.code != 0 and not (right(result) and all(map(place.match, result.err.splitlines()))):
            wrong.append((line, result.err))
    return wrong


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_short_spec(folder):
    text = (SPECS / "one_mass.yaml").read_text()
    assert run(folder, islice(spoilt(text), None, None, 3), is_one_message) == []
    assert run(folder, islice(without(text), None, None, 3), are_messages) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["one_mass", "two_mass", "emps", "rig", "belt_axis", "two_link_arm"])
def test_every_shipped_spec(folder, name):
    """A line that is gone may leave several faults, each told: a range of a parameter that is not there any more."""
    text = (SPECS / f"{name}.yaml").read_text()
    assert run(folder, spoilt(text), is_one_message) + run(folder, without(text), are_messages) == []
