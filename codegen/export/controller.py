"""The generated observer as a target takes it: its program, its C, and what is certified of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from codegen.certify.outcome import Certificate, Refusal
from codegen.program import Program


@dataclass(frozen=True)
class Controller:
    """The observer of a spec in one precision.

    Attributes:
        sources: file → text of the C and of the Python twin.
        prove: gives the certificate, or why there is none; a target that cannot hold the observer does not ask.
    """

    program: Program
    sources: Mapping[str, str]
    prove: Callable[[], Certificate | Refusal]

    @property
    def certified(self) -> bool:
        return isinstance(self.prove(), Certificate)

    @property
    def claim(self) -> str:
        """Of the certificate, or why there is none."""
        outcome = self.prove()
        if isinstance(outcome, Refusal):
            return outcome.reason
        return f"Certified rate {outcome.decay_rate:.6g} 1/s over the envelope, by `stiction certify`."

    @property
    def period(self) -> float:
        """The observer's sample time, s."""
        return next(p.value for p in self.program.parameters if p.name == "sample_time" and p.value is not None)
