"""The codes of errors: each fault that is raised has one, each one is raised somewhere and has a line on the page."""

from __future__ import annotations

import ast
import re
from collections import Counter

from benchmarks.text import render
from codegen.base.error_codes import CODES
from tests.app.command import stiction

from .commands import ROOT

PASSED_ON = {"error.code", "fault.code", "self.code", "code"}
"""Of a fault that is raised again with another place or other words, or by ``refuse_unknown``."""
RAISING = {"BadInput", "refuse_unknown"}


def codes_in_use() -> Counter[str]:
    """Code, or the expression for it → how many calls that raise BadInput have it; "" where there is none."""
    found: Counter[str] = Counter()
    for path in (ROOT / "codegen").rglob("*.py"):
        for call in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id in RAISING:
                (code,) = [k.value for k in call.keywords if k.arg == "code"] or [ast.Constant("")]
                found[str(code.value) if isinstance(code, ast.Constant) else ast.unparse(code)] += 1
    return found


def test_each_fault_has_a_code_that_is_known_and_each_code_a_fault() -> None:
    found = codes_in_use()
    assert found.total() > 350
    assert set(found) - PASSED_ON == set(CODES)


def test_codes_are_numbered_without_gaps_and_said_in_sentences() -> None:
    numbers: dict[str, list[int]] = {}
    for code, words in CODES.items():
        (letters, number) = re.fullmatch(r"([A-Z]+)(\d{3})", code).groups()  # type: ignore[union-attr]
        numbers.setdefault(letters, []).append(int(number))
        assert all(text[0].isupper() and text.endswith(".") for text in words)
    assert all(found == list(range(1, len(found) + 1)) for found in numbers.values())


def test_the_page_is_current() -> None:
    """Written again by ``make reference``."""
    assert render("errors.md.j2", codes=CODES) == (ROOT / "docs" / "errors.md").read_text("utf-8")
    assert all(code in stiction("errors").out for code in CODES)
