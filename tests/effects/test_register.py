"""Effects of a user's own: what is run, and what is refused."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import stiction
from codegen.base.errors import BadInput
from codegen.effects import CATALOGUE
from codegen.effects.declare import system_of
from codegen.effects.register import candidates, load_effects, twins_of
from codegen.spec import read_spec
from codegen.spec.reader import parse_spec

SPEC = Path(__file__).parents[2] / "specs/one_mass.yaml"
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


TWINS = """
from codegen.effects.on_contact import CoulombAsymmetry
from codegen.effects.on_coordinate import Offset
class OwnAsymmetry(CoulombAsymmetry):
    kind = "own_asymmetry"
class OwnOffset(Offset):
    kind = "own_offset"
EFFECTS = [OwnAsymmetry(), OwnOffset()]
"""


def test_an_effect_under_another_name_is_tried_and_told_where_its_parent_was(tmp_path: Path) -> None:
    """Of effects with the same motion the first candidate is named, so the order must not depend on the name."""
    system = system_of(read_spec(SPEC))
    before = [(effect.kind, place) for effect, place in candidates(system)]
    contact, coordinate = system.contacts[0].name, system.positions[0].name
    assert twins_of(CATALOGUE["offset"], system, 0) == [("coulomb_asymmetry", contact)]
    own = {"offset": "own_offset", "coulomb_asymmetry": "own_asymmetry"}
    load_effects(write(tmp_path, TWINS))
    after = [(effect.kind, place) for effect, place in candidates(system)]
    assert after == [(own.get(kind, kind), place) for kind, place in before]
    assert twins_of(CATALOGUE["own_offset"], system, 0) == [("own_asymmetry", contact)]
    assert twins_of(CATALOGUE["own_asymmetry"], system, 0) == [("own_offset", coordinate)]


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


OWN = """
from codegen.effects import Confusion, Effect, EffectParameter
class Pull(Effect):
    kind, sits_on, equation, seen_over = "pull", "coordinate", "e = −p·x", "position"
    signature = "a pull to the middle"
    parameters = (EffectParameter("p", "{F}/{q}", "stiffness", neutral=0.0),)
    confused_with = (Confusion("spring", "a wider range"),)
    def add(self, system, place, p):
        return system.with_force(place, -p["p"] * system.position[place])
EFFECTS = [Pull()]
"""


def test_an_effect_without_an_attribute_is_refused_with_its_name(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="an effect `pull` without `confused_with`"):
        load_effects(write(tmp_path, OWN.replace("    confused_with", "    confused")))


def test_an_error_in_an_effect_of_ones_own_is_told_with_its_line(tmp_path: Path) -> None:
    """It is a fault of the file, not of stiction."""
    path = write(tmp_path, OWN)
    load_effects(path)
    spec = tmp_path / "spec.yaml"
    spec.write_text(
        SPEC.read_text("utf-8").replace("effects: []", "effects: [{kind: pull, on: x, parameters: {p: 3}}]"), "utf-8"
    )
    with pytest.raises(BadInput) as told:
        stiction.load(spec).certify()
    assert told.value.code == "EFFECT001"
    assert str(told.value.place) == f"{path}:9"
    assert "AttributeError: 'System' object has no attribute 'position'" in told.value.found


def test_numbers_with_which_an_effect_cannot_be_added_are_told_at_the_spec(monkeypatch: pytest.MonkeyPatch) -> None:
    """`init` from a robot file with joint damping ended in "internal error"."""

    def fails(*_: object) -> None:
        raise ZeroDivisionError("injected")

    text = SPEC.read_text("utf-8").replace("effects: []", "effects: [{kind: offset, on: x, parameters: {f0: 1}}]")
    spec = parse_spec(text, SPEC)
    monkeypatch.setattr("codegen.effects.declare._add", fails)
    with pytest.raises(BadInput, match="the declared effects cannot be computed") as raised:
        system_of(spec)
    assert raised.value.place.file == str(SPEC)
