"""The search for P of a family: at the vertices of cells, or where that shows too little, on cells of a cover."""

from __future__ import annotations

from collections.abc import Iterator

from codegen.analysis.analysis import Analysis
from codegen.certify.content import Found
from codegen.certify.enclosure import Cells, enclose_family
from codegen.certify.family import Family
from codegen.certify.lyapunov import common_lyapunov, extreme, gentle
from codegen.certify.trigonometric import over_angles

FINER = (0, 2, 4)
MOST_MATRICES = 150
ENOUGH = 0.9


def proposals_for(analysis: Analysis, family: Family, spectral_rate: float) -> tuple[Cells, Iterator[Found]]:
    """The cells of the envelope, and what the solver found, the fastest first.

    Args:
        spectral_rate: of the slowest operating point, 1/s; a common P that comes near it is enough.

    Raises:
        NotEnclosable, codegen.checker.verify.Refused: where the family cannot be enclosed.
    """
    h = 0.0 if analysis.dynamics.implicit else float(analysis.dynamics.observer.sample_time)
    cells, common = _common(family, h)

    def fastest_first() -> Iterator[Found]:
        if h and (common is None or common.alpha < ENOUGH * spectral_rate):
            found = over_angles(family, analysis.dynamics.observer.sample_time)
            if found is not None and (common is None or common.alpha < found.alpha):
                yield found
        if common is not None:
            yield from _gentle(analysis, cells, common, h)
            yield common

    return cells, fastest_first()


def _gentle(analysis: Analysis, cells: Cells, common: Found, h: float) -> Iterator[Found]:
    """Of one matrix, a P of the same rate that a reversal makes grow least."""
    observer = analysis.dynamics.observer
    matrices = extreme(cells.matrices)
    if len(matrices) > 1 or not observer.level_errors:
        return
    contacts = range(len(observer.signs))
    turned = [[k for k, e in enumerate(observer.errors) if e.contact == c] for c in contacts]
    found = gentle(matrices[0], h, [each for each in turned if each])
    if found is not None:
        yield Found(common.alpha, common.splits, [found])


def _common(family: Family, h: float) -> tuple[Cells, Found | None]:
    """A common Lyapunov matrix, with the envelope cut finer as long as none is found."""
    cells = enclose_family(family)
    proposal = common_lyapunov(cells.matrices, h)
    for finer in FINER[1:]:
        if proposal is not None or not family.variables:
            break
        finer_cells = enclose_family(family, finer)
        if len(finer_cells.matrices) > MOST_MATRICES:
            break
        cells = finer_cells
        proposal = common_lyapunov(cells.matrices, h)
    return cells, None if proposal is None else Found(proposal[1], cells.splits, [proposal[0]])
