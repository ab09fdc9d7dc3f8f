"""Remarks on an exported model: what it represents exactly, approximately or not at all, and with what error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Held = Literal["exact", "nearest", "dropped"]
CORNER = ", with a sharp corner in place of a rounded one"


@dataclass(frozen=True)
class Remark:
    """How the exported model represents one property of the machine.

    Attributes:
        where: the property, such as ``contact guide``.
        held: ``exact``, ``nearest`` (approximated by the nearest element of the target), or ``dropped``.
        how: the element of the model that represents it.
        worst, rms: largest and RMS force error over the envelope; None if there is none, or it is no force.
        unit: of these.
    """

    where: str
    held: Held
    how: str
    worst: float | None = None
    rms: float | None = None
    unit: str = ""

    @classmethod
    def with_errors(cls, where: str, held: Held, how: str, errors: NDArray[np.float64], unit: str) -> Remark:
        """A remark with the largest and the RMS of the force errors at sampled points."""
        rms = float(np.sqrt(np.mean(errors**2)))
        return cls(where, held, how, float(np.abs(errors).max(initial=0.0)), rms, unit)

    @property
    def text(self) -> str:
        """The remark as a line."""
        errors = "" if self.worst is None else f"; force error at most {self.worst:.4g}, RMS {self.rms:.4g} {self.unit}"
        return f"{self.where}: {self.held}: {self.how}{errors}"
