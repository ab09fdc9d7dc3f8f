"""A fit is held within the bounds of its prior, wherever it begins."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from codegen.diagnosis.fit.output_error import WITHIN
from tests.diagnosis.stage import log_of, stage
from tests.diagnosis.test_adoption import loose, search_of


def test_a_fit_that_begins_beyond_the_prior_s_bounds_ends_within_them(tmp_path: Path) -> None:
    """Where no step improves, a fit stays where it began: with no step at all it is that case."""
    heavier = "[{kind: inertia_error, on: x, parameters: {delta: 2}}]"
    search = search_of(loose(), log_of(stage(heavier), tmp_path, "train.csv"))
    refit = search.refit()
    tolerance = np.where(search.prior_precision > 0, np.maximum(search.prior_precision, 1e-300) ** -0.5, np.inf)
    place = [s.name for s in refit.runner.trial.refitted_symbols].index("m")
    start = refit.theta.copy()
    start[place] = 4.0
    found = search.fit_from(refit.runner, start, refit, 0)
    assert start[place] - search.declared[place] > WITHIN * tolerance[place]
    assert abs(found.theta[place] - search.declared[place]) <= WITHIN * tolerance[place] * (1 + 1e-9)
