"""Text of a user in generated files: their tokens do not depend on it, whatever it holds, in every language."""

from __future__ import annotations

import itertools
import json
import os
import subprocess
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from codegen.app.smt_lib import smt_text
from codegen.base.errors import BadInput, Place
from codegen.base.text import environment, language_of, render
from codegen.base.user_text import PRINTED, REPLACEMENT, UserText, c_text, file_text, line_text, terminal_text
from codegen.diagnosis.results import Candidate, Diagnosis, FoundEffect
from codegen.emit import PRINTERS
from codegen.emit.fmu import Variable
from codegen.emit.header import Header, make_header
from codegen.emit.package import emit_manifest, emit_readme
from codegen.observers import observer_of
from codegen.program import build_program
from codegen.program.lower import lower
from codegen.report.evidence import LawEvidence
from codegen.report.page import rendered
from codegen.report.pictures import Panel
from codegen.spec import parse_spec
from codegen.spec.units import parse_unit
from tests.slow_cases import examples

from .lexers import LEXERS, c, cmake, html, make, smt, xml

ROOT = Path(__file__).parents[2]
ONE = (ROOT / "specs" / "one_mass.yaml").read_text(encoding="utf-8")
SPEC = parse_spec(ONE, Path("s.yaml"))
PROGRAM = build_program(observer_of(SPEC))
CODE = lower(PROGRAM)
PLAIN = "a book"
FRAGMENTS = (
    *(
        "*/",
        "/*",
        "//",
        "*",
        "/",
        "\\",
        "\n",
        "\r",
        "\r\n",
        "\\\n",
        "\\ \n",
        "??/",
        "??/\n",
        "?",
        "\t",
        "\v",
        "\f",
        "\x00",
    ),
    *(
        '"',
        "'",
        '"""',
        "'''",
        "`",
        "```",
        "$(shell touch x)",
        "${X}",
        "$",
        "#",
        "[[",
        "]]",
        "#[[",
        "]=]",
        "(",
        ")",
        ";",
    ),
    *(
        "<script>alert(1)</script>",
        "</style>",
        "<!--",
        "-->",
        "]]>",
        "<![CDATA[",
        "&lt;",
        "&",
        "<",
        ">",
        "|",
        "%}",
        "{{ 1 }}",
    ),
    *(
        "\x85",
        "\u2028",
        "\u202e",
        "\u2066",
        "\ud800",
        "\udcff",
        "\ufffe",
        "\x1b[31m",
        "\u1fef",
        "\u037e",
        "\u3164",
        "＂＊／",
    ),
    *(
        "int x;",
        "import os",
        "# -*- coding: utf-7 -*-",
        "+ACI-",
        "all:\n\ttouch x",
        "(check-sat)",
        "\\u002a\\u002f",
        "- ",
        "|-|",
    ),
    *("é", "λ", "–", "漢", "א", "e\u0301", "ﬁ", "²", "a", "B", " ", "7", ".", "[x](y)", "**b**", "javascript:"),
)
TEXTS = st.lists(st.sampled_from(FRAGMENTS) | st.text(max_size=4), max_size=8).map("".join)
WORST = [
    *("".join(pair) for pair in itertools.product(("*", "/", "?", "??", "\\", '"', "x"), FRAGMENTS)),
    *FRAGMENTS,
    "*\\\n/ int x; /\\\n*",
    "*??/\n/ int x; /??/\n*",
    '"""; import os; """',
]


def header(text: str) -> Header:
    """Every part of a header that is a user's, unreduced."""
    command = UserText(f"stiction generate {text}")
    return Header(UserText(text), "0" * 64, UserText(text), "1.0", command, (UserText(text), "0" * 64))


def files(text: str) -> dict[str, str]:
    """Every file that a spec gives, with this text wherever a user's can stand."""
    head = header(text)
    made = {name: content for printer in PRINTERS.values() for name, content in printer(PROGRAM, CODE, head).items()}
    readme = emit_readme(PROGRAM, head, "no reason", tuple(made))
    return {**made, "README.md": readme}


def streams(made: dict[str, str]) -> dict[str, list[str]]:
    return {name: LEXERS[Path(name).suffix](content) for name, content in made.items()}


@cache
def expected() -> dict[str, list[str]]:
    return streams(files(PLAIN))


@settings(max_examples=examples(40), deadline=None)
@example("*\\\n/ int x; /\\\n*")
@example('x"""; import os; """y.yaml')
@example("x\nexecute_process(COMMAND touch x)\n#")
@given(TEXTS)
def test_tokens_of_generated_files_do_not_depend_on_it(text: str) -> None:
    made = files(text)
    assert streams(made) == expected()
    for name, content in made.items():
        content.encode("utf-8")
        if name.endswith((".h", ".c")):
            assert c(content, trigraphs=True) == expected()[name]
    manifest = json.loads(emit_manifest(header(text), made))
    assert manifest["spec"]["file"] == text and set(manifest) == {"tool", "spec", "robot", "files", "sha256"}


def test_the_lexers_see_what_the_old_filter_let_through() -> None:
    """Each lexer tells text that leaves its comment from text that stays in it."""
    assert c("/* a *\\\n/ int x; /\\\n* */") == ["int", "x", ";"] == c("/* *??/\n/ int x; /??/\n* */", True)
    assert c("/* *??/\n/ int x; /??/\n* */") == [] and cmake("# x\nexecute_process(a)") != cmake("# x")
    assert make("# x\ny := 1") != make("# x") and cmake("#[[ x ]] y()") == ["y", "(", ")"]
    assert smt("; x\n(check-sat)") == ["(", "check-sat", ")"]
    with pytest.raises(AssertionError):
        c("/* a /* ")


@pytest.mark.parametrize("trigraphs", [(), ("-trigraphs",)])
def test_compilers_see_no_more_than_comments(tmp_path: Path, trigraphs: tuple[str, ...]) -> None:
    """The same by gcc's preprocessor, on comments in a row."""
    lines = [f"/* {c_text(text)} */ int a{k};" for k, text in enumerate(WORST)]
    (tmp_path / "x.c").write_text("\n".join(lines), encoding="utf-8")
    done = subprocess.run(
        ["gcc", "-E", "-P", "-Wall", "-Werror", *trigraphs, "x.c"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0 and done.stderr == "", done.stderr
    assert done.stdout.split() == [w for k in range(len(WORST)) for w in ("int", f"a{k};")]


def test_make_and_cmake_see_no_more_than_comments(tmp_path: Path) -> None:
    outer = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS"))}
    for language, end, command in (
        ("make", "all:; @echo end", ("make", "-f", "x")),
        ("cmake", 'message("end")', ("cmake", "-P", "x")),
    ):
        if language == "cmake" and subprocess.run(["which", "cmake"], capture_output=True, check=False).returncode:
            pytest.skip("there is no cmake here; `make toolchains` installs it")
        comments = "\n".join(f"# with: {PRINTED[language](text)}" for text in WORST)
        (tmp_path / "x").write_text(f"{comments}\n{end}\n", encoding="utf-8")
        done = subprocess.run(command, cwd=tmp_path, env=outer, capture_output=True, text=True, check=False)
        assert (done.returncode, (done.stdout + done.stderr).strip()) == (0, "end"), language


def test_python_sees_no_more_than_a_string() -> None:
    for quote in ('"""', "'''", '"', "'"):
        lines = [f"({quote}with: {line_text(text)}.{quote}, {k})" for k, text in enumerate(WORST)]
        assert [k for _, k in eval(f"[{','.join(lines)}]")] == list(range(len(WORST)))


@settings(max_examples=examples(60), deadline=None)
@given(TEXTS)
def test_tokens_of_xml_do_not_depend_on_it(text: str) -> None:
    """The description of an FMU: names, units and meanings."""

    def described(version: str, words: str) -> list[str]:
        roles = ("time", "parameter", "constant", "input", "output")
        variables = [Variable(k, words, words, words, role, "place", start="0") for k, role in enumerate(roles)]
        given = {
            "variables": variables,
            "units": {words: [("kg", 1)]},
            "period": "0.001",
            "generator": words,
            "sources": (),
        }
        return xml(render(f"fmu/model_description_{version}.xml.j2", program=PROGRAM, token=words, **given))

    for version in "23":
        assert described(version, f"a{text}") == described(version, PLAIN)


def filled(kind: Any, text: str) -> Any:
    """A value of a type of the report's view with this text wherever it holds text."""
    origin, inner = get_origin(kind), get_args(kind)
    if kind is str or kind is Any:
        return text
    if kind in (bool, int, float):
        return kind(1)
    if origin is Literal:
        return inner[0]
    if origin is np.ndarray:
        return np.zeros(1)
    if origin in (Union, UnionType):
        return filled(next(part for part in inner if part is not NoneType), text)
    if origin is tuple:
        return tuple(filled(part, text) for part in inner if part is not Ellipsis)
    if origin is Mapping:
        return {filled(inner[0], text): filled(inner[1], text)}
    assert is_dataclass(kind), kind
    hints = get_type_hints(kind)
    return kind(**{field.name: filled(hints[field.name], text) for field in fields(kind)})


def report(text: str) -> str:
    """A report with this text wherever it holds text."""
    figures = ("train_samples", "held_out_seconds", "sample_time_s", "cutoff_hz", "restart_s", "segments")
    coordinate = {"name": text, "force_unit": text}
    data = dict.fromkeys(("train", "test", "forces_compared_with"), text)
    data |= {"coordinates": [coordinate], **dict.fromkeys(figures, 1)}
    row = {"candidate": filled(Candidate, text), "parameters": [text], "outcome": "passed", "why_not": text, "bar": 1}
    pictures = {
        "coordinates": [(text, (Panel(text, text),))] * 2,
        "legend": [(text, text)],
        "same": True,
        "thinned": text,
    }
    effect = {"found": filled(FoundEffect, text), "equation": text, "signature": text, "meanings": {text: text}}
    page = {
        **dict.fromkeys(("name", "source", "spec_file", "spec_hash", "version", "leader"), text),
        "errors": [{"quantity": "force", "coordinate": text, "unit": text, "shown": [text], "change": text}],
        "published": [(text, text)],
        "effects": [effect],
        "laws": [(filled(LawEvidence, text), (Panel(text, text),))],
        "pictures": pictures,
        "rounds": [{"found_before": [text], "rows": [row], "exchanged": exchanged} for exchanged in (False, True)],
        "findings": [(text, text, ((text, text),))],
        "difference": [(text, text)],
        "observer_declared": True,
        "files": [(text, text)],
    }
    return rendered(page, replace(filled(Diagnosis, text), data=data))


@settings(max_examples=25, deadline=None)
@example("</style><script>")
@given(TEXTS)
def test_tokens_of_the_report_do_not_depend_on_it(text: str) -> None:
    page = report(f"a{text}")
    page.encode("utf-8")
    assert html(page) == html(report("a"))


@pytest.mark.parametrize(
    "sign",
    [
        "\u200b",
        "\u200d",
        "\u2060",
        "\ufeff",
        "\xad",
        "\u202e",
        "\u2066",
        "\u2028",
        "\u3164",
        "\ufe0f",
        "\u2800",
        "\U000e0041",
    ],
    ids=lambda sign: f"U+{ord(sign):04X}",
)
def test_the_report_shows_where_a_name_has_an_invisible_character(sign: str) -> None:
    """Two names that look alike, or a name in another order than it is read, would mislead."""
    page = report(f"a{sign}b")
    assert sign not in page and "a\N{REPLACEMENT CHARACTER}b" in page
    assert "naïve λ 漢 א é" in report("naïve λ 漢 א é")


@settings(max_examples=examples(60), deadline=None)
@given(TEXTS)
def test_tokens_of_smt_lib_do_not_depend_on_it(text: str) -> None:
    content = json.loads((ROOT / "generated" / "one_mass" / "certificate.json").read_text(encoding="utf-8"))
    said = {**content, "claim": text, "subject": {**content["subject"], "name": text}}
    assert smt(smt_text(said)) == smt(smt_text(content))


@given(TEXTS)
def test_a_screen_gets_printable_lines(text: str) -> None:
    shown = terminal_text(text)
    assert all(line.replace("\xa0", "").replace("\t", "").isprintable() for line in shown.split("\n"))
    assert shown == text or not text.isprintable()


@given(TEXTS)
def test_a_file_name_is_reduced_or_refused(text: str) -> None:
    try:
        name = file_text(text)
    except BadInput as error:
        assert str(error).isprintable()
        return
    assert all(sign.isalnum() or sign in "_.-+" for sign in name)
    assert make_header(text, "", "").spec_file.raw == name


@settings(max_examples=examples(80), deadline=None)
@given(TEXTS, st.sampled_from(["name", "coordinate", "velocity", "input", "parameter", "contact"]))
def test_names_are_ascii_identifiers_or_refused(text: str, of: str) -> None:
    """So no name is another one after Python has normalised it, and none holds a sign of any language."""
    word = json.dumps(f"a{text}", ensure_ascii=True)
    old = {
        "name": "name: one_mass",
        "coordinate": "  x: {velocity",
        "velocity": "velocity: v,",
        "input": "  w: {unit",
        "parameter": "  m: {value",
        "contact": "name: rail",
    }[of]
    marks = {"name": "one_mass", "coordinate": "x", "velocity": "v,", "input": "w", "parameter": "m", "contact": "rail"}
    at = old.rindex(marks[of]) if of != "coordinate" else 2
    new = old[:at] + word + old[at + len(marks[of].rstrip(",")) :]
    if of in ("coordinate", "input", "parameter"):
        new = f"  ? {word}\n  : {{{old.split('{')[1]}"
    try:
        spec = parse_spec(ONE.replace(old, new, 1), Path("s.yaml"))
    except BadInput:
        return
    names = [spec.name, *(c.name for c in spec.coordinates), *(c.velocity for c in spec.coordinates)]
    names += [n.name for part in (spec.inputs, spec.parameters, spec.contacts) for n in part]
    assert all(name.isascii() and name.isidentifier() for name in names), names


UNIT_SIGNS = st.lists(
    st.sampled_from([*"*/^() .-_12", "m", "kg", "s", "µ", "Ω", "²", "N", "**", *FRAGMENTS]), max_size=6
)


@settings(max_examples=examples(200), deadline=None)
@given(UNIT_SIGNS.map("".join))
def test_units_are_printed_as_they_are_or_refused(text: str) -> None:
    try:
        parse_unit(text, Place("s.yaml"))
    except BadInput:
        return
    assert c_text(f"({text})") == f"({text})" == line_text(f"({text})")


def test_a_template_cannot_print_it_as_it_stands() -> None:
    """Joined to other text it raises, and so does a language that has no function for it."""
    text = UserText("x")
    for language in ("c", "python", "cmake", "make", "markdown", "html", "smt", "words"):
        for template in ('{{ "a" ~ text }}', "{{ text | upper }}", "{{ text | string }}", '{{ "%s" | format(text) }}'):
            with pytest.raises(TypeError):
                environment(language).from_string(template).render(text=text)
    for name in ("text/derive.tex.j2", "text/claim.j2", "text/assumptions.j2"):
        with pytest.raises(TypeError, match=f"the language `{language_of(name)}` .* PRINTED .* LANGUAGES"):
            environment(language_of(name)).from_string("{{ text }}").render(text=text)
    with pytest.raises(TypeError):
        environment("c").from_string("{{ name }}").render(name="a\x1b")
    assert repr([text]) == "[UserText(1 characters)]"


def test_what_is_harmless_stays() -> None:
    harmless = "Müller–Ohlsson 1994, §3.2 (λ ≈ 2·10³): N*m/rad, ½ & 50 %, see [7] on a_b + c; why?"
    kept = harmless.replace("≈", REPLACEMENT)
    assert c_text(harmless) == line_text(harmless) == kept
    assert c_text('Coulomb\'s "law" a/b */ c ?? d\\e\n f') == f"Coulomb’s ”law” a/b * / c ? ? d{REPLACEMENT}e  f"
    assert file_text("two_mass-2.yaml") == "two_mass-2.yaml" and file_text("\udcff x.yaml") == "__x.yaml"
