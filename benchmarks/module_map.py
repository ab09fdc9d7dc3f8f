"""docs/modules.md: every module of ``codegen/`` with the first sentence of its docstring, folder by folder.

``python -m benchmarks.module_map`` writes the page; a test finds it current. Folders are in the order in which they may
import each other, as docs/architecture.md states it.
"""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from pathlib import Path

from benchmarks.text import render
from codegen.base.files import write_atomically

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "modules.md"
CODE = ROOT / "codegen"
_ORDER = re.compile(r"^A folder imports only those before it: (.*)\.$", re.MULTILINE)
_INSIDE = re.compile(r"^Inside `diagnosis/` likewise: (.*)\.$", re.MULTILINE)
_NAMES = re.compile(r"`(\w+)/`")


@dataclass(frozen=True)
class Folder:
    """A folder of the package.

    Attributes:
        name: below ``codegen/``, with a slash at its end.
        meaning: first sentence of its ``__init__.py``; "" where it has none.
        modules: (name of a file, first sentence of its docstring), by name.
    """

    name: str
    meaning: str
    modules: tuple[tuple[str, str], ...]


def first_sentence(text: str) -> str:
    """The first paragraph of a module's docstring, on one line; "" where it has none."""
    told = ast.get_docstring(ast.parse(text)) or ""
    return " ".join(told.split("\n\n")[0].split()).replace("``", "`")


def folder(path: Path) -> Folder:
    """A folder with the modules in it."""
    texts = {file.name: file.read_text(encoding="utf-8") for file in sorted(path.glob("*.py"))}
    told = {name: first_sentence(text) for name, text in texts.items()}
    meaning = told.pop("__init__.py", "")
    return Folder(f"{path.relative_to(CODE)}/", meaning, tuple(told.items()))


def folders() -> list[Folder]:
    """All folders with a module, in the order of imports; those inside a folder after it, by name."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    places = {}
    for line in (*_ORDER.findall(text), *_INSIDE.findall(text)):
        places |= {name: len(places) + k for k, name in enumerate(_NAMES.findall(line))}
    paths = {file.parent for file in CODE.rglob("*.py")} - {CODE}
    ordered = sorted(paths, key=lambda p: [(places.get(part, 0), part) for part in p.relative_to(CODE).parts])
    return [folder(path) for path in ordered]


def page() -> str:
    """The text of the page."""
    return render("modules.md.j2", folders=[one for one in folders() if one.modules])


if __name__ == "__main__":
    write_atomically(PAGE, page())
