"""Effects of a user's own: what is run, and what is refused."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from codegen.base.errors import BadInput
from codegen.effects import CATALOGUE
from codegen.effects.register import load_effects

MINE = """
from codegen.effects.on_coordinate import Spring
class Mine(Spring):
    kind = "{kind}"
EFFECTS = [Mine()]
"""


@pytest.fixture(autouse=True)
def _catalogue_as_it_was() -> Iterator[None]:
    before = dict(CATALOGUE)
    yield
    CATALOGUE.clear()
    CATALOGUE.update(before)


def write(folder: Path, text: str) -> Path:
    path = folder / "mine.py"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_of_effects_extends_the_catalogue(tmp_path: Path) -> None:
    path = write(tmp_path, MINE.format(kind="my_spring"))
    assert load_effects(path) == ("my_spring",) == load_effects(path)
    assert CATALOGUE["my_spring"].equation == CATALOGUE["spring"].equation


REFUSED = {
    "a kind that is taken": (MINE.format(kind="viscous"), "a second effect `viscous`"),
    "no list": ("x = 1", "no list `EFFECTS`"),
    "no effects in it": ("EFFECTS = [1]", "no list `EFFECTS`"),
    "not Python": ("EFFECTS = [", "SyntaxError"),
    "an import that is missing": ("import no_such_module_at_all", "ModuleNotFoundError"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str, tmp_path: Path) -> None:
    text, found = REFUSED[case]
    before = dict(CATALOGUE)
    with pytest.raises(BadInput) as told:
        load_effects(write(tmp_path, text))
    assert found in told.value.found
    assert before == CATALOGUE
