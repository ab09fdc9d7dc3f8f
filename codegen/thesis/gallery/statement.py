"""Statements of the thesis about its figures, read from ``claims/``, a file for each chapter.

The files hold no verdicts: whether a statement holds is computed.
"""

import math
from functools import cache
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from codegen.base.errors import Place, refuse_unknown
from codegen.spec.validation import read_model
from codegen.thesis.gallery.setting import Setting

CLAIMS = Path(__file__).parent / "claims"
SETTINGS = Path(__file__).parent / "settings.yaml"


class Statement(BaseModel):
    """One statement of the text about a figure.

    Attributes:
        says: the statement, in our words or as a short quotation.
        where: section and page, or "ours" for a statement that is not in the thesis.
        measure: name of the function that computes a number from the runs.
        number: meaning of that number, in words.
        holds: the condition on the number, such as "< 1" or "> 0.5".
        unit: of the number.
        note: the reason for the verdict, if it is known.
        closed_form: whether the number follows from the spec alone and is the same in every setting.
    """

    model_config = ConfigDict(extra="forbid", strict=True)
    says: str
    where: str
    measure: str
    number: str
    holds: str = Field(pattern=r"^[<>] -?\d+(?:\.\d+)?(?:e-?\d+)?$")
    unit: str = ""
    note: str = ""
    closed_form: bool = False

    def is_met(self, value: float) -> bool:
        """Whether the number is finite and satisfies the condition."""
        sign, limit = self.holds.split()
        return math.isfinite(value) and bool(value < float(limit) if sign == "<" else value > float(limit))


class Making(BaseModel):
    """The functions that make a figure.

    Attributes:
        module: of the gallery, with the functions named below and the figure's measures.
        runs: function (specs, setting, gains of a tuned PID or None) → Runs.
        draws: function that draws the runs of the setting "as drawn" on a matplotlib figure.
        rows: number of rows of panels, which gives the height.
        cost: approximate computing time relative to the other figures.
        pid_of: number of another figure with the same machine, servo and sensors, whose tuned PID is used.
    """

    model_config = ConfigDict(extra="forbid")
    module: str
    runs: str
    draws: str
    rows: float
    cost: float = 1.0
    pid_of: str = ""


class Figure(BaseModel):
    """A figure of the thesis.

    Attributes:
        figure: its number, such as "2.4".
        specs: files in specs/gallery/, first those that are drawn.
        settings: names in settings.yaml of further settings in which the statements are checked.
        open: what the thesis does not state, or states inconsistently, and our assumption.
    """

    model_config = ConfigDict(extra="forbid", strict=True)
    figure: str
    title: str
    specs: list[str]
    made: Making
    settings: list[str] = []
    open: str = ""
    statements: list[Statement] = []

    @property
    def others(self) -> tuple[Setting, ...]:
        """The settings named by ``settings``, in addition to the one "as drawn", in which the figure is made."""
        return tuple(settings()[name] for name in self.settings)


class SettingsFile(BaseModel):
    """settings.yaml."""

    model_config = ConfigDict(extra="forbid")
    settings: list[Setting]


class ChapterFile(BaseModel):
    """A file of ``claims/``: the figures of a chapter."""

    model_config = ConfigDict(extra="forbid", strict=True)
    chapter: str
    figures: list[Figure]


@cache
def settings() -> dict[str, Setting]:
    """The settings of settings.yaml, by name."""
    return {s.name: s for s in read_model(SETTINGS, SettingsFile, "settings (YAML)").settings}


def read_figures() -> dict[str, Figure]:
    """Every figure by its number, in the order of the thesis. Raises BadInput for a file that is not a claims file."""
    found = {}
    for path in sorted(CLAIMS.glob("*.yaml")):
        for figure in read_model(path, ChapterFile, "a claims file (YAML)").figures:
            for name in figure.settings:
                refuse_unknown(name, settings(), Place(path.name), "unknown setting", code="SPEC008")
            found[figure.figure] = figure
    return found
