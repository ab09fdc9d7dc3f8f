"""Every numbered equation is claimed, the JSON has its shape, and docs/audit.md is what the audit writes."""

from __future__ import annotations

import json
import re

import pytest

from codegen.thesis.audit.claim import audit_document, audit_json, audit_summary
from tests.app.command import stiction
from tests.thesis.audit.printed import ROOT, THESIS, claims, findings, of

NUMBER = re.compile(r"\\tag\{([0-9AB]+\.\d+)\}|\(([1-9AB]\.\d+)\)\s*\$*\s*$", re.MULTILINE)


def test_every_numbered_equation_of_the_thesis_has_a_claim():
    if not THESIS.is_file():
        pytest.skip("the text of the thesis is not beside this tree")
    numbers = {a or b for a, b in NUMBER.findall(THESIS.read_text(encoding="utf-8"))}
    assert len(numbers) > 280
    assert numbers <= {c.entry.equation for c in claims()}


@pytest.mark.slow
def test_json_objects():
    objects = json.loads(json.dumps(audit_json(findings())))
    assert len(objects) == len(claims())
    for o in objects:
        assert o["verdict"] in ("holds", "wrong", "insufficient", "unnecessary")
        assert isinstance(o["equation"], str) and isinstance(o["printed"], str) and isinstance(o["derived"], str)
        assert o["derived"] or o["kind"] == "definition"
        assert o["counterexample"] is None or "eigenvalue" in o["counterexample"]
        if o["verdict"] in ("insufficient", "unnecessary"):
            assert len(o["counterexample"]) > 1


@pytest.mark.slow
def test_docs_are_current():
    assert (ROOT / "docs" / "audit.md").read_text(encoding="utf-8") == audit_document(findings())


def test_the_table_names_what_does_not_hold():
    some = [*of("2.1"), *of("6.22"), *of("8.4")]
    text = audit_summary(some)
    assert "(6.22) wrong" in text and "(8.4) wrong" in text and "\n(2.1)" not in text
    assert f"{len(some)} claims" in text


@pytest.mark.slow
def test_the_table_counts_every_claim():
    assert f"{len(claims())} claims" in audit_summary(findings())


@pytest.mark.slow
def test_the_command(tmp_path):
    done = stiction("audit", "-o", tmp_path / "audit.md", "--json")
    assert done.code == 0, done.err
    assert (tmp_path / "audit.md").read_text(encoding="utf-8") == (ROOT / "docs" / "audit.md").read_text(
        encoding="utf-8"
    )
    assert len(json.loads(done.out)["findings"]) == len(claims())
