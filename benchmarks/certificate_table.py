"""docs/certificates.md: what is certified, refuted and bounded. `python -m benchmarks.certificate_table SPECS`."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

from benchmarks.reversal_trade import picture
from benchmarks.text import render
from codegen.app.certify import certify
from codegen.base.files import write_atomically
from codegen.checker import verify as checker
from codegen.spec import read_spec

CLASSES = (0.1, 0.5, 1.0, 2.0, 5.0)
GENERATED, PICTURE = Path("generated"), "reversal_trade.svg"


def row(path: Path) -> dict[str, Any]:
    """Certify one spec and time the checker on its generated folder: spec, observer section, result, and an upper bound
    on the checker's time in s, the C and its bounds included, as a class, so that the table is the same on each run.

    Raises BadInput as ``stiction certify``.
    """
    spec, found = read_spec(path), certify(path)
    proofs, check = tuple(found.outcome.proofs.values()), None
    if proofs:
        start = time.process_time()  # a wall clock would tell of what else the machine does
        checker.check(proofs[0], GENERATED / spec.name)
        took = time.process_time() - start
        check = next((c for c in CLASSES if took < c), float("inf"))
    refusal = None if found.certificate else found.outcome
    return {"spec": spec, "found": found, "certificate": found.certificate, "refusal": refusal, "check": check}


def main() -> None:
    """Write the table and its picture."""
    parser = argparse.ArgumentParser(description="Write the table of certificates.")
    parser.add_argument("specs", type=Path, nargs="+")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/certificates.md"))
    given = parser.parse_args()
    write_atomically(given.output.with_name(PICTURE), picture(GENERATED))
    write_atomically(given.output, render("certificates.md.j2", rows=[row(path) for path in given.specs]))


if __name__ == "__main__":
    main()
