"""The entry of the command: an interrupt while libraries are still being loaded ends it as one during a verb does."""

from __future__ import annotations

import sys

INTERRUPTED = 130


def main() -> None:
    """Load the verbs, which takes seconds, and run one."""
    try:
        from codegen.app.cli import main as run

        run()
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)
