"""The page says what the diagnosis says, stands alone, and is the same every time."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from codegen.diagnosis.results import Agreement, CertificateChange, ErrorFigures
from codegen.report import page, render_report
from codegen.report.series import MOST_POINTS, held_out_series
from codegen.report.wording import number

from .conftest import FILES, Case
from .reading import ReadPage


def words(case: Case, monkeypatch: pytest.MonkeyPatch, files: dict[str, str] | None = None, **changed: Any) -> str:
    """The page's HTML without pictures, of a diagnosis of which something is changed."""
    monkeypatch.setattr(page, "residual_picture", lambda series: "")
    monkeypatch.setattr(page, "free_run_picture", lambda series: "")
    return render_report(case.spec, replace(case.diagnosis, **changed), case.models, files)


def test_says_what_was_found(lacking: Case) -> None:
    read = ReadPage(lacking.html)
    assert lacking.diagnosis.verdict == "effect"
    assert lacking.diagnosis.sentence in read.text
    for figures in (lacking.diagnosis.declared, lacking.diagnosis.refit, lacking.diagnosis.augmented):
        assert number(figures.force_rms) in read.text
        assert number(round(100 * figures.relative_force, 2)) + " %" in read.text
        assert number(1e3 * figures.free_run_rmse) in read.text
    for values in lacking.diagnosis.refitted.values():
        assert all(number(v, 5) in read.text for v in values)
    for effect in lacking.diagnosis.effects:
        assert all(f"{name} = {number(v)} {effect.units[name]}" in read.text for name, v in effect.parameters.items())
    assert "4.2 %" in read.text and "Filters" in read.text


def test_order_of_the_page(lacking: Case) -> None:
    text = ReadPage(lacking.html).text
    heads = ["Error on held-out data", "Published by others", "What was found", "Refitted values", "leaves over"]
    heads += ["Candidates and", "Can the residual", "Preflight", "Change of the spec", "Stability certificate"]
    places = [text.index(head) for head in heads]
    assert places == sorted(places)


def test_shows_both_specs_in_the_difference(lacking: Case) -> None:
    html = lacking.html
    removed = re.findall(r'<span class="removed">(.*)\n</span>', html)
    added = re.findall(r'<span class="added">(.*)\n</span>', html)
    assert any("a: 3," in line for line in removed)
    assert any("kind: offset" in line or "kind: coulomb_asymmetry" in line for line in added)
    refitted = lacking.diagnosis.refitted["rail_a"][2]
    assert any(f"a: {refitted:.6g}" in line for line in added)


def test_ranks_every_candidate_with_its_reason(lacking: Case) -> None:
    text = ReadPage(lacking.html).text
    for candidate in lacking.diagnosis.candidates:
        assert f"{candidate.kind} on {candidate.on}" in text
        assert candidate.why_not.replace(" -", " −") in text


@pytest.mark.parametrize("name", ["lacking", "complete", "two_masses"])
def test_stands_alone_and_is_small(name: str, request: pytest.FixtureRequest) -> None:
    html = request.getfixturevalue(name).html
    read = ReadPage(html)
    assert not re.search(r"(?i)https?://|url\(|@import", html)
    assert not read.tags("script") and not read.tags("link")
    assert all(
        (image["src"] or "").startswith("data:image/svg+xml;base64,") and image["alt"] for image in read.tags("img")
    )
    assert len(html.encode()) < 1_500_000
    assert not re.search(r"\b(nan|NaN|inf|Infinity|undefined|None)\b", read.text)


def test_same_bytes_every_time(lacking: Case) -> None:
    assert lacking.html == render_report(lacking.spec, lacking.diagnosis, lacking.models, FILES)


def test_user_words_are_escaped(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    named = replace(lacking, spec=replace(lacking.spec, name='<script>alert("name")</script>'))
    html = words(named, monkeypatch, {"<script>label</script>": '"><script>path</script>'})
    read = ReadPage(html)
    assert "<script" not in html
    assert 'alert("name")' in read.text and "alert(1)" in read.text
    assert "Figure of <others>" in read.text and "<b>none yet</b>" in read.text


def test_links_to_the_files(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    read = ReadPage(lacking.html)
    assert [link["href"] for link in read.tags("a")] == ["out/spec%202.yaml"]
    assert not ReadPage(words(lacking, monkeypatch)).tags("a")


def test_nothing_found_is_not_called_right(complete: Case) -> None:
    text = ReadPage(complete.html).text
    assert complete.diagnosis.verdict == "none"
    assert "This does not prove the model right" in text
    assert "No effect was added" in text and "Only the refit is drawn" in text


def test_ambiguous_names_no_effect(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    text = ReadPage(words(lacking, monkeypatch, verdict="ambiguous", effects=())).text
    assert "none was added" in text and "shown as augmented" in text and "chosen" not in text


def test_two_coordinates_have_a_row_each(two_masses: Case) -> None:
    read = ReadPage(two_masses.html)
    for name, value in zip(("x1", "x2"), two_masses.diagnosis.refit.force_rms_rows, strict=True):
        assert f"residual force, RMS on {name}" in read.text and number(value) in read.text
    assert "all coordinates" not in read.text and "mixed" not in read.text
    assert "neither side of a gear" in read.text
    assert all("x1, x2" in (image["alt"] or "") for image in read.tags("img"))


def test_infinite_and_missing_figures_are_words(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    bad = ErrorFigures(float("nan"), (float("nan"),), float("inf"), float("inf"), (float("inf"),))
    text = ReadPage(words(lacking, monkeypatch, declared=bad, agreement=None)).text
    assert "diverges" in text and "not measured" in text and "in one way only" in text
    assert not re.search(r"(?i)\bnan\b|\binf\b", text)


def test_poor_agreement_is_told(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    poor = Agreement(float("nan"), 0.5, 100)
    assert "They agree poorly" in ReadPage(words(lacking, monkeypatch, agreement=poor)).text


def test_certificate_before_and_after(lacking: Case, two_masses: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "declares no observer" in ReadPage(lacking.html).text
    assert "No certificate was computed" in ReadPage(two_masses.html).text
    change = CertificateChange(4.25, "the gain is too low")
    text = ReadPage(words(two_masses, monkeypatch, certificate=change)).text
    assert "decays at 4.25 1/s" in text and "not certified : the gain is too low" in text


def test_worst_findings_first(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    findings = {"train": ("info: all well", "problem: sign of w", "warning: limited", "no severity: kept")}
    html = words(lacking, monkeypatch, findings=findings)
    assert re.findall(r'<li class="(\w+)">', html) == ["problem", "warning", "info", "info"]
    assert "no severity: kept" in ReadPage(html).text


def test_pictures_are_svg_that_parses(two_masses: Case) -> None:
    for image in ReadPage(two_masses.html).tags("img"):
        svg = base64.b64decode((image["src"] or "").partition(",")[2])
        assert ElementTree.fromstring(svg).tag.endswith("svg")
        assert b"<dc:date>" not in svg


def test_series_are_thinned_and_keep_the_peaks(two_masses: Case) -> None:
    series = held_out_series(two_masses.models, ("refit", "augmented"))
    for coordinate in series.coordinates:
        for model in coordinate.models:
            assert len(model.by_velocity.x) <= MOST_POINTS
            assert np.nanmax(np.abs(model.by_time.y)) >= np.abs(model.by_velocity.y).max()
