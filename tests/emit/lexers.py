"""Lexers: the tokens of a file without comments, by its language's manual; a comment without an end raises."""

from __future__ import annotations

import io
import re
import tokenize
from collections.abc import Callable
from itertools import pairwise

import html5lib
from lxml import etree
from markdown_it import MarkdownIt

TRIGRAPHS = {"=": "#", "(": "[", "/": "\\", ")": "]", "'": "^", "<": "{", "!": "|", ">": "}", "-": "~"}
C_TOKENS = (
    r'(?P<comment>/\*.*?\*/|//[^\n]*)|(?P<token>"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'|\w+|\n|[^\w\s"\'])|[^\S\n]+'
)
CMAKE_TOKENS = (
    r"(?P<comment>#\[(=*)\[.*?\]\2\]|#[^\n]*)|"
    r'(?P<token>\[(=*)\[.*?\]\4\]|"(?:\\.|[^"\\])*"|\n|[()]|(?:\\[^\n]|[^\s()#"\\])+)|[^\S\n]+'
)
SMT_TOKENS = r'(?P<comment>;[^\n\r]*)|(?P<token>"(?:[^"]|"")*"|\|[^|\\]*\||[()]|[^\s()";|]+)|\s+'


def _tokens(pattern: str, text: str) -> list[str]:
    found, at, reader = [], 0, re.compile(pattern, re.DOTALL)
    while at < len(text):
        match = reader.match(text, at)
        assert match is not None, f"no token at {text[at : at + 60]!r}"
        assert not match[0].startswith("/*") or len(match[0]) > 3
        if match["token"] is not None:
            found.append(match["token"])
        at = match.end()
    return found


def c(text: str, trigraphs: bool = False) -> list[str]:
    """After phases 1 to 3 of translation in C99; a backslash before blanks at a line's end joins too, as in GCC."""
    if trigraphs:
        text = re.sub(r"\?\?([=(/)'<!>-])", lambda found: TRIGRAPHS[found[1]], text)
    joined = re.sub(r"\\[ \t\v\f]*(\r\n|\n|\r)", "", text)
    found = _tokens(C_TOKENS, joined)
    assert ("/", "*") not in pairwise(found), "a comment without an end"
    return found


def python(text: str) -> list[str]:
    """By ``tokenize``, from bytes, so that a declared encoding counts; strings by their being there alone."""
    compile(text, "twin", "exec")
    kinds = (tokenize.COMMENT, tokenize.NL)
    found = [t for t in tokenize.tokenize(io.BytesIO(text.encode()).readline) if t.type not in kinds]
    return [tokenize.tok_name[t.type] if t.type == tokenize.STRING else t.string for t in found]


def cmake(text: str) -> list[str]:
    return _tokens(CMAKE_TOKENS, text)


def make(text: str) -> list[str]:
    """Logical lines without comments: a backslash joins lines first, in comments too."""
    joined = re.sub(r"\\(\r\n|\n|\r)", " ", text)
    return [line for line in (re.sub(r"#.*", "", line).strip() for line in re.split("[\n\r]", joined)) if line]


def smt(text: str) -> list[str]:
    return _tokens(SMT_TOKENS, text)


def xml(text: str) -> list[str]:
    """Elements with the names of their attributes."""
    return [f"{e.tag} {' '.join(e.keys())}" for e in etree.fromstring(text.encode()).iter()]


def html(text: str) -> list[str]:
    """Elements as a browser reads them, with the names of their attributes; comments too."""
    tree = html5lib.HTMLParser(strict=True).parse(text)
    return [f"{e.tag} {' '.join(e.attrib)}" for e in tree.iter()]


def markdown(text: str) -> list[str]:
    """Blocks and what stands in them, without words."""
    found = []
    for block in MarkdownIt("commonmark").enable("table").parse(text):
        found.append(block.type)
        found += [inner.type for inner in block.children or ()]
    return found


LEXERS: dict[str, Callable[[str], list[str]]] = {
    ".h": c,
    ".c": c,
    ".py": python,
    ".txt": cmake,
    ".mk": make,
    ".md": markdown,
}
"""Ending of a generated file → its lexer."""
