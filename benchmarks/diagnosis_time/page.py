"""The part of docs/performance.md with the time of diagnoses, from the measurements stored in times.json."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter

from benchmarks.practice.runs import Run, times
from benchmarks.result import Goal
from benchmarks.text import render

KEPT = Path(__file__).with_name("times.json")
BEGIN, END = "<!-- written by `python -m benchmarks.diagnosis_time` -->", "<!-- end of the time of diagnoses -->"
MEDIAN_S, NINTH_S, ARM_S = 8.0, 20.0, 180.0
BUSY = 1.3
"""Load average over the cores above which wall times say more of the other work than of ours."""


@dataclass(frozen=True)
class Measured:
    """Diagnoses of one version of the code, one after the other.

    Attributes:
        processor, cores, load: of the machine; load is its mean number of runnable processes while they ran.
        logs: of practice cases. arm: of the arm of seven joints; None where it was not run.
        verdicts: of the logs and then the arm, in words.
    """

    processor: str
    cores: int
    load: float
    logs: tuple[Run, ...]
    arm: Run | None
    verdicts: tuple[str, ...]


ADAPTER: TypeAdapter[Measured] = TypeAdapter(Measured)


def goals(found: Measured) -> Sequence[Goal]:
    """The goals; those of wall time cannot be judged on a busy machine."""
    quiet, spent = found.load <= BUSY * found.cores, times(found.logs)
    wall = spent.wall if spent is not None and quiet else (None, None, None)
    return (
        Goal("logs of about 25,000 samples: median of wall time", wall[0], MEDIAN_S, unit=" s", digits=1),
        Goal("logs of about 25,000 samples: 90th percentile of wall time", wall[1], NINTH_S, unit=" s", digits=1),
        Goal(
            "arm of seven joints, 25 s at 200 Hz: seconds of the processor",
            found.arm.cpu_s if found.arm is not None and found.arm.samples else None,
            ARM_S,
            unit=" s",
            digits=1,
        ),
    )


def section() -> str:
    """The part of the page, with its marks; empty where nothing was measured."""
    if not KEPT.exists():
        return ""
    found = ADAPTER.validate_json(KEPT.read_bytes())
    text = render("diagnosis_time.md.j2", found=found, goals=goals(found), times=times(found.logs), busy=BUSY)
    return f"{BEGIN}\n{text}{END}\n"


def with_section(page: str) -> str:
    """A page with the section in place of the one that it has, or at its end."""
    new = section()
    before, _, rest = page.partition(BEGIN)
    after = rest.partition(f"{END}\n")[2]
    return before.rstrip("\n") + "\n\n" + new + after if new else page
