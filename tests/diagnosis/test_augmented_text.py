"""The augmented spec of unusual YAML: nothing but the replaced numbers changes, and no comment is lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnosis.results import FoundEffect
from codegen.diagnosis.verdict.augment import augmented_text
from codegen.effects.declare import system_of
from codegen.spec.reader import parse_spec

HEAD = """name: stage
coordinates: {x: {velocity: v, unit: m}, y: {velocity: vy, unit: m}}
inputs: {w: {unit: N}}
mass_matrix: [[m, 0], [0, m2]]
force: [w, -k*y]
"""
PARAMETERS = """parameters:
  m: {value: 10, unit: kg, tolerance: 1%}
  m2: {value: 3, unit: kg}
  k: {value: 100, unit: N/m}
"""
CONTACTS = """friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: rail, law: coulomb, a: 4.0, unit: N}
    - {name: other, law: coulomb, a: 4.0, unit: N}
"""
EFFECTS = """effects:
  - {kind: viscous, on: rail, parameters: {b: 6}}
  - {kind: viscous, on: other, parameters: {b: 6}}
"""
REFITTED = {"m": 11.0, "rail_a": 4.5, "viscous_rail_b": 8.0}


def written(text: str, adds: bool = False) -> tuple[str, dict[str, float], dict[str, float]]:
    """The augmented text, and the values of the system before and after; ``adds``: 1.5 N·s/m were found on the rail."""
    spec = parse_spec(text, Path("stage.yaml"))
    system = system_of(spec)
    before = {s.name: float(v) for s, v in system.values.items()}
    parameters = {"b": 1.5}
    found = FoundEffect("viscous", "rail", parameters, {"b": "N*s/m"}, {"b": (1.4, 1.6)})
    after = augmented_text(spec, [found] if adds else [], {k: v for k, v in REFITTED.items() if k in before}, system)
    read = system_of(parse_spec(after, Path("stage.yaml"))).values
    return after, before, {s.name: float(v) for s, v in read.items()}


@pytest.mark.parametrize("adds", [False, True])
def test_only_the_refitted_entries_change(adds: bool) -> None:
    """The other contact and its effect, written with the same numbers, keep them."""
    _, before, after = written(HEAD + PARAMETERS + CONTACTS + EFFECTS, adds)
    assert after == pytest.approx(before | REFITTED | ({"viscous_rail_b": 9.5} if adds else {}))


@pytest.mark.parametrize("number", ['"4\\nN"', '"4\\u2028N"', '"4\\N N"', "|\n        4.0", ">-\n        4\n        N"])
def test_an_old_value_on_several_lines_is_noted_on_one(number: str) -> None:
    """Its line break ended the comment, and the diagnosis of an hour ended in a fault of the spec."""
    block = f"    - name: rail\n      law: coulomb\n      a: {number}\n      unit: N\n"
    contacts = CONTACTS.replace("    - {name: rail, law: coulomb, a: 4.0, unit: N}\n", block)
    text, before, after = written(HEAD + PARAMETERS + contacts + EFFECTS)
    assert after == pytest.approx(before | REFITTED)
    assert sum("a refitted by diagnosis, was 4" in line for line in text.splitlines()) == 1


@pytest.mark.parametrize("adds", [False, True])
@pytest.mark.parametrize(
    ("effects", "comments"),
    [
        (
            """effects: [
    {kind: viscous, on: rail, parameters: {b: 6}}, # one
    {kind: viscous, on: other, # two
     parameters: {b: 6}}  # three
  ] # four
""",
            ["# one", "# two", "# three", "# four"],
        ),
        (EFFECTS + "...\n# after the document\n", ["# after the document"]),
    ],
)
def test_comments_that_the_yaml_library_drops_are_kept(effects: str, comments: list[str], adds: bool) -> None:
    text, _, _ = written(HEAD + PARAMETERS + CONTACTS + effects, adds)
    assert [comment for comment in comments if comment not in text] == []


def test_the_comment_of_a_range_is_kept_where_the_range_is_written_out() -> None:
    parameters = PARAMETERS + "  c1..2: {value: 6, unit: N*s/m, tolerance: 10%} # both dampers\n"
    effects = "effects:\n  # of the next\n  - {kind: viscous, on: [rail], parameters: {b: 6}} # a guide\n"
    text, before, after = written(HEAD.replace("-k*y", "-k*y - (c1 + c2)*vy") + parameters + CONTACTS + effects)
    assert after == pytest.approx(before | REFITTED)
    assert all(words in text for words in ("# both dampers", "# of the next", "# a guide"))
    contacts = "    - {name: r1..2, law: coulomb, a: 4.0, unit: N} # both rails\n"
    contacts = CONTACTS.split("    - ")[0] + contacts
    text, before, after = written(HEAD + PARAMETERS + contacts)
    assert after == pytest.approx(before | {"m": 11.0}) and "# both rails" in text
