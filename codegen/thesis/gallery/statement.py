"""Statements of the thesis about its figures, read from ``claims/``, one file per chapter, without verdicts."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr

from codegen.base.errors import Place, refuse_unknown
from codegen.base.input_files import read_text
from codegen.spec.validation import validate
from codegen.spec.yaml_text import load_plain
from codegen.thesis.gallery.setting import Setting

CLAIMS = Path(__file__).parent / "claims"
SETTINGS = Path(__file__).parent / "settings.yaml"
Model = TypeVar("Model", bound=BaseModel)


class Statement(BaseModel):
    """One statement of the text about a figure.

    Attributes:
        says: the statement, in our words or a short quotation.
        where: section and page; "ours" where it is no statement of the text.
        measure: name of the function that computes the number.
        number: what the number is.
        holds: "< 1" or "> 0.5": where the number has to lie.
        unit: of the number.
        note: why it comes out as it does, where that is known.
        closed_form: whether the number follows from the spec alone, so that no setting can change it.
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
        """Whether the number meets the condition; one that is not finite never does."""
        sign, limit = self.holds.split()
        return math.isfinite(value) and bool(value < float(limit) if sign == "<" else value > float(limit))


class Making(BaseModel):
    """How a figure is made, by names of functions in one of the gallery's modules, where its measures are too.

    Attributes:
        runs: specs, a setting and the PID's gains, if it is tuned already → Runs.
        draws: puts the runs as drawn on a matplotlib figure.
        rows: of panels, for the height.
        cost: approximate computing time relative to the other figures.
        pid_of: the figure whose tuned PID this one has too, since machine, servo and sensors are the same.
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
        figure: its number, "2.4".
        specs: files in specs/gallery/, first those that are drawn.
        settings: names in settings.yaml in which the statements are checked again, apart from the one as drawn.
        open: what the text does not state or states inconsistently, and what we assumed.
    """

    model_config = ConfigDict(extra="forbid", strict=True)
    figure: str
    title: str
    specs: list[str]
    made: Making
    settings: list[str] = []
    open: str = ""
    statements: list[Statement] = []
    _others: tuple[Setting, ...] = PrivateAttr(())

    @property
    def others(self) -> tuple[Setting, ...]:
        """The settings themselves."""
        return self._others


class SettingsFile(BaseModel):
    """All settings."""

    model_config = ConfigDict(extra="forbid")
    settings: list[Setting]


class ChapterFile(BaseModel):
    """The figures of a chapter."""

    model_config = ConfigDict(extra="forbid", strict=True)
    chapter: str
    figures: list[Figure]


def read_figures(folder: Path = CLAIMS) -> dict[str, Figure]:
    """Every figure by its number, in the order of the thesis. Raises BadInput for a file that is not a claims file."""
    settings = {s.name: s for s in _read(SETTINGS, SettingsFile).settings}
    found = {}
    for path in sorted(folder.glob("*.yaml")):
        for figure in _read(path, ChapterFile).figures:
            for name in figure.settings:
                refuse_unknown(name, settings, Place(path.name), "unknown setting", code="SPEC008")
            figure._others = tuple(settings[name] for name in figure.settings)
            found[figure.figure] = figure
    return found


def _read(path: Path, model: type[Model]) -> Model:
    document, places = load_plain(read_text(path, "a claims file (YAML)"), path.name)
    return validate(model, document, places, path.name)
