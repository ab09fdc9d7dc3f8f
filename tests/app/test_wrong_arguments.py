"""A verb called with the wrong arguments, or the wrong types of them: a mistake of the caller, told as one."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stiction
from codegen.base.border import verb
from codegen.certify.outcome import Certificate
from tests.app.command import SPECS

ONE = SPECS / "one_mass.yaml"
NO_VERBS = ("main", "progress")
VERBS = [n for n in stiction.__all__ if inspect.isfunction(getattr(stiction, n)) and n not in NO_VERBS]
METHODS = [name for name in VERBS if hasattr(stiction.Machine, name)]
WRONG = {"array": np.zeros((3, 3)), "object": object(), "complex": 1j}


@pytest.fixture(scope="module")
def one() -> stiction.Machine:
    return stiction.load(ONE)


@pytest.mark.parametrize("log", [np.zeros((3, 3)), None, [1.0], b"log.csv"])
def test_a_log_is_a_path_or_arrays_by_name(one: stiction.Machine, log: Any) -> None:
    for method in (one.replay, one.diagnose, one.watch):
        with pytest.raises(
            stiction.BadInput, match=r"`log`: an object of the type [\w.]+[^;]*; expected a path"
        ) as told:
            method(log)
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


def test_an_unknown_argument_is_told_with_the_known_ones(one: stiction.Machine) -> None:
    with pytest.raises(TypeError, match=r"^verify\(\) .* 'foo'; expected one of certificate$"):
        one.verify(foo=3)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match=r"^gains\(\) .* 'overr'; .* \(did you mean 'over'\?\)$"):
        one.gains(overr=("K_F", "h"))


@pytest.mark.parametrize("force", [np.bool_(True), np.bool_(False)])
def test_a_truth_value_of_numpy_is_one(one: stiction.Machine, tmp_path: Path, force: Any) -> None:
    assert (one.generate(tmp_path, force=force).folder / "one_mass.c").is_file()
    with pytest.raises(stiction.BadInput, match=r"`dwell`: an object of the type numpy\.bool"):
        one.watch("log.csv", dwell=force)


def test_a_verb_calls_its_argument_as_the_method_does(one: stiction.Machine) -> None:
    """Machine.verify has a signature of its own, which docs/how-to/python.md shows."""
    with pytest.raises(stiction.BadInput, match=r"^verify\(\): `certificate`: an object of the type int"):
        one.verify(3)  # type: ignore[arg-type]
    assert "certificate" in inspect.signature(stiction.verify).parameters


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
    with pytest.raises(
        stiction.BadInput, match=rf"`{argument}`: an object of the type (numpy\.)?{type(WRONG[key]).__name__}"
    ):
        verb(**given | {argument: WRONG[key]})


def test_the_type_of_a_library_has_its_name_in_front(one: stiction.Machine) -> None:
    flag: Any = np.complex128(1)
    with pytest.raises(stiction.BadInput, match=r"`force`: an object of the type numpy\.complex128; expected True or"):
        one.generate(force=flag)


@pytest.mark.parametrize("error", [KeyError, ValueError, TypeError, stiction.BadInput])
def test_what_the_callers_function_raises_leaves_the_verb_as_it_is(
    one: stiction.Machine, tmp_path: Path, error: type[Exception]
) -> None:
    """It ends the verb, and nothing is written."""

    def stop(step: str, share: float) -> None:
        raise error(*["mine"] * (3 if error is stiction.BadInput else 1))

    with pytest.raises(error, match="mine") as told:
        one.simulate(tmp_path / "log.csv", progress=stop)
    assert type(told.value) is error and not list(tmp_path.iterdir())


def test_no_log_at_all_is_bad_input(one: stiction.Machine) -> None:
    with pytest.raises(stiction.BadInput, match="`log`: an empty list; expected one log or more"):
        one.diagnose([])


def test_the_text_of_a_spec_is_no_path() -> None:
    with pytest.raises(stiction.BadInput, match=r"the path of a spec: text of \d+ lines; expected the path of a"):
        stiction.load(ONE.read_text("utf-8"))


def test_an_empty_text_is_no_path(one: stiction.Machine) -> None:
    """``Path("")`` is the working directory: ``generate(out="")`` wrote its files there."""
    calls = (stiction.load, one.generate, one.gains, one.diagnose, one.simulate, stiction.verify, one.replay)
    for call in calls:
        with pytest.raises(stiction.BadInput, match="an empty text; expected a path") as told:
            call("")
        assert told.value.code == "CALL001"


def test_a_truth_is_no_number(one: stiction.Machine) -> None:
    with pytest.raises(stiction.BadInput, match="`dwell`: an object of the type bool; expected a number or text"):
        one.watch("log.csv", dwell=True)


def test_pieces_of_a_watched_log(one: stiction.Machine) -> None:
    """An iterator of the caller: what it raises is his."""

    def rows() -> Iterator[bytes]:
        yield b"t,x,w\n0,0,0\n"
        raise OSError("the line is down")

    with pytest.raises(OSError, match="the line is down"):
        one.watch("log.csv", given=rows())


def test_an_fmu_for_a_folder_with_an_unusable_name(one: stiction.Machine) -> None:
    with pytest.raises(stiction.BadInput, match="a name with a zero byte") as told:
        stiction.generate_fmu(one, "a\0")
    assert told.value.code == "FILE005"


def test_the_name_of_an_fmu_is_no_folder(one: stiction.Machine, tmp_path: Path) -> None:
    """It made a folder of that name, with the FMU in it."""
    with pytest.raises(stiction.BadInput, match=r"the name of an FMU; expected a folder, into which one_mass\.fmu is"):
        stiction.generate_fmu(one, tmp_path / "mine.fmu")
    assert not list(tmp_path.iterdir())


def test_a_set_is_taken_in_the_order_of_its_texts() -> None:
    """A set's own order differs from process to process; the first log names the folder, the first gain is the axis."""

    @verb
    def taken(logs: Sequence[str | Path]) -> list[Any]:
        return list(logs)

    assert taken(frozenset({Path("b"), "c", "a"})) == ["a", Path("b"), "c"]
    assert taken(["c", "a"]) == ["c", "a"]


def test_columns_the_other_way_round(one: stiction.Machine, tmp_path: Path) -> None:
    """As pandas renames: {"posx": "x"}."""
    (tmp_path / "log.csv").write_text("t,posx,w\n" + "".join(f"{0.001 * k:.3f},0,0\n" for k in range(9)))
    with pytest.raises(stiction.BadInput, match=r"unknown name `posx`; expected a name of one_mass .*, `x=posx`"):
        one.replay(tmp_path / "log.csv", columns={"posx": "x"})


def test_a_machine_is_not_changed(one: stiction.Machine) -> None:
    """What was derived from the old spec would stay beside the new one."""
    other = stiction.load(SPECS / "two_mass.yaml")
    for name in ("spec", "overrides", "analysis", "name"):
        with pytest.raises(AttributeError, match=r"stiction\.load"):
            setattr(other, name, one.spec)
    assert other.derive().stable and other.spec.name == "two_mass"


def test_an_attribute_that_is_not_there_is_answered_by_python_with_the_one_that_was_meant() -> None:
    with pytest.raises(AttributeError) as told:
        _ = stiction.simulat
    assert told.value.name == "simulat" and told.value.obj is stiction


def test_a_text_is_no_list_of_texts(one: stiction.Machine) -> None:
    with pytest.raises(stiction.BadInput, match="`over`: an object of the type str; expected a list of text"):
        one.gains(over="K_F")


def test_a_list_of_other_things_is_told_with_what_is_in_it(one: stiction.Machine) -> None:
    with pytest.raises(stiction.BadInput, match="`only`: an object of the type list of float; expected a list of text"):
        one.replay("log.csv", only=[1.0, 2.0])
    with pytest.raises(stiction.BadInput, match=r"`log`: .*; expected a path, arrays by name.*, or a list of these$"):
        one.diagnose(5)  # type: ignore[arg-type]
    with pytest.raises(stiction.BadInput, match="`columns`: an object of the type dict of int"):
        one.replay("log.csv", columns={"x": 1})


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


def test_a_spec_is_a_path_or_a_machine() -> None:
    with pytest.raises(stiction.BadInput, match=r"`source`: an object of the type int; expected a machine or a path$"):
        stiction.check(3)
