"""For every test: property tests draw the same few cases in `make test`, and more and new ones in `make check-all`
(HYPOTHESIS_PROFILE=random); the collector of cycles runs as rarely as in the command; linear algebra takes one thread;
SymPy keeps what it computed for many machines, not for the last one alone; a diagnosis forks no processes.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Iterator
from typing import Any
from unittest.mock import patch

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: two workers on two cores, and threads change bits
os.environ.setdefault("SYMPY_CACHE_SIZE", "20000")  # before SymPy; 1000 by default: a seventh more time in derivations

import pytest
from hypothesis import settings

from codegen.base import parallel

settings.register_profile("repeatable", derandomize=True, max_examples=30)
settings.register_profile("random", derandomize=False)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))

gc.set_threshold(100_000, 50, 50)  # as in stiction.main: a fifth of the time of a derivation goes into it otherwise

parallel.PROCESSES = 1
"""Both cores have a worker already, and a fork copies much of its memory: a sixth more time in a diagnosis. The command
allows forks, and they stay allowed for later tests. Tests of forks set this themselves; processes of tests do fork.
"""


def pytest_collection_finish() -> None:
    """What is imported and collected stays: the collector need not look at it again."""
    gc.freeze()


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Nor at what caches hold after a file of tests: a worker grows to 1.5 GB, of which a collection takes 0.6 s, and
    the readers of logs ask for one after each fault.
    """
    if nextitem is None or nextitem.path != item.path:
        gc.collect()
        gc.freeze()


@pytest.fixture(scope="module")
def unrendered() -> Iterator[None]:
    """The pictures of reports and gain maps are drawn and not rendered by matplotlib, which takes 0.3 s of a report and
    0.2 s for a map: for tests of text and files. What pictures show is tested in tests/report and test_gains.py.
    """
    from matplotlib.figure import Figure

    def drawn(
        draw: Callable[[Any], None],
        size: tuple[float, float],
        kind: str,
        dpi: int,
        spaces: object = None,
        *look: object,
    ) -> bytes:
        figure = Figure(figsize=size, layout=None if spaces is None else "constrained")
        with patch.object(figure, "draw_without_rendering"):  # the layout before the labels of lines
            draw(figure)
        return b"<svg xmlns='http://www.w3.org/2000/svg'/>"

    with patch("codegen.report.pictures.figure_bytes", drawn), patch("codegen.report.gain_map.figure_bytes", drawn):
        yield
