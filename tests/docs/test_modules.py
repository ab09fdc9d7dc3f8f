"""docs/modules.md is what the docstrings say now, and every module has one."""

from __future__ import annotations

from benchmarks.module_map import PAGE, first_sentence, folders, page


def test_the_page_is_current() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "run `make modules`"


def test_every_module_says_what_it_holds() -> None:
    assert [one.name + name for one in folders() for name, sentence in one.modules if not sentence] == []


def test_the_first_paragraph_is_told_on_one_line() -> None:
    assert first_sentence('"""One\ntwo ``x``.\n\nMore.\n"""\nx = 1\n') == "One two `x`."
    assert first_sentence("x = 1\n") == ""
