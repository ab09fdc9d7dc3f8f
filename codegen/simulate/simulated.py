"""What ``stiction simulate`` hands out: the log it wrote, and what to know of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from codegen.base.shown import Result
from codegen.simulate.excursions import Excursion, excursions
from codegen.simulate.loop_run import LoopRun, write_log
from codegen.spec.model import Spec


@dataclass(frozen=True, repr=False)
class Simulated(Result):
    """A log that was written.

    Attributes:
        excursions: where the motion leaves the spec's envelope, the worst first.
        notes: what another simulator's plant holds by the nearest, or not at all.
        gain, share: ``gain`` of ``cancellation:`` and ``cancel`` of ``simulation:``, whose product of the friction
            estimate the input cancels; None where it cancels none.
    """

    template = "simulated_notes"
    path: Path
    excursions: tuple[Excursion, ...]
    gain: float | None = None
    share: float | None = None
    notes: tuple[str, ...] = ()

    @property
    def summary(self) -> Mapping[str, object]:
        left = ", ".join(e.name for e in self.excursions)
        return {"log": self.path, "outside the envelope": left or "never"}

    @property
    def content(self) -> dict[str, Any]:
        """The JSON object that the command prints."""
        excursions = [asdict(e) for e in self.excursions]
        return {
            "format": "stiction-simulation/1",
            "log": str(self.path),
            "excursions": excursions,
            "gain": self.gain,
            "share": self.share,
            "notes": list(self.notes),
        }


def write_simulated(path: Path, spec: Spec, run: LoopRun, notes: tuple[str, ...] = ()) -> Simulated:
    """Write a run's log.

    Raises:
        BadInput: if the folder cannot be written to.
    """
    write_log(path, spec, run)
    share = spec.simulation.cancel if spec.simulation is not None else None
    gain = float(spec.cancellation.gain) if spec.cancellation is not None else 1.0
    return Simulated(path, excursions(spec, run), None if share is None else gain, share, notes)
