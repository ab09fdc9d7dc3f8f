"""The generated observer as a target takes it: its program, its C, and what is certified of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from codegen.program import Program


@dataclass(frozen=True)
class Controller:
    """The observer of a spec in one precision.

    Attributes:
        sources: file → text of the C and of the Python twin.
        claim: of the certificate, or why there is none.
        certified: whether there is one.
    """

    program: Program
    sources: Mapping[str, str]
    claim: str
    certified: bool

    @property
    def period(self) -> float:
        """The observer's sample time, s."""
        return next(p.value for p in self.program.parameters if p.name == "sample_time" and p.value is not None)
