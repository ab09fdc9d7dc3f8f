"""A backlash whose fit ended in a local minimum finds its values from well damped contacts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection.candidate_fits import CandidateFits
from codegen.effects import CATALOGUE
from codegen.effects.compliance import Backlash
from tests.diagnosis.stage import log_of, stage
from tests.diagnosis.test_adoption import search_of

SMALL = {"gap": 3e-5, "k": 60000.0, "c": 600.0, "load_fraction": 0.6}
TRUTH = {"gap": 0.01, "k": 6000.0, "c": 60.0, "load_fraction": 0.35}
LIGHT = {"gap": 0.02, "k": 2000.0, "c": 10.0, "load_fraction": 0.12}


def test_a_backlash_is_fitted_again_from_well_damped_contacts(tmp_path: Path) -> None:
    values = ", ".join(f"{name}: {value:g}" for name, value in TRUTH.items())
    log = log_of(stage(f"[{{kind: backlash, on: x, parameters: {{{values}}}}}]"), tmp_path, "train.csv")
    search = search_of(stage(), log)
    base = search.refit()
    part = part_of(CATALOGUE["backlash"], 0, search.system)
    tried = CandidateFits(search, base, (part,))
    start = search.fit_from(tried.runners[0], np.append(base.theta, part.inward(LIGHT)), base, 6)
    (again,) = tried.restarted([start])
    assert start.cost < base.cost - 10 and start.parameters["gap"] < 0.8 * TRUTH["gap"]
    assert again.cost < 0.5 * start.cost
    assert again.parameters["gap"] == pytest.approx(TRUTH["gap"], rel=1e-3)
    assert again.parameters["load_fraction"] == pytest.approx(TRUTH["load_fraction"], rel=0.01)


def test_searches_of_a_backlash_begin_from_starts_that_differ(tmp_path: Path) -> None:
    """Two searches that began at the smallest gap, beside the spring alone, kept a fifth of the true gap."""
    values = ", ".join(f"{name}: {value:g}" for name, value in SMALL.items())
    log = log_of(stage(f"[{{kind: backlash, on: x, parameters: {{{values}}}}}]"), tmp_path, "train.csv")
    search = search_of(stage(), log)
    parts = tuple(part_of(CATALOGUE[kind], 0, search.system) for kind in ("compliance", "backlash"))
    tried = CandidateFits(search, search.refit(), parts)
    tried.screened([0])
    (found,) = tried.screened([1])
    starts = np.array([theta[-4:] for _, theta in tried.starts_by_runs[1]])
    apart = np.abs(starts[:, None] - starts).max(axis=2)[np.triu_indices(len(starts), 1)]
    assert len(starts) == 3 and apart.min() > 1, "a factor of e in one of the parameters"
    gap = tried.trials[1].split(found.theta)[1][-1]["gap"]
    assert gap == pytest.approx(SMALL["gap"], rel=0.3)


def test_one_more_search_begins_at_softer_or_harder_contacts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit with twice the true stiffness and damping, which no other load mends."""
    values = ", ".join(f"{name}: {value:g}" for name, value in TRUTH.items())
    log = log_of(stage(f"[{{kind: backlash, on: x, parameters: {{{values}}}}}]"), tmp_path, "train.csv")
    search = search_of(stage(), log)
    base = search.refit()
    part = part_of(CATALOGUE["backlash"], 0, search.system)
    monkeypatch.setattr(Backlash, "restarts", lambda self, values, covered: [dict(values) | {"load_fraction": 0.01}])
    tried = CandidateFits(search, base, (part,))
    hard = TRUTH | {name: 2 * TRUTH[name] for name in ("k", "c")}
    start = search.fit_from(tried.runners[0], np.append(base.theta, part.inward(hard)), base, 0)
    (again,) = tried.restarted([start])
    assert again.cost < 0.5 * start.cost
    assert again.parameters["k"] == pytest.approx(TRUTH["k"], rel=0.02)
    monkeypatch.setattr(Backlash, "neighbours", lambda self, values: [])
    assert tried.restarted([start])[0].cost > 0.9 * start.cost
