"""The verdict of a diagnosis with its models."""

from __future__ import annotations

from dataclasses import dataclass

from codegen.diagnosis.results import ErrorFigures, FoundEffect, ParameterError, Verdict
from codegen.mechanics.system import System


@dataclass(frozen=True, eq=False)
class Answer:
    """A verdict and the systems that go with it.

    Attributes:
        effects: those that the verdict names, credited or not.
        refit, augmented: the system with refitted values, and that with the effects added to it.
        figures: errors of the declared, refit and augmented model on held-out data.
        errors: parameter errors in the model that is written.
        against: why the effects are not credited, in words.
        remarks: further sentences for the report.
    """

    verdict: Verdict
    effects: tuple[FoundEffect, ...]
    refit: System
    augmented: System
    figures: tuple[ErrorFigures, ErrorFigures, ErrorFigures]
    errors: tuple[ParameterError, ...] = ()
    against: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def adopted(self) -> System | None:
        """The system whose values are written into the spec; None where the spec stays as it is."""
        if self.verdict == "unfit":
            return None
        return self.augmented if self.verdict == "effect" else self.refit
