"""Ranking, ties and the tests that a candidate must pass, on made errors of blocks."""

from __future__ import annotations

import numpy as np
import pytest

from codegen.diagnosis.candidates import Fit
from codegen.diagnosis.selection import evidence, rank, rivals
from codegen.effects import CATALOGUE

BASE = np.linspace(90.0, 110.0, 12)


def _fit(kind: str, on: str, share: float, spread: float, seed: int, twins: tuple[tuple[str, str], ...] = ()) -> Fit:
    """A fit that leaves ``share`` of each block's error, give or take ``spread``."""
    noise = np.random.default_rng(seed).normal(size=len(BASE))
    held_out = BASE * (share + spread * (noise - noise.mean()))
    parameters = {p.name: 1.0 for p in CATALOGUE[kind].parameters}
    return Fit(CATALOGUE[kind], 0, on, parameters, {}, held_out, float(held_out.sum()), twins)


def test_evidence_is_the_paired_t_statistic() -> None:
    fit = _fit("spring", "x", 0.5, 0.05, 1)
    difference = BASE - fit.held_out
    gain, t, won = evidence(BASE, fit.held_out)
    assert gain == pytest.approx(1 - fit.held_out.sum() / BASE.sum())
    assert t == pytest.approx(difference.mean() / (difference.std(ddof=1) / np.sqrt(12)))
    assert won == 12


def test_a_clear_best_has_no_rivals() -> None:
    ranked = rank(
        BASE, [_fit("viscous", "rail", 0.4, 0.02, 2), _fit("spring", "x", 0.1, 0.02, 3)], lambda fit: 0.5, 0.0
    )
    assert [r.fit.kind for r in ranked] == ["spring", "viscous"]
    assert rivals(ranked) == []


def test_two_that_explain_the_blocks_alike_are_rivals() -> None:
    fits = [
        _fit("viscous", "rail", 0.101, 0.02, 4),
        _fit("spring", "x", 0.1, 0.02, 5),
        _fit("offset", "x", 0.6, 0.02, 6),
    ]
    ranked = rank(BASE, fits, lambda fit: 0.5, 0.0)
    assert {r.fit.kind for r in [ranked[0], *rivals(ranked)]} == {"viscous", "spring"}


def test_twins_are_no_rivals() -> None:
    fits = [
        _fit("offset", "x", 0.1, 0.02, 7, (("coulomb_asymmetry", "rail"),)),
        _fit("coulomb_asymmetry", "rail", 0.1, 0.02, 7, (("offset", "x"),)),
    ]
    assert rivals(rank(BASE, fits, lambda fit: 0.5, 0.0)) == []


@pytest.mark.parametrize(
    ("share", "spread", "free_run", "tolerance", "why"),
    [
        (1.02, 0.01, 0.5, 0.0, "no smaller"),
        (0.97, 0.001, 0.5, 0.0, "less than 5 %"),
        (0.9, 0.3, 0.5, 0.0, "of the held-out blocks only"),
        (0.2, 0.02, 1.2, 0.0, "the free run gets worse"),
        (0.2, 0.02, 0.5, 0.9, ""),
    ],
)
def test_why_a_candidate_is_not_credited(
    share: float, spread: float, free_run: float, tolerance: float, why: str
) -> None:
    (only,) = rank(BASE, [_fit("spring", "x", share, spread, 8)], lambda fit: free_run, tolerance)
    assert only.evidence.accepted == (why == "")
    assert why in only.evidence.why_not


def test_a_gain_within_tolerance_is_no_effect() -> None:
    fit = _fit("input_gain", "w", 0.2, 0.02, 9)
    fit.parameters["gain"] = 1.01
    assert not rank(BASE, [fit], lambda f: 0.5, 0.01)[0].evidence.accepted
    assert rank(BASE, [fit], lambda f: 0.5, 0.001)[0].evidence.accepted
