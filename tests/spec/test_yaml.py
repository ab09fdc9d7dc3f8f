"""YAML: what is malformed, dangerous or no YAML file at all; and comments that survive a round trip."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.base.errors import BadInput
from codegen.base.input_files import LARGEST_TEXT
from codegen.spec import parse_spec, read_spec
from codegen.spec.yaml_text import changed_text, dump, load_mapping
from tests.expected_errors import matches

from .faults import GOOD

ROOT = Path(__file__).resolve().parents[2]


def told(text: str) -> BadInput:
    with pytest.raises(BadInput) as caught:
        parse_spec(text, Path("slider.yaml"))
    return caught.value


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("name: a\nname: b\n", 2, "SPEC005"),
        (GOOD.replace("value: 2,", "value: 2,05,"), 9, "SPEC004"),
        (GOOD.replace("value: 2,", "value: 2001-99-99,"), 9, "SPEC006 `2001-99-99`"),
        (GOOD.replace("value: 2,", "value: 2,5e-3,"), 9, "SPEC004"),
        (GOOD.replace("w: {unit: N}", "w: {unit: 0,5 N}"), 7, "SPEC004 `5 N`"),
        (GOOD.replace("  k: {", "  mass: {"), 13, "SPEC005"),
        ("name: [1, 2\nforce: 3\n", 1, "SPEC001"),
        ("inputs:\n  w: {unit: N\nforce: 3\n", 2, "SPEC001"),
        ("name: a\nforce 3\ncoordinates: b\n", 2, "SPEC001"),
        ("name: a\ninputs:\n  - a\n b: 3\n", 4, "SPEC001"),
        ("name: a\nobserver:\n  kind gcfo\n  velocity: measured\n", 3, "SPEC001 `kind` gcfo`"),
        ("name: a\nobserver:\n  kind gcfo # a note\n\n  # and another\n  velocity: measured\n", 3, "SPEC001 `kind`"),
        ("name a\nforce: 3\n", 1, "SPEC001 `name`"),
        ("name: a\np:\n  m: {value: 1e-400, unit: kg}\n", 3, "SPEC001 rounds to zero 1e-300"),
        ("name: a\np:\n  m: {value: -1e400, unit: kg}\n", 3, "SPEC001 infinity 1e300"),
        ("name: a\nparameters:\n  b  {value: 60, unit: N}\n", 3, "SPEC001 `b` {value: unit: N}`"),
        ("name: a\nsource: one: two\n", 2, 'SPEC001 `one: two` `source: "one: two"`'),
        ("c:\n  phi: velocity: om, unit: rad # so\n", 2, "SPEC001 `phi: {velocity: om, unit: rad}` braces"),
        ("c:\n  - phi: velocity: om\n", 2, "SPEC001 `phi: {velocity: om}` braces"),
        ("c:\n  phi:{velocity: om, unit: rad}\n", 2, "SPEC001 `phi:{` `phi: {velocity: om, unit: rad}`"),
        ("c:\n  phi: {velocity: om unit: rad}\n", 2, "SPEC001 `velocity: om, unit: …` comma"),
        ("c:\n  - {name: my rail law: coulomb, a: 5}\n", 2, "SPEC001 `name: my rail, law: …` comma"),
        ("c: [{a: 1 b: 2}]\n", 1, "SPEC001 `a: 1, b: …`"),
        ("a:\n  - {name: drum}, law: coulomb, a: 2}\n", 2, "SPEC001 `{name: drum, law: coulomb, a: 2}`"),
        ("a:\n  - {name: drum}, law: coulomb # so\n", 2, "SPEC001 `{name: drum, law: coulomb}`"),
        ("p:\n  m: {value: 6}, unit: kg\n", 2, "SPEC001 `{value: 6, unit: kg}`"),
        ("name:winch\nforce: 3\n", 1, "SPEC001 `name:winch` `name: winch`"),
        ("name = winch\nforce: 3\n", 1, "SPEC001 `name` `name: winch`"),
        ("o:\n  kind: cfo\n   velocity: measured\n", 3, "SPEC001"),
        ("a:\n  force\n  c: d\n", 2, "SPEC001 `force` `key: value`"),
        ("a: b\n<<<<<<< HEAD\nc: d\n", 2, "SPEC001 HEAD `key: value`"),
        ("name: @winch\n", 1, 'SPEC001 `@winch` quotes `"@winch"`'),
        ("c: {phi: %axis, x: b}\n", 1, 'SPEC001 `%axis` quotes `"%axis"`'),
        ("name: `winch`\n", 1, "SPEC001 backquote quotes 'winch'"),
        ("force:\n  - *u - m*g\n", 2, 'SPEC001 `*u - m*g` alias `"*u - m*g"`'),
        ("force: [*u - m*g]\n", 1, "SPEC002 `*u` quotes"),
        ("force: - u\nname: a\n", 1, "SPEC001 `- u` `force: [u]`"),
        ("source: 'it's'\n", 1, "SPEC001 `s'` quotes"),
        ("a: [1, 2]]\nb: 3\n", 1, "SPEC001 `]` brackets"),
        ("a: }\n", 1, "SPEC001 `}` `{`"),
        ("a:\n  - {name: x}\n  b: c\n", 3, "SPEC001 indentation"),
        ("  a: b\nc: d\n", 2, "SPEC001 indentation"),
        ("c: {a: 1; b: 2}\n", 1, "SPEC001 comma `a: 1, b: …`"),
        (GOOD.replace("velocity: v,", "velocity v,"), 4, "SPEC004 `velocity v`"),
        (GOOD.replace("value: 2,", "value:2,"), 9, "SPEC004 `value:2`"),
        ("name: a\n\tforce: 3\n", 2, ""),
        ("force: 3\nname: 'a\n", 2, ""),
        ("- a\n- b\n", 1, "SPEC006"),
        ("just words\n", 1, ""),
        ("", 1, "SPEC006"),
        ("# only a comment\n", 1, "SPEC006"),
        ("---\nname: a\n---\nname: b\n", 3, ""),
        ("name: \x07\n", None, ""),
        ("%YAML 9.9\n---\nname: a\n", None, ""),
    ],
)
def test_malformed(text: str, line: int | None, words: str) -> None:
    error = told(text)
    assert matches(error, words)
    assert line is None or error.place.line == line


def test_tags_build_nothing(tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    for tag in ("!!python/object/apply:os.mkdir", "!!python/object/apply:os.system"):
        told(f"name: {tag} ['{trace}']\n")
        told(GOOD.replace("name: slider", f"name: {tag} ['{trace}']"))
        told(GOOD.replace("value: 2,", f"value: {tag} ['{trace}'],"))
    assert not trace.exists()


def test_files_that_are_none(tmp_path: Path) -> None:
    cases = {"latin.yaml": GOOD.encode().replace(b"a test", b"\xe9t\xe9"), "empty.yaml": b"", "nul.yaml": b"\x00\x01"}
    cases["huge.yaml"] = b"#" * (LARGEST_TEXT + 1)
    for name, data in cases.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(BadInput, match=name):
            read_spec(tmp_path / name)
    for path in (tmp_path, tmp_path / "absent.yaml"):
        with pytest.raises(BadInput, match=path.name):
            read_spec(path)


def test_the_hash_is_of_the_bytes(tmp_path: Path) -> None:
    import hashlib

    for data in (GOOD.encode(), GOOD.replace("\n", "\r\n").encode()):
        (tmp_path / "a.yaml").write_bytes(data)
        assert read_spec(tmp_path / "a.yaml").sha256 == hashlib.sha256(data).hexdigest()


@pytest.mark.parametrize("path", sorted((ROOT / "specs").glob("*.yaml")), ids=lambda p: p.stem)
def test_a_round_trip_keeps_every_comment_and_every_value(path: Path) -> None:
    text = path.read_text()
    document, _ = load_mapping(text, path.name)
    written = dump(document)
    comments = [line.split("#", 1)[1].strip() for line in text.splitlines() if "#" in line]
    assert [line.split("#", 1)[1].strip() for line in written.splitlines() if "#" in line] == comments
    before, after = parse_spec(text, path), parse_spec(written, path)
    for part in ("parameters", "mass_matrix", "force", "distribution", "contacts", "observer", "envelope"):
        assert getattr(before, part) == getattr(after, part)
    assert dump(load_mapping(written, path.name)[0]) == written


def test_the_unit_one_may_be_a_number() -> None:
    """YAML reads `unit: 1` as a number; the tool's own tables print it so."""
    text = GOOD.replace("w - k*x", "ratio*w - k*x", 1).replace("  J: {", "  ratio: {value: 2UNIT}\n  J: {", 1)
    said, left = (parse_spec(text.replace("UNIT", unit), Path("a.yaml")) for unit in (", unit: 1", ""))
    assert said.parameters == left.parameters
    assert "expected text" in str(told(text.replace("UNIT", ", unit: 2")))


def test_a_changed_text_has_only_the_changed_lines() -> None:
    """The dumper writes -0.5e-6 as -5.0e-7 and aligns nothing; neither is a change of the author's."""
    lines = ["m:  {value: 20, unit: kg}", "n: 1", "z_noise: [-0.5e-6,  0.5e-6] # half a step", "w: +3.50", "s: 'v1.10'"]
    document, _ = load_mapping("\n".join(lines) + "\n", "spec.yaml")
    document["n"] = 2
    changed = changed_text("\n".join(lines) + "\n", document).splitlines()
    assert changed == [lines[0], "n: 2", *lines[2:]]
    document["z_noise"][0] = -0.5e-7
    changed = changed_text("\n".join(lines) + "\n", document).splitlines()
    assert changed[2] != lines[2] and [*changed[:2], *changed[3:]] == [lines[0], "n: 2", *lines[3:]]


@pytest.mark.parametrize("value", ["[-1, 1]", "1"], ids=["list", "scalar"])
def test_the_comment_of_a_range_is_kept_once(value: str) -> None:
    document, _ = load_mapping(f"envelope:\n  v1..3: {value}  # of each\n  w: 2\n", "spec.yaml")
    written = dump(document)
    assert written.count("# of each") == 1 and written.count(f"v3: {value}") == 1


def test_half_a_character_is_explained() -> None:
    """``"\\uD800"`` was answered by pydantic's own words."""
    text = 'name: "\\uD800"\n' + "\n".join(line for line in GOOD.split("\n") if not line.startswith("name:"))
    assert "expected text without half a pair of surrogates" in str(told(text))
    assert "Input should" not in str(told(text))
