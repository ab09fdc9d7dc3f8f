"""Instructions a step, by callgrind: those of the step's own function and all that it calls."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from benchmarks.measure.build import Built

_TOTAL = re.compile(r"^(?:totals|summary): (\d+)", re.MULTILINE)


@dataclass(frozen=True)
class Count:
    """Instructions a step; ``parts``: function → its own share, the largest first."""

    instructions: float
    parts: Mapping[str, float]


def count(built: Built, rows: Path, samples: int) -> Count | None:
    """Instructions a step: two passes less one, divided; None where there is no valgrind."""
    if shutil.which("valgrind") is None:
        return None
    once, twice = (_run(built, rows, passes) for passes in (1, 2))
    parts = {name: (twice[1][name] - once[1].get(name, 0)) / samples for name in twice[1]}
    ordered = sorted(((n, v) for n, v in parts.items() if v >= 1), key=lambda item: -item[1])
    return Count((twice[0] - once[0]) / samples, dict(ordered))


def _run(built: Built, rows: Path, passes: int) -> tuple[int, dict[str, int]]:
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        command = ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", f"--toggle-collect={built.peer.step}"]
        subprocess.run(
            [*command, str(built.program), "count", str(rows), str(passes)],
            capture_output=True,
            check=True,
            timeout=600,
        )
        text = out.read_text(encoding="utf-8", errors="replace")
    totals = [int(number) for number in _TOTAL.findall(text)]
    return max(totals, default=0), _own(text)


def _own(text: str) -> dict[str, int]:
    """Function → instructions of its own, from callgrind's file."""
    names: dict[str, str] = {}
    own: dict[str, int] = {}
    current, skip = "", False
    for line in text.splitlines():
        if line.startswith(("fn=", "cfn=")):
            key, _, name = line.split("=", 1)[1].partition(" ")
            names.setdefault(key, name or key)
            if line.startswith("fn="):
                current = names[key].split("'")[0]
        elif line.startswith("calls="):
            skip = True
        elif line[:1] in "0123456789+-*" and line:
            cost = line.split()
            if not skip and len(cost) == 2:
                own[current] = own.get(current, 0) + int(cost[1])
            skip = False
    return own
