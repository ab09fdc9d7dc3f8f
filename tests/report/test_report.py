"""The page says what the diagnosis says, stands alone, and is the same every time."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import html5lib
import numpy as np
import pytest

from codegen.app.diagnose import Diagnosed
from codegen.diagnosis.results import (
    Agreement,
    CertificateChange,
    ErrorFigures,
    FoundEffect,
    Remainder,
    Round,
    Separation,
    TiedPair,
)
from codegen.report import page
from codegen.report.evidence import law_evidence
from codegen.report.page import render_report
from codegen.report.series import MOST_POINTS, bin_means, held_out_series
from codegen.report.wording import estimated, number, percent

from .conftest import FILES, Case
from .reading import ReadPage


def words(case: Case, monkeypatch: pytest.MonkeyPatch, files: dict[str, str] | None = None, **changed: Any) -> str:
    """The page's HTML without pictures, of a diagnosis of which something is changed."""
    monkeypatch.setattr(page, "residual_drawings", lambda coordinate: ())
    monkeypatch.setattr(page, "law_evidence", lambda diagnosis, models: ())
    return render_report(case.spec, replace(case.diagnosis, **changed), case.models, files)


def test_says_what_was_found(lacking: Case) -> None:
    read = ReadPage(lacking.html)
    assert lacking.diagnosis.verdict == "effect"
    said = lacking.diagnosis.statement
    assert said.headline in read.text and len(said.facts) > 3
    assert all(f"{fact.words} {fact.detail}".strip() in read.text for fact in said.facts)
    for figures in (lacking.diagnosis.declared, lacking.diagnosis.refit, lacking.diagnosis.augmented):
        assert number(figures.force_rms) in read.text
        assert number(round(100 * figures.relative_force, 2)) + " %" in read.text
        assert number(1e3 * figures.free_run_rmse) in read.text
    for values in lacking.diagnosis.refitted.values():
        assert all(number(v, 5) in read.text for v in values)
    for effect in lacking.diagnosis.effects:
        for name, value in effect.parameters.items():
            shown, interval = estimated(value, effect.intervals[name])
            assert f"{name} = {shown} {effect.units[name]} ({interval}, 95 %)" in read.text
    assert "4.2 %" in read.text and "Filters" in read.text


def test_order_of_the_page(lacking: Case) -> None:
    text = ReadPage(lacking.html).text
    heads = [
        "Error on held-out data",
        "Published by others",
        "What was found",
        "Refitted values",
        "compared with a smooth curve",
        "Residual of the model",
    ]
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


def test_the_columns_of_candidates_are_called_as_in_the_terminal(lacking: Case) -> None:
    printed = Diagnosed(lacking.diagnosis, Path("out"), ()).text(paths=False)
    (line,) = [line for line in printed.splitlines() if line.startswith("candidates  ")]
    columns = re.split(r"  +", line)[1:]
    (table,) = re.findall(r'<table class="candidates">\n<thead>(.*?)</thead>', lacking.html)[:1]
    heads = [re.sub(r"<[^>]*>", "", head) for head in re.findall(r"<th.*?</th>", table)]
    assert len(columns) == 4 and [head for head in heads if head in columns] == columns
    assert "blocks won" not in lacking.html and all(f"<strong>{name}</strong>:" in lacking.html for name in columns)


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
    assert "No effect was added" in text and "No effect is drawn" in text


def test_ambiguous_names_no_effect(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    text = ReadPage(words(lacking, monkeypatch, verdict="ambiguous", effects=())).text
    assert "none was added" in text and "shown as augmented" in text and "chosen" not in text


def test_two_coordinates_have_a_row_each(two_masses: Case) -> None:
    read = ReadPage(two_masses.html)
    for name, value in zip(("x1", "x2"), two_masses.diagnosis.refit.force_rms_rows, strict=True):
        assert f"residual force, RMS on {name}" in read.text and number(value) in read.text
    assert "all coordinates" not in read.text and "mixed" not in read.text
    assert "independent of gear ratios" in read.text
    alts = [image["alt"] or "" for image in read.tags("img")]
    for name in ("x1", "x2"):
        over = ("velocity", "position", "load", "acceleration", "time")
        assert all(f"residual on {name} over {variable}, on held-out data" in alts for variable in over)


def test_every_model_is_drawn_and_named(lacking: Case, complete: Case) -> None:
    """The declared one too; one colour serves for both where the refit adopts nothing."""
    for case, added in ((lacking, True), (complete, False)):
        same = all(a == b for a, b, _ in case.diagnosis.refitted.values())
        legend = re.findall(r"</i>([^<]*)</span>", case.html.partition("Residual of the model")[2])
        models = ["declared and refit (no other value was adopted)"] if same else ["declared", "refit"]
        assert legend == models + ["augmented"] * added


def test_the_law_stands_beside_the_curve_that_knows_none(lacking: Case) -> None:
    (found,) = law_evidence(lacking.diagnosis, lacking.models)
    assert (found.kind, found.on) == (lacking.diagnosis.effects[0].kind, lacking.diagnosis.effects[0].on)
    assert found.smooth > 0.99 and found.law == pytest.approx(found.smooth, abs=0.01) and found.left < 0.1
    (panel,) = found.panels
    seen = np.isfinite(panel.law.y)
    assert seen.any() and np.allclose(np.abs(panel.law.y[seen]), 1.5, atol=0.05)  # what the plant was pushed with
    assert np.allclose(panel.smooth.y[seen], panel.law.y[seen], atol=0.1)
    assert percent(found.law) in ReadPage(lacking.html).text


def test_a_law_that_is_not_accepted_and_a_rival_are_drawn_too(lacking: Case) -> None:
    refused = replace(lacking.diagnosis, verdict="unknown", effects=())
    (found,) = law_evidence(refused, lacking.models)
    assert found.law > 0.9
    drag = FoundEffect("quadratic_drag", "x", {"c": 0.02}, {"c": "N*s^2/m^2"})
    tied = replace(lacking.diagnosis, verdict="ambiguous", effects=(), rivals=(drag,))
    first, rival = law_evidence(tied, lacking.models)
    assert (first.law, rival.kind) == (law_evidence(lacking.diagnosis, lacking.models)[0].law, "quadratic_drag")
    assert rival.law < 0.1 and rival.smooth > 0.9  # the curve shows what a wrong law does not take


def test_what_is_left_stands_in_a_table(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    (left,) = lacking.diagnosis.remainder
    text = ReadPage(lacking.html).text
    assert f"{number(left.rms)} N {percent(left.share)} immaterial" in text
    assert all(f"{name} {percent(share)}" in text for name, share in left.over.items())
    large = Remainder(3.0, 0.2, 0.5, {"load": 0.4})
    assert "20 % structured 14.1 % load 40 %" in ReadPage(words(lacking, monkeypatch, remainder=(large,))).text
    assert "20 % noise" in ReadPage(words(lacking, monkeypatch, remainder=(large,), material=0.15)).text


def test_every_round_and_every_effect_of_the_verdict_is_in_a_table(
    lacking: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = lacking.diagnosis.candidates
    spring = replace(first[0], kind="spring", on="x", parameters={"k": 4.5}, accepted=False, why_not="small", also=())
    first = tuple(c for c in first if c.kind != "spring")
    later = Round((("offset", "x"),), (spring,))
    text = ReadPage(
        words(
            lacking, monkeypatch, candidates=first, later_rounds=(later,), in_no_round=(replace(spring, accepted=True),)
        )
    ).text
    assert "Round 1: each effect alone" in text and "Round 2: in addition to offset on x" in text
    assert "Effects that replaced others" in text and text.count("spring on x") == 2 and text.count("k = 4.5 N/m") == 2
    rivals = tuple(FoundEffect(c.kind, c.on, c.parameters, {"d": "N"}) for c in first[1:2])
    text = ReadPage(words(lacking, monkeypatch, verdict="ambiguous", effects=(), rivals=rivals)).text
    assert text.count("tied with the one shown as augmented") == 1


def test_what_would_separate_tied_candidates_is_told(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    pair = TiedPair(("offset", "x"), ("coulomb_asymmetry", "rail"), 0.5, 0.1, "another mounting")
    told = Separation((pair,), (), None, {}, 10.0)
    text = ReadPage(words(lacking, monkeypatch, verdict="ambiguous", effects=(), separation=told)).text
    assert "offset on x and coulomb_asymmetry on rail 0.5° 0.1 offset on x fits better another mounting" in text
    assert "No motion of the library tells them apart" in text


def test_parameters_at_a_limit_are_marked_and_have_no_interval(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    (found,) = lacking.diagnosis.effects
    (name,) = found.parameters
    text = ReadPage(words(lacking, monkeypatch, effects=(replace(found, at_limit=(name,)),))).text
    assert "at its limit" in text and "95 %)" not in text


def test_only_lines_that_change_are_in_the_difference(lacking: Case) -> None:
    """The author's spacing stays, so that a line is changed by what it says alone."""
    shown = re.findall(r'<span class="(\w+)">(.*)\n</span>', lacking.html)
    assert {kind for kind, _ in shown} == {"hunk", "added", "removed"}
    squeezed = {kind: {" ".join(line[1:].split()) for k, line in shown if k == kind} for kind in ("added", "removed")}
    assert not squeezed["added"] & squeezed["removed"]
    number_of = lacking.spec.text.splitlines().index(next(t for t in lacking.spec.text.splitlines() if "a: 3," in t))
    assert ("hunk", f"line {number_of + 1}") in shown


@pytest.mark.parametrize("name", ["lacking", "complete", "two_masses"])
def test_is_html_that_parses_and_scrolls_inside_its_cards(name: str, request: pytest.FixtureRequest) -> None:
    html = request.getfixturevalue(name).html
    tree = html5lib.HTMLParser(strict=True, namespaceHTMLElements=False).parse(html)
    tables = tree.findall(".//table")
    assert tables and len(tables) == len(tree.findall(".//div[@class='scroll']/table"))
    assert "width=device-width" in html and ".scroll { overflow-x: auto; }" in html
    narrow = html.partition("@media (max-width: 700px)")[2]
    assert ".panels { grid-template-columns: 100%; }" in narrow


def test_infinite_and_missing_figures_are_words(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    bad = ErrorFigures(float("nan"), (float("nan"),), float("inf"), float("inf"), (float("inf"),))
    text = ReadPage(words(lacking, monkeypatch, declared=bad, agreement=None)).text
    assert "diverges" in text and "not measured" in text and "in one way only" in text
    assert not re.search(r"(?i)\bnan\b|\binf\b", text)


def test_poor_agreement_is_told(lacking: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    poor = Agreement(float("nan"), 0.5, 100)
    assert "They agree poorly" in ReadPage(words(lacking, monkeypatch, agreement=poor)).text
    told = Diagnosed(replace(lacking.diagnosis, agreement=poor), Path("out"), ()).text(paths=False)
    assert "check of the residual" in told and "They agree poorly" in told  # the figures stood there alone


def test_the_generated_code_is_listed_with_the_files(lacking: Case) -> None:
    files = ("spec.yaml", "generated/stage/stage.c", "generated/stage/manifest.json", "diagnosis.json")
    told = Diagnosed(lacking.diagnosis, Path("out"), files).text(paths=True)
    assert [line.partition("  ")[0] for line in told.splitlines() if line.startswith("out/")] == [
        "out/spec.yaml",
        "out/diagnosis.json",
        "out/generated/stage/",
    ]


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


def test_means_in_bins_are_those_of_their_own_samples() -> None:
    """A sample that is not finite, as of a free run that diverged, is in the mean of its own bin alone."""
    x = np.linspace(0.0, 1.0, 4001)
    y = np.where(x == x[1000], np.inf, np.sin(3 * x))
    means = bin_means(x, y, 8)
    (place,) = np.flatnonzero(~np.isfinite(means.y))
    assert abs(means.x[place] - x[1000]) < 0.07
    edges = np.linspace(0.005, 0.995, 9)
    own = [y[(x >= low) & (x < high)].mean() for low, high in pairwise(edges)]
    assert means.x == pytest.approx((edges[:-1] + edges[1:]) / 2)
    assert np.delete(means.y, place) == pytest.approx(np.delete(own, place), abs=1e-3)


def test_series_are_thinned_and_keep_the_peaks(two_masses: Case) -> None:
    series = held_out_series(two_masses.models, ("declared", "refit", "augmented"))
    for coordinate in series:
        for model in coordinate.models.values():
            for dots, _ in model.over.values():
                assert len(dots.x) <= MOST_POINTS
                assert np.nanmax(np.abs(model.by_time.y)) >= np.abs(dots.y).max()
