"""``python -m benchmarks.reference`` writes docs/laws.md, effects.md and errors.md, and their pictures."""

from __future__ import annotations

from pathlib import Path

from benchmarks.reference.effects import effect_pictures, effects_page
from benchmarks.reference.laws import law_pictures, laws_page
from benchmarks.text import render
from codegen.base.error_codes import CODES
from codegen.base.files import write_all

DOCS = Path(__file__).parents[2] / "docs"


def main() -> None:
    """Write the pages; a test finds them current."""
    pages = {
        "laws.md": laws_page(),
        "effects.md": effects_page(),
        "errors.md": render("errors.md.j2", codes=CODES),
    }
    write_all(DOCS, pages | law_pictures() | effect_pictures())


if __name__ == "__main__":
    main()
