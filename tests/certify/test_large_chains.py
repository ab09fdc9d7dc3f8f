"""A chain of n contacts is analysed in work that grows with n, and not with the entries of its matrices, 4 n²."""

from __future__ import annotations

from cProfile import Profile
from pathlib import Path

import numpy as np
import pytest

from codegen.analysis.analysis import analyse
from codegen.certify.certify import Refusal, certify
from codegen.checker.verify import MAX_SIZE
from codegen.observers import observer_of
from codegen.spec import read_spec
from tests.machines import chain

SIZES = (4, 8, 16)


def calls(path: Path) -> int:
    """Functions that the analysis of a spec calls."""
    spec = read_spec(path)
    observer, profile = observer_of(spec), Profile(builtins=False)
    profile.runcall(analyse, spec, observer)
    return sum(entry.callcount for entry in profile.getstats())


@pytest.mark.slow
def test_the_work_grows_with_the_chain(tmp_path: Path) -> None:
    """From each size to the next about twice the calls are added; where every entry is touched, four times."""
    paths = [tmp_path / f"{n}.yaml" for n in SIZES]
    for path, n in zip(paths, SIZES, strict=True):
        path.write_text(chain(n))
    calls(paths[0])  # what is made once in a process
    small, middle, large = (calls(path) for path in paths)
    assert large - middle < 2.3 * (middle - small), (small, middle, large)


@pytest.mark.parametrize("n", [MAX_SIZE // 2 + 1])
def test_beyond_the_checker_it_says_so_by_size(tmp_path: Path, n: int) -> None:
    """Not by the clock: the same spec has the same answer on every machine."""
    path = tmp_path / "chain.yaml"
    path.write_text(chain(n))
    spec = read_spec(path)
    outcome = certify(spec, analyse(spec, observer_of(spec), conditions=False), {}, "")
    assert isinstance(outcome, Refusal) and outcome.proof is None
    assert f"{2 * n} error components, and the checker takes at most {MAX_SIZE}" in outcome.reason


def test_points_at_which_nothing_differs_are_looked_at_once(tmp_path: Path) -> None:
    """In force errors the signs of the slips cancel: one matrix, whose radius is that at every point."""
    path = tmp_path / "chain.yaml"
    path.write_text(chain(4))
    spec = read_spec(path)
    found = analyse(spec, observer_of(spec))
    assert len(found.points.values) > 16 and len(found.radii) == len(found.points.values)
    assert np.unique(found.radii).size == 1 and abs(found.radii[0] / found.spectral_radius - 1) < 1e-9  # ten digits
