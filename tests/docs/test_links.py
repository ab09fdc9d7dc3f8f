"""Links between the pages lead somewhere, and the index names every page."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(
    [*ROOT.glob("*.md"), *DOCS.glob("*.md"), *(DOCS / "how-to").glob("*.md"), DOCS / "gallery" / "README.md"]
)
FOREIGN = {"spike.py"}
"""Python files of others that pages name."""
_LINK = re.compile(r"\]\(([^)\s]+)\)")
_MODULE = re.compile(r"`((?:[a-z_0-9]+/)*[a-z_0-9]+\.py)`")
_CODE = re.compile(r"^```.*?^```|`[^`\n]*`", re.MULTILINE | re.DOTALL)


def anchors(page: Path) -> set[str]:
    """The anchors that GitHub gives to the headings of a page."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(page: Path) -> None:
    for link in _LINK.findall(_CODE.sub("", page.read_text(encoding="utf-8"))):
        if link.startswith(("http://", "https://", "mailto:")):
            continue
        file, _, anchor = link.partition("#")
        target = (page.parent / file) if file else page
        assert target.exists(), f"{page.name}: {link}"
        assert not anchor or anchor in anchors(target), f"{page.name}: {link}"


def test_the_index_names_every_page() -> None:
    named = {(DOCS / link).resolve() for link in _LINK.findall((DOCS / "README.md").read_text(encoding="utf-8"))}
    assert set(PAGES) - {DOCS / "README.md", *ROOT.glob("*.md")} <= named


def test_the_pages_name_python_files_that_exist() -> None:
    """CONTRIBUTING.md sent a reader to observers/kind.py after that file was gone."""
    files = [*ROOT.glob("*.py"), *(f for top in ("codegen", "tests", "benchmarks") for f in (ROOT / top).rglob("*.py"))]
    here = [f"/{file.relative_to(ROOT).as_posix()}" for file in files]
    named = {(page.name, name) for page in PAGES for name in _MODULE.findall(page.read_text(encoding="utf-8"))}
    unknown = {name for _, name in named if not any(file.endswith(f"/{name}") for file in here)}
    assert len(named) > 50 and unknown <= FOREIGN, sorted(unknown)
