"""Production of figures: pictures and verdicts, in several processes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from codegen.base.errors import refuse_unknown
from codegen.base.parallel import in_processes
from codegen.base.resources import resource_folder
from codegen.report.style import STYLE, figure_bytes
from codegen.spec import Spec, read_spec
from codegen.thesis.gallery import arm, drawing, laws, rig, servo, two_mass
from codegen.thesis.gallery.measures import Reading
from codegen.thesis.gallery.runs import Gains, Runs
from codegen.thesis.gallery.setting import AS_DRAWN, Setting
from codegen.thesis.gallery.statement import Figure, Statement, read_figures

FOLDER = "gallery"
MODULES = {m.__name__.rpartition(".")[2]: m for m in (arm, laws, rig, servo, two_mass)}


@dataclass(frozen=True)
class Verdict:
    """A statement's number in every setting; the first setting is the one as drawn."""

    statement: Statement
    settings: tuple[Setting, ...]
    readings: tuple[Reading, ...]

    @property
    def holds(self) -> bool:
        """Whether the statement holds in the setting as drawn."""
        return self.statement.is_met(self.readings[0].value)

    @property
    def others(self) -> tuple[tuple[Setting, Reading], ...]:
        """Settings in which the verdict differs from that as drawn, each with its number."""
        pairs = zip(self.settings, self.readings, strict=True)
        return tuple((s, r) for s, r in pairs if self.statement.is_met(r.value) != self.holds)


@dataclass(frozen=True)
class GalleryResult:
    """A figure: its entry, picture, gains of the PID for comparison, and verdicts."""

    figure: Figure
    picture: bytes
    pid: Gains | None
    verdicts: tuple[Verdict, ...]


def run_gallery(only: Sequence[str], progress: Callable[[float], None]) -> tuple[GalleryResult, ...]:
    """Make figures and check their statements in every setting, in several processes (``in_processes``).

    ``only``: numbers such as "4.3"; all if none is given. Raises BadInput for an unknown number.
    """
    made = {number: figure.made for number, figure in read_figures().items()}
    numbers = only or tuple(made)
    for number in numbers:
        refuse_unknown(number, made, "--only", "", "a figure's number", code="CALL001")
    # Figures that share a tuned PID are made one after the other; the slow groups begin first.
    groups = [[n, *(m for m in numbers if made[m].pid_of == n)] for n in numbers if made[n].pid_of not in numbers]
    groups.sort(key=lambda group: -sum(made[n].cost for n in group))
    results = in_processes(_make_group, groups, begun=lambda k: progress(k / len(groups)), threads=False)
    found = {result.figure.figure: result for group in results for result in group}
    return tuple(found[number] for number in numbers)


def _make_group(numbers: Sequence[str]) -> list[GalleryResult]:
    """The first figure, and the others with the PID that was tuned for it."""
    first = make_figure(numbers[0])
    return [first, *(make_figure(number, first.pid) for number in numbers[1:])]


def make_figure(number: str, pid: Gains | None = None) -> GalleryResult:
    """One figure with its picture and verdicts.

    ``pid``: gains tuned for the same machine, servo and sensors; None: they are tuned here.
    """
    entry = read_figures()[number]
    made, specs = entry.made, figure_specs(entry)
    module = MODULES[made.module]
    run, draw = getattr(module, made.runs), getattr(module, made.draws)
    drawn: Runs = run(specs, AS_DRAWN, pid)
    size = (drawing.WIDTH_IN, drawing.ROW_IN * made.rows + drawing.LEGEND_IN)
    spaces, look = {"w_pad": 0.07, "h_pad": 0.06, "wspace": 0.03, "hspace": 0.04}, STYLE | drawing.STYLE
    picture = figure_bytes(lambda figure: draw(figure, drawn), size, "png", drawing.DPI, spaces, look)
    settings = (AS_DRAWN, *entry.others)
    readings: list[list[Reading]] = [[] for _ in entry.statements]
    for setting in settings if entry.statements else ():
        runs = drawn if setting is AS_DRAWN else run(specs, setting, drawn.pid)
        for row, statement in zip(readings, entry.statements, strict=True):
            if setting is AS_DRAWN or not statement.closed_form:
                row.append(getattr(module, statement.measure)(runs))
    verdicts = [Verdict(s, settings[: len(row)], tuple(row)) for s, row in zip(entry.statements, readings, strict=True)]
    return GalleryResult(entry, picture, drawn.pid, tuple(verdicts))


def figure_specs(figure: Figure) -> tuple[Spec, ...]:
    """The shipped specs of a figure."""
    folder = resource_folder("specs") / FOLDER
    return tuple(read_spec(folder / f"{name}.yaml") for name in figure.specs)
