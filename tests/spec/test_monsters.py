"""Small YAML files that would take a reader minutes or gigabytes, and what is quoted of large ones."""

from __future__ import annotations

import sys
from pathlib import Path
from time import process_time
from types import FrameType

import pytest

from codegen.base.errors import LONGEST_PART, BadInput, Place
from codegen.base.input_files import LARGEST_TEXT
from codegen.spec import parse_spec
from codegen.spec.yaml_limits import DEEPEST, MOST_NODES
from codegen.spec.yaml_text import load_mapping
from tests.expected_errors import matches, refused

MONSTERS = {
    "keys in keys": ("? " * 25 + "a", 1, "SPEC006"),
    "braces": ("{" * 24 + "a" + "}" * 24, 1, "SPEC006"),
    "a list as a key": ("a: 1\n? [b]\n: c\n", 2, "SPEC006"),
    "an anchor": ("a: 1\nb: &a c\n", 2, "SPEC002 `&a`"),
    "a merge key": ("a: 1\nb: {<<: {c: 1}, d: 2}\n", 2, "SPEC002 `<<`"),
    "an alias": ("a: 1\nb: *u\n", 2, "SPEC002 `*u` quotes"),
    "one number written twice": ("0x1: [a]\n1: [b]\n", 2, "SPEC001"),
    "a number and its text": ("1: a\n'1': b\n", 2, "SPEC005"),
    "deep lists": ("- " * 500 + "a", 1, f"SPEC002 {DEEPEST}"),
    "deep brackets": ("a: " + "[" * 500, 1, f"SPEC002 {DEEPEST}"),
    "deep keys": ("\n".join(" " * k + "a:" for k in range(500)), DEEPEST + 1, f"SPEC002 {DEEPEST}"),
    "a long key": ("a" * 500 + ": 1\n", 1, "SPEC002 500"),
    "ranges of lists": ("x1..10000: [" + "a, " * 20 + "]\n", 1, "SPEC002"),
    "digits": ("a: [1,\n " + "9" * 5000 + "]\n", 2, "SPEC002"),
    "hexadecimal digits": ("a: [1,\n 0x" + "f" * 3900 + "]\n", 2, "SPEC002"),
    "digits with underscores": ("a: " + "9_" * 4500 + "9\n", 1, "SPEC002"),
    "an object of Python": ("a: b\nc: !!python/object/apply:os.system [ls]\n", 2, "SPEC002 `!!python/object"),
    "a tag that changes a mapping": ("a: !!str\n  b: c\n", 1, "SPEC002 `!!str`"),
    "the YAML in which 017 is fifteen": ("%YAML 1.1\n---\na: 017\n", 2, "SPEC001 1.1"),
    "a zero byte": ("a: b\nc: d\0\n", 2, "SPEC001 U+0000"),
    "a character beyond Unicode": ('a: b\nc: "\\UFFFFFFFF"\n', 2, "SPEC001"),
}


@pytest.mark.parametrize("monster", MONSTERS)
def test_is_refused_in_few_words(monster):
    text, line, words = MONSTERS[monster]
    with pytest.raises(BadInput) as told:
        load_mapping(text, "s.yaml")
    assert told.value.place == Place("s.yaml", line) and matches(told.value, words) and len(str(told.value)) < 300


def test_a_message_quotes_at_most_200_characters():
    long = "a" * 10**6
    for parts in (
        (Place("s.yaml", 1), f"`{long}` and {long}", "b"),
        (Place("s.yaml", 1), "found", "b", long),
        (Place(long, 1, long), "found", "b"),
        (long, "found", long),
    ):
        message = str(BadInput(*parts))
        runs = [len(word) for word in message.replace("'", " ").replace("`", " ").split()]
        assert max(runs) <= LONGEST_PART * 3 and len(message) <= 1200 and "…" in message
    assert len(str(BadInput("s.yaml", f"the key `{long}`", "b"))) < 200


def test_a_message_is_one_printable_line():
    message = str(BadInput("a\udcff\n.yaml", "b\x1b[31m\x00\u202e", "c\td"))
    assert message == r"a\xff .yaml: b\x1b[31m\x00\u202e; expected c d"


@pytest.mark.parametrize("name", ["con", "AUX", "nul", "Com1", "lpt9"])
def test_a_machine_is_no_device_of_windows(name: str) -> None:
    with refused(f"SPEC009 `{name}` {name}_axis"):
        shipped = (Path(__file__).parents[2] / "specs" / "one_mass.yaml").read_text()
        parse_spec(shipped.replace("name: one_mass", f"name: {name}"), Path("m.yaml"))


SLOWEST = {
    "items": lambda size, values: "a: [" + "1," * (values - 3) + "1]",
    "keys": lambda size, values: "".join(f"k{k}: 1\n" for k in range(values // 2)),
    "comments": lambda size, values: "a: 1\n" + "# x\n" * (size // 4),
    "empty lines": lambda size, values: "a: 1\n" + "\n" * size,
    "words": lambda size, values: "a: " + "x " * (size // 2),
    "lines of text": lambda size, values: "a: x\n" + "  y\n" * (size // 4),
    "escapes": lambda size, values: 'a: "' + "\\x41" * (size // 4) + '"',
}


def calls(text: str) -> int:
    """How many functions run while the text is read: what its time grows with, and the same on every machine."""
    count = 0

    def counted(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(counted)
    try:
        load_mapping(text, "a.yaml")
    finally:
        sys.setprofile(before)
    return count


@pytest.mark.parametrize("case", SLOWEST)
def test_reading_takes_work_in_proportion_to_size(case: str) -> None:
    """Twice the text, at most two and a half times the calls: a square would be four times."""
    short, long = (calls(SLOWEST[case](LARGEST_TEXT // part, MOST_NODES // part)) for part in (200, 100))
    assert long < 2.5 * short


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("a: [" + "1," * (MOST_NODES - 3) + "1]", id="values in one line"),
        pytest.param("".join(f"k{k}: 1\n" for k in range(MOST_NODES // 2 - 2)), id="unknown keys"),
        pytest.param("#" * LARGEST_TEXT, id="a comment"),
        pytest.param("\n" * LARGEST_TEXT, id="empty lines"),
    ],
)
def test_the_largest_spec_is_refused_in_seconds(text: str) -> None:
    """Work within one call of a library, which the test above does not count; the first two took minutes."""
    begun = process_time()
    with pytest.raises(BadInput):
        parse_spec(text, Path("s.yaml"))
    assert process_time() - begun < 12
