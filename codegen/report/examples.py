"""Example parameters and motions for the pictures of laws and effects, from ``examples.yaml``."""

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict

from codegen.spec.validation import read_model

Panel = Literal["steady", "slow", "loop", "presliding", "time", "step", "rests"]
FILE = Path(__file__).with_suffix(".yaml")


class Example(BaseModel):
    """Parameters and motion with which a law is drawn, in N, m and s.

    Attributes:
        panels: of the picture, from left to right.
        top_speed: amplitude of the sinusoidal slip velocity at ``frequency``.
        presliding: amplitudes of small sinusoidal slips.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    parameters: dict[str, float]
    panels: tuple[Panel, ...] = ("steady",)
    top_speed: float = 0.1
    frequency: float = 1.0
    presliding: tuple[float, ...] = ()


class ExamplesFile(BaseModel):
    """Content of ``examples.yaml``: examples of laws by name; of effects by kind, parameter → value."""

    model_config = ConfigDict(extra="forbid")
    laws: dict[str, Example]
    effects: dict[str, dict[str, float]]


EXAMPLES = read_model(FILE, ExamplesFile, "examples (YAML)")
