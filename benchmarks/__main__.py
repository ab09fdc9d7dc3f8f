"""``python -m benchmarks [ROW…]``: measure, and write docs/performance.md.

Without a name all rows are measured. With names only those; the others stay as they were measured before, which only
the same machine with the same tools may do.
"""

from __future__ import annotations

import argparse
import importlib
import sys

from benchmarks.machine import this_machine
from benchmarks.page import PAGE, Results, kept, section, write
from benchmarks.result import Row

ROWS = (
    *("two_mass", "two_link_arm", "seven_joint_arm", "chain", "cortex_m"),
    *("gain_study", "generation_time", "python_twin", "start_time"),
)


def measure(key: str) -> Row:
    """One row, measured now."""
    print(f"measuring {key}", file=sys.stderr, flush=True)
    found: Row = importlib.import_module(f"benchmarks.rows.{key}").row()
    return found


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__.splitlines()[0])
    parser.add_argument("rows", nargs="*", metavar="ROW", help=f"of {', '.join(ROWS)}; all without one")
    asked = parser.parse_args().rows
    if unknown := sorted(set(asked) - set(ROWS)):
        parser.error(f"no row {', '.join(unknown)}; there are {', '.join(ROWS)}")
    machine, before = this_machine(), kept() if asked else None
    found = {row.key: row for row in before.rows} if before is not None and before.machine == machine else {}
    for key in asked or ROWS:
        found[key] = measure(key)
        print(section(found[key]), flush=True)
        write(Results(machine, tuple(found[k] for k in ROWS if k in found)), complete=len(found) == len(ROWS))
    if missing := [key for key in ROWS if key not in found]:
        print(f"{PAGE} stays as it is: not measured on this machine: {', '.join(missing)}", file=sys.stderr)


if __name__ == "__main__":
    main()
