"""The verdict with the models that go with it, as they are written."""

from __future__ import annotations

from dataclasses import dataclass

from codegen.diagnosis.results import ErrorFigures, FoundEffect, ParameterError, Verdict
from codegen.mechanics.system import System


@dataclass(frozen=True, eq=False)
class Answer:
    """The verdict with its models.

    Attributes:
        effects: that are named, whether credited or not.
        refit, augmented: systems. declared_figures and the like: their errors on held-out data.
        errors: parameters that lie away from what was declared, in the model that is written.
        against: why the effects are not credited, in words. remarks: what else must be said.
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
        """The system whose values are written; None where the spec stays."""
        if self.verdict == "unfit":
            return None
        return self.augmented if self.verdict == "effect" else self.refit
