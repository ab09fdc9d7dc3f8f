"""Remarks on an exported model: what it represents exactly, approximately or not at all, and with what error."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Held = Literal["exact", "nearest", "dropped"]
CORNER = ", with a sharp corner in place of a rounded one"


@dataclass(frozen=True)
class Remark:
    """One thing of the machine in the exported model.

    Attributes:
        where: of the machine, such as ``contact guide``.
        held: exact, approximated by the nearest element of the target, or dropped.
        how: the element of the model that represents it.
        worst, rms: of the force that differs over the envelope; None where that is no force or nothing differs.
        unit: of these.
    """

    where: str
    held: Held
    how: str
    worst: float | None = None
    rms: float | None = None
    unit: str = ""

    @classmethod
    def costing(cls, where: str, held: Held, how: str, errors: NDArray[np.float64], unit: str) -> Remark:
        """With the largest and the RMS of the force errors at sampled points."""
        rms = float(np.sqrt(np.mean(errors**2)))
        return cls(where, held, how, float(np.abs(errors).max(initial=0.0)), rms, unit)

    @property
    def text(self) -> str:
        cost = "" if self.worst is None else f"; force error at most {self.worst:.4g}, RMS {self.rms:.4g} {self.unit}"
        return f"{self.where}: {self.held}: {self.how}{cost}"

    @property
    def content(self) -> dict[str, Any]:
        return asdict(self)
