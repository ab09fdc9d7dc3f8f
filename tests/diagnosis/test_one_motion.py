"""Two candidates that predict one motion are not told apart by an immaterial difference of their forces."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import patch

import numpy as np
import pytest

from codegen.diagnosis.fit import acceptance
from codegen.diagnosis.fit.acceptance import Evidence
from codegen.diagnosis.selection import comparison
from codegen.diagnosis.selection.comparison import EQUAL, preferred_by_force
from codegen.diagnosis.selection.ranking import Ranked

ROWS, DRIVE = 100, 8.0
USED = np.arange(ROWS)[:, None] % 2 == 0


def candidate(loss: float, force: float) -> Ranked:
    """One with this loss of each of 10 held-out segments, and a force residual of this RMS where it is used."""
    drive = SimpleNamespace(share=lambda forces: float(np.sqrt((forces**2).sum() / USED.sum())) / DRIVE)
    search = SimpleNamespace(problem=SimpleNamespace(used=USED), drive=drive)
    residual = np.where(USED, force, 1e3)  # samples at a reversal do not count
    criterion = cast(Any, SimpleNamespace(search=search, without_levels=residual))
    found = cast(Any, SimpleNamespace(held_out_losses=np.full(10, loss)))
    return Ranked(found, Evidence(1.0, 0.9, 5.0, 8, 8), 0.1, 0.3, "", force_criterion=criterion)


@pytest.mark.parametrize(
    ("nats", "apart", "near", "preferred"),
    [
        (0.1, 0.004, True, False),
        (0.1, 0.006, True, True),  # a material difference
        (EQUAL + 0.5, 0.004, True, True),  # free runs differ
        (0.1, 0.004, False, True),  # far from the noise, free runs are no reference
    ],
)
def test_the_force_residual_chooses(nats: float, apart: float, near: bool, preferred: bool) -> None:
    one, other = candidate(1.0, 0.0), candidate(1.0 + nats / 10, apart * DRIVE)
    with (
        patch.object(acceptance, "near_noise", lambda fit: near),
        patch.object(comparison, "force_prefers", lambda *given: True),
        patch.object(comparison, "most_left", lambda fit: 1.0),
        patch.object(comparison, "differ_in_time", lambda *fits: False),
    ):
        assert preferred_by_force(one, other) is preferred
