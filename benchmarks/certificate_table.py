"""docs/certificates.md: what is certified, refuted and bounded. `python -m benchmarks.certificate_table SPECS`."""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

from codegen.app.certify import certify
from codegen.base.files import write_atomically
from codegen.base.text import render
from codegen.checker import verify as checker
from codegen.spec import read_spec

CLASSES = (0.05, 0.1, 0.5, 1.0, 5.0)


def row(path: Path) -> dict[str, Any]:
    """Certify one spec and time the checker on what is handed out: spec, observer section, result, and an upper bound
    on the checker's time in s, as a class, so that the table is the same on each run.

    Raises:
        BadInput: as ``stiction certify``.
    """
    spec, found = read_spec(path), certify(path)
    proofs = tuple(found.outcome.proofs.values())
    start = time.process_time()  # a wall clock would tell of what else the machine does
    for text in proofs[:1]:
        checker.check(text)
    took = time.process_time() - start
    check = next((c for c in CLASSES if took < c), float("inf")) if proofs else None
    refusal = None if found.certificate else found.outcome
    return {"spec": spec, "found": found, "certificate": found.certificate, "refusal": refusal, "check": check}


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description="Write the table of certificates.")
    parser.add_argument("specs", type=Path, nargs="+")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/certificates.md"))
    given = parser.parse_args()
    write_atomically(given.output, render("text/certificates.md.j2", rows=[row(path) for path in given.specs]))


if __name__ == "__main__":
    main()
