"""Example parameters and motions for the pictures of laws and effects, from ``examples.yaml``."""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel, ConfigDict

from codegen.base.input_files import read_text
from codegen.spec.validation import validate
from codegen.spec.yaml_text import load_plain

FILE = Path(__file__).with_suffix(".yaml")


class Example(BaseModel):
    """Parameters and motion with which a law is drawn, in N, m and s.

    Attributes:
        top_speed: amplitude of the sinusoidal slip velocity at ``frequency``.
        presliding: amplitudes of small sinusoidal slips.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    parameters: dict[str, float]
    top_speed: float = 0.1
    frequency: float = 1.0
    presliding: tuple[float, ...] = ()


class ExamplesFile(BaseModel):
    """Content of ``examples.yaml``: examples of laws by name; of effects by kind, parameter → value."""

    model_config = ConfigDict(extra="forbid")
    laws: dict[str, Example]
    effects: dict[str, dict[str, float]]


def _read() -> ExamplesFile:
    document, places = load_plain(read_text(FILE, "examples (YAML)"), FILE.name)
    return validate(ExamplesFile, document, places, FILE.name)


EXAMPLES = _read()
