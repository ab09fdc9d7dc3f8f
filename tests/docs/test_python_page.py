"""The table of docs/how-to/python.md: the keywords of every verb, and attributes that its result has."""

from __future__ import annotations

import inspect
import re
from dataclasses import fields, is_dataclass

import pytest

import stiction
from codegen.analysis.analysis import Analysis
from codegen.base.result import Result
from codegen.replay.over_log import Replayed

from .commands import ROOT

RESULTS: dict[str, type] = {
    "derive": Analysis,
    "gains": stiction.GainReport,
    "certify": stiction.Certified,
    "generate": stiction.Generated,
    "generate_fmu": stiction.GeneratedFmu,
    "verify": stiction.Verified,
    "simulate": stiction.Simulated,
    "replay": Replayed,
    "diagnose": stiction.Diagnosed,
    "watch": stiction.Watched,
    "cancel": stiction.CancelReport,
    "export": stiction.Exported,
}
ROW = re.compile(r"^\| `(\w+)\(([^)]*)\)`[^|]*\| (.*) \|$", re.MULTILINE)
PAGE = (ROOT / "docs" / "how-to" / "python.md").read_text("utf-8")
ROWS = {name: (keywords.split(", ") if keywords else [], result) for name, keywords, result in ROW.findall(PAGE)}


def names_of(result: type) -> set[str]:
    """Attributes, fields of a dataclass among them."""
    return set(dir(result)) | ({field.name for field in fields(result)} if is_dataclass(result) else set())


def test_every_verb_has_a_row() -> None:
    assert set(ROWS) == {"check", *RESULTS}


@pytest.mark.parametrize("name", ROWS)
def test_the_keywords_are_those_of_the_method(name: str) -> None:
    verb = getattr(stiction.Machine, name, None) or getattr(stiction, name)
    _, *keywords = inspect.signature(verb).parameters
    assert ROWS[name][0] == keywords


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_has_the_attributes(name: str) -> None:
    told = re.findall(r"(?<!\()`(\w+)`", ROWS[name][1])
    assert told and set(told) <= names_of(RESULTS[name])


def test_text_and_content_are_there_where_the_page_says() -> None:
    without = {name for name, result in RESULTS.items() if not issubclass(result, Result)}
    assert without == {"derive", "verify"}
    assert {name for name, result in RESULTS.items() if not hasattr(result, "content")} == {"derive"}


@pytest.mark.parametrize("name", [*RESULTS, "init", "write_certificate", "write_smt"])
def test_what_is_written_is_always_called_out(name: str) -> None:
    """One keyword for the file or folder that a verb writes; an input is called by what it is."""
    keywords = set(inspect.signature(getattr(stiction, name)).parameters)
    assert not {"folder", "output", "target", "destination", "to_path"} & keywords
    assert name in ("derive", "verify", "watch") or "out" in keywords
