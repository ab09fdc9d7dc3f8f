"""A verb called with the wrong arguments, or the wrong types of them: a mistake of the caller, told as one."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stiction
from codegen.certify.outcome import Certificate
from tests.app.command import SPECS

ONE = SPECS / "one_mass.yaml"
VERBS = [name for name in stiction.__all__ if inspect.isfunction(getattr(stiction, name)) and name != "main"]
METHODS = [name for name in VERBS if hasattr(stiction.Machine, name)]
WRONG = {"array": np.zeros((3, 3)), "object": object(), "complex": 1j}


@pytest.fixture(scope="module")
def one() -> stiction.Machine:
    return stiction.load(ONE)


@pytest.mark.parametrize("log", [np.zeros((3, 3)), {"t": [0.0], "x": [0.0]}, None, [1.0], b"log.csv"])
def test_a_log_is_a_path(one: stiction.Machine, log: Any) -> None:
    for verb in (one.replay, one.diagnose, one.watch):
        with pytest.raises(stiction.BadInput, match=r"`log`: an object of the type \w+[^;]*; expected a path") as told:
            verb(log)
        assert told.value.code == "CALL001"


@pytest.mark.parametrize("name", METHODS)
def test_a_missing_or_unknown_argument_is_pythons_own_error(one: stiction.Machine, name: str) -> None:
    verb = getattr(one, name)
    needed = [p for p in inspect.signature(verb).parameters.values() if p.default is p.empty]
    if needed:
        with pytest.raises(TypeError, match=rf"{name}\(\).* missing .*'{needed[0].name}'"):
            verb()
    with pytest.raises(TypeError, match="no_such"):
        verb(*["x"] * len(needed), no_such=1)


def _each_argument() -> list[Any]:
    made = []
    for name in VERBS:
        for parameter in inspect.signature(getattr(stiction, name)).parameters.values():
            made += [pytest.param(name, parameter.name, key, id=f"{name}-{parameter.name}-{key}") for key in WRONG]
    return made


@pytest.mark.parametrize(("name", "argument", "key"), _each_argument())
def test_any_argument_of_another_type_is_bad_input(tmp_path: Path, name: str, argument: str, key: str) -> None:
    """Refused before any work; the message names the argument and the type."""
    verb: Callable[..., Any] = getattr(stiction, name)
    parameters = inspect.signature(verb).parameters.values()
    given: dict[str, Any] = {p.name: str(tmp_path / "none") for p in parameters if p.default is p.empty}
    if "certificate" in given and name == "write_certificate":
        given["certificate"] = object.__new__(Certificate)
    with pytest.raises(stiction.BadInput, match=f"`{argument}`: an object of the type {type(WRONG[key]).__name__}"):
        verb(**given | {argument: WRONG[key]})


def test_a_text_is_no_list_of_texts(one: stiction.Machine) -> None:
    with pytest.raises(stiction.BadInput, match="`over`: an object of the type str; expected a list of text"):
        one.gains(over="K_F")


def test_a_list_of_other_things_is_told_with_what_is_in_it(one: stiction.Machine) -> None:
    with pytest.raises(
        stiction.BadInput, match="`only`: an object of the type list with a float in it; expected a list"
    ):
        one.replay("log.csv", only=[1.0, 2.0])
    with pytest.raises(stiction.BadInput, match="`columns`: an object of the type dict with an int in it"):
        one.replay("log.csv", columns={"x": 1})


@pytest.mark.parametrize("given", [{"precision": 3}, {"fault": 1.0}, {"targets": "python"}, {"targets": (1,)}])
def test_overrides_of_another_type_are_refused_where_they_are_made(given: dict[str, Any]) -> None:
    with pytest.raises(TypeError, match=rf"Overrides: `{next(iter(given))}`"):
        stiction.Overrides(**given)


def test_a_machine_is_made_of_a_spec_that_was_read() -> None:
    path: Any = str(ONE)
    with pytest.raises(TypeError, match=r"stiction\.load"):
        stiction.Machine(path)


def test_dir_shows_verbs_and_documented_results(one: stiction.Machine) -> None:
    """And every one of them is in docs/how-to/python.md or a verb of the module."""
    page = (SPECS.parent / "docs/how-to/python.md").read_text("utf-8")
    shown = dir(one)
    assert set(METHODS) | {"system", "observer", "analysis", "program", "files"} <= set(shown)
    assert all(name in METHODS or f"`machine.{name}`" in page for name in shown)
