"""Figures → pictures and verdicts, each figure in a process of its own."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing import get_context

from codegen.base.errors import refuse_unknown
from codegen.base.resources import resource_folder
from codegen.report.style import png
from codegen.spec import Spec, read_spec
from codegen.thesis.gallery import arm, cancelling, drawing, hysteresis, laws, rig, servo, two_mass
from codegen.thesis.gallery.figure import AS_DRAWN, Plot
from codegen.thesis.gallery.measures import Reading
from codegen.thesis.gallery.runs import Gains
from codegen.thesis.gallery.setting import Setting
from codegen.thesis.gallery.statement import FigureText, Statement, read_figures

FOLDER = "gallery"


@dataclass(frozen=True)
class Verdict:
    """One statement in every setting; the first is the one as drawn."""

    statement: Statement
    settings: tuple[Setting, ...]
    readings: tuple[Reading, ...]

    @property
    def holds(self) -> bool:
        """As drawn."""
        return self.statement.holds(self.readings[0].value)

    @property
    def others(self) -> tuple[tuple[Setting, Reading], ...]:
        """Settings in which the verdict is another one than as drawn, with the number there."""
        pairs = zip(self.settings, self.readings, strict=True)
        return tuple((s, r) for s, r in pairs if self.statement.holds(r.value) != self.holds)


@dataclass(frozen=True)
class GalleryResult:
    """A figure: its text, its picture, the PID beside it and its verdicts."""

    text: FigureText
    picture: bytes
    pid: Gains | None
    verdicts: tuple[Verdict, ...]


def figure_numbers() -> tuple[str, ...]:
    """Of all figures that can be made, in the order of the thesis."""
    return tuple(read_figures())


def run_gallery(
    only: Sequence[str] = (), progress: Callable[[float], None] | None = None, workers: int | None = None
) -> tuple[GalleryResult, ...]:
    """Make figures and check their statements in every setting.

    Args:
        only: numbers such as "4.3"; all if none is given.
        workers: processes; as many as there are cores if not given, none for 1.

    Raises:
        BadInput: for a number that is no figure here.
    """
    numbers = only or figure_numbers()
    for number in numbers:
        refuse_unknown(number, figure_numbers(), "--only", "", "a figure's number", code="CALL001")
    # The slow ones first, so that none is left alone at the end.
    order = sorted(numbers, key=lambda n: -PLOTS[n].cost)
    found: dict[str, GalleryResult] = {}
    count, tell = workers or os.cpu_count() or 1, progress or (lambda share: None)
    if count == 1 or len(order) == 1:
        for number in sorted(order, key=lambda n: PLOTS[n].pid_of in order):
            found[number] = make_figure(number, _pid_of(number, found))
            tell(len(found) / len(order))
    else:
        with ProcessPoolExecutor(count, mp_context=get_context("spawn")) as pool:
            waiting = {pool.submit(make_figure, n): n for n in order if PLOTS[n].pid_of not in order}
            while waiting:
                for done in wait(waiting, return_when=FIRST_COMPLETED).done:
                    number = waiting.pop(done)
                    found[number] = done.result()
                    waiting |= {
                        pool.submit(make_figure, n, found[number].pid): n for n in order if PLOTS[n].pid_of == number
                    }
                    tell(len(found) / len(order))
    return tuple(found[number] for number in numbers)


def _pid_of(number: str, found: Mapping[str, GalleryResult]) -> Gains | None:
    other = PLOTS[number].pid_of
    return found[other].pid if other is not None and other in found else None


def make_figure(number: str, pid: Gains | None = None) -> GalleryResult:
    """One figure with its picture and verdicts.

    Args:
        pid: gains that are tuned already for its machine, servo and sensors.
    """
    text, plot = read_figures()[number], PLOTS[number]
    specs = figure_specs(text)
    drawn = plot.run(specs, AS_DRAWN, pid)
    size = (drawing.WIDTH_IN, drawing.ROW_IN * plot.rows + drawing.LEGEND_IN)
    picture = png(lambda figure: plot.draw(figure, drawn), size, drawing.DPI, **drawing.STYLE)
    settings = (AS_DRAWN, *plot.settings)
    readings: list[list[Reading]] = [[] for _ in text.statements]
    for setting in settings if text.statements else ():
        runs = drawn if setting is AS_DRAWN else plot.run(specs, setting, drawn.pid)
        for row, statement in zip(readings, text.statements, strict=True):
            if setting is AS_DRAWN or not statement.entry.closed_form:
                row.append(plot.measures[statement.entry.measure](runs))
    verdicts = [Verdict(s, settings[: len(row)], tuple(row)) for s, row in zip(text.statements, readings, strict=True)]
    return GalleryResult(text, picture, drawn.pid, tuple(verdicts))


def figure_specs(text: FigureText) -> tuple[Spec, ...]:
    """The shipped specs of a figure."""
    folder = resource_folder("specs") / FOLDER
    return tuple(read_spec(folder / f"{name}.yaml") for name in text.entry.specs)


PLOTS: dict[str, Plot] = {
    **laws.PLOTS,
    **servo.PLOTS,
    **two_mass.PLOTS,
    **arm.PLOTS,
    **cancelling.PLOTS,
    **hysteresis.PLOTS,
    **rig.PLOTS,
}
