"""A backlash whose fit ended in a local minimum finds its values from well damped contacts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection.candidate_fits import CandidateFits
from codegen.effects import CATALOGUE
from tests.diagnosis.stage import log_of, stage
from tests.diagnosis.test_adoption import search_of

TRUTH = {"gap": 0.01, "k": 6000.0, "c": 60.0, "load_fraction": 0.35}
LIGHT = {"gap": 0.01, "k": 2000.0, "c": 10.0, "load_fraction": 0.12}


def test_a_backlash_is_fitted_again_from_well_damped_contacts(tmp_path: Path) -> None:
    values = ", ".join(f"{name}: {value:g}" for name, value in TRUTH.items())
    log = log_of(stage(f"[{{kind: backlash, on: x, parameters: {{{values}}}}}]"), tmp_path, "train.csv")
    search, _ = search_of(stage(), log)
    base = search.refit()
    part = part_of(CATALOGUE["backlash"], 0, search.system)
    tried = CandidateFits(search, base, (part,), lambda share: None)
    start = search.fit_from(tried.runners[0], np.append(base.theta, part.inward(LIGHT)), base, 6)
    (again,) = tried.restarted([start])
    assert start.cost < base.cost - 10
    assert again.cost < 0.5 * start.cost
    assert again.parameters["gap"] == pytest.approx(TRUTH["gap"], rel=1e-3)
    assert again.parameters["load_fraction"] == pytest.approx(TRUTH["load_fraction"], rel=0.01)
