"""Compiled code that a run loads: only what it made or whose hash it checked, from a folder of this user alone."""

from __future__ import annotations

import os
import shlex
import shutil
import stat
from collections.abc import Callable
from pathlib import Path

import jinja2
import numpy as np
import pytest
from jinja2 import DictLoader

from codegen.base import compiler
from codegen.base import compiler as cache
from codegen.base.compiler import cached, cached_library, compile_shared, find_compiler, load_library
from codegen.base.errors import BadInput
from codegen.base.temporary import refuse_replaceable
from codegen.base.text import Environment
from stiction import replay
from tests.app.command import is_one_message, stiction
from tests.expected_errors import refused

SPEC = Path(__file__).parents[2] / "specs" / "two_mass.yaml"
pytestmark = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler is here"
)
SOURCES = {"seven.c": '__attribute__((visibility("default"))) int seven(void) { return 7; }\n'}


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A temporary directory of its own, without a cache."""
    folder = tmp_path / "temporary"
    folder.mkdir(mode=0o700)
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr("tempfile.tempdir", None)
    return folder


def kept_file(home: Path) -> Path:
    (found,) = home.glob(f"{cache.FOLDER}-*/*.library")
    return found


def seven() -> int:
    return int(load_library(cached_library(SOURCES, ["seven.c"])).seven())


def flipped(content: bytes, at: int) -> bytes:
    return content[:at] + bytes([content[at] ^ 0x10]) + content[at + 1 :]


DAMAGE: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda content: b"",
    "half": lambda content: content[: len(content) // 2],
    "its hash alone": lambda content: content[:65],
    "a bit of its head": lambda content: flipped(content, 65 + 40),
    "a bit of its code": lambda content: flipped(content, len(content) // 2),
    "a bit of its hash": lambda content: flipped(content, 3),
    "one byte more": lambda content: content + b"\0",
}


@pytest.mark.parametrize("damage", DAMAGE.values(), ids=DAMAGE)
def test_a_damaged_library_is_made_anew(home: Path, damage: Callable[[bytes], bytes]) -> None:
    assert seven() == 7
    kept, whole = kept_file(home), kept_file(home).read_bytes()
    kept.write_bytes(damage(whole))
    assert seven() == 7
    assert kept.read_bytes() == whole


@pytest.mark.parametrize("there", ["a folder", "a pipe", "a link to nothing"])
def test_what_is_no_file_is_not_loaded(home: Path, there: str) -> None:
    """And a replay goes on without a kept library."""
    seven()
    kept = kept_file(home)
    kept.unlink()
    {"a folder": kept.mkdir, "a pipe": lambda: os.mkfifo(kept), "a link to nothing": lambda: kept.symlink_to("no")}[
        there
    ]()
    assert seven() == 7


def test_a_replay_with_a_damaged_library_gives_what_it_gave(home: Path, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    t = np.arange(300) * 1e-3
    np.savetxt(log, np.column_stack([t, t**2, t**2, 0 * t]), "%.17g", ",", header="t,x1,x2,w", comments="")
    replay(SPEC, log, tmp_path / "a.csv")
    kept = kept_file(home)
    kept.write_bytes(flipped(kept.read_bytes(), 3000))
    replay(SPEC, log, tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_the_second_run_compiles_nothing(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = cached_library(SOURCES, ["seven.c"])
    monkeypatch.setattr(compiler.subprocess, "run", lambda *args, **named: pytest.fail("compiled again"))
    assert cached_library(SOURCES, ["seven.c"]) == first


def test_another_version_of_the_compiler_compiles_again(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A new one is installed at the path of the old one."""
    wrapper = home / "cc"
    for comment in ("", "# newer\n"):
        wrapper.write_text(f'#!/bin/sh\n{comment}exec {find_compiler()[0]} "$@"\n')
        wrapper.chmod(0o755)
        with monkeypatch.context() as chosen:
            chosen.setenv("CC", str(wrapper))
            cached_library(SOURCES, ["seven.c"])
    assert len([*home.glob(f"{cache.FOLDER}-*/*")]) == 2


def test_other_flags_are_another_library(home: Path) -> None:
    number = {"seven.c": SOURCES["seven.c"].replace("7", "NUMBER")}
    for value in (7, 8, 7):
        assert load_library(cached_library(number, ["seven.c"], [f"-DNUMBER={value}"])).seven() == value
    assert len([*home.glob(f"{cache.FOLDER}-*/*")]) == 2


def test_what_was_not_used_for_longest_is_removed(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def numbered(value: int) -> dict[str, str]:
        return {"seven.c": SOURCES["seven.c"].replace("7", str(value))}

    def compiled(value: int) -> bool:
        before = len(commands)
        assert load_library(cached_library(numbered(value), ["seven.c"])).seven() == value
        return len(commands) > before

    run, commands = compiler.subprocess.run, []
    monkeypatch.setattr(compiler.subprocess, "run", lambda *a, **named: (commands.append(a), run(*a, **named))[1])
    assert compiled(1)
    monkeypatch.setattr(cache, "MOST_CACHED", 3 * kept_file(home).stat().st_size + 100)
    assert compiled(2) and compiled(3) and not compiled(1)
    assert compiled(4) and not compiled(1) and not compiled(3) and compiled(2)
    assert len([*home.glob(f"{cache.FOLDER}-*/*")]) == 3


def test_the_cache_is_seldom_counted(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file each for a library: to look at thousands of them after each takes longer than to compile it."""
    counted, remove = [], cache._remove_oldest
    monkeypatch.setattr(cache, "_remove_oldest", lambda folder: (counted.append(folder), remove(folder)))
    for k in range(20):
        assert cached([str(k)], lambda: b"made") == b"made"
    assert len(counted) == 1
    monkeypatch.setattr(cache, "MOST_CACHED", 1000)
    for k in range(40):
        assert cached([f"long {k}"], lambda: bytes(100)) == bytes(100)
    assert len(counted) == 41
    assert sum(file.stat().st_size for file in home.glob(f"{cache.FOLDER}-*/*")) <= 1000


def test_a_template_is_compiled_once_for_a_user(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def rendered(source: str) -> str:
        return Environment(loader=DictLoader({"a": source})).get_template("a").render(name="x")

    generate, generated = jinja2.Environment._generate, []
    monkeypatch.setattr(
        jinja2.Environment, "_generate", lambda *a, **named: (generated.append(a), generate(*a, **named))[1]
    )
    first = "{{ name }} of {{ 1.5 }}"
    assert [rendered(first), rendered(first)] == ["x of 1.5"] * 2
    assert len(generated) == 1
    assert rendered("{{ name }} of {{ 2.5 }}") == "x of 2.5"
    assert len(generated) == 2
    for file in home.glob(f"{cache.FOLDER}-*/*.template"):
        file.write_bytes(flipped(file.read_bytes(), 100))
    assert rendered(first) == "x of 1.5"
    assert len(generated) == 3


def test_without_a_temporary_directory_nothing_is_cached(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.gettempdir", lambda: (_ for _ in ()).throw(FileNotFoundError))
    assert cached(["a"], lambda: b"made") == b"made"
    assert Environment(loader=DictLoader({"a": "{{ name }}"})).get_template("a").render(name="x") == "x"


@pytest.mark.parametrize("mode", [0o777, 0o770, 0o755])
def test_a_cache_that_others_can_reach_is_not_used(home: Path, mode: int) -> None:
    folder = home / f"{cache.FOLDER}-{os.getuid()}"
    folder.mkdir()
    folder.chmod(mode)
    assert seven() == 7
    assert not list(folder.iterdir())


def test_a_link_in_place_of_the_cache_is_not_followed(home: Path, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    (home / f"{cache.FOLDER}-{os.getuid()}").symlink_to(elsewhere)
    assert seven() == 7
    assert not list(elsewhere.iterdir())


def test_the_sources_lie_where_only_this_user_can_write(home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder, and what a compiler is called in, as the compiler sees them."""
    seen = []
    run = compiler.subprocess.run

    def watched(command: list[str], cwd: Path, **named: object) -> object:
        seen.append((stat.S_IMODE(cwd.stat().st_mode), cwd.stat().st_uid, cwd.parent))
        return run(command, cwd=cwd, **named)

    monkeypatch.setattr(compiler.subprocess, "run", watched)
    compile_shared(SOURCES, ["seven.c"])
    assert seen == [(0o700, os.getuid(), home)]
    assert not list(home.iterdir())


def test_a_temporary_directory_in_which_others_may_rename_is_refused(home: Path) -> None:
    home.chmod(0o777)
    with refused("FILE007 sticky"):
        compile_shared(SOURCES, ["seven.c"])
    home.chmod(0o1777)
    refuse_replaceable(home)
    assert seven() == 7


@pytest.mark.parametrize("named", ["{} -O3", "{}   -O1 -DX='a b'", "'{}'", " {} "])
def test_cc_is_split_as_make_does(monkeypatch: pytest.MonkeyPatch, named: str) -> None:
    monkeypatch.delenv("CC", raising=False)
    (plain,) = find_compiler()
    monkeypatch.setenv("CC", named.format(plain))
    assert find_compiler() == tuple(shlex.split(named.format(plain)))
    assert load_library(compile_shared(SOURCES, ["seven.c"])).seven() == 7


@pytest.mark.parametrize(("named", "chosen"), [("/bin/true", "CC names it; "), (None, "")])
def test_a_compiler_that_makes_nothing_is_said(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, named: str | None, chosen: str
) -> None:
    monkeypatch.delenv("CC", raising=False)
    if named:
        monkeypatch.setenv("CC", named)
    else:
        (tmp_path / "cc").symlink_to("/bin/true")
        monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BadInput) as told:
        compile_shared(SOURCES, ["seven.c"])
    assert told.value.code == "TOOL001" and told.value.found.startswith(f"{chosen}the compiler")


@pytest.mark.parametrize("named", ["gcc-of-nobody", "gcc-of-nobody -O3", "/nowhere/cc", "gcc 'open", "''"])
def test_a_named_compiler_that_cannot_be_used_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: str
) -> None:
    monkeypatch.setenv("CC", named)
    (tmp_path / "log.csv").write_text("t,x1,x2,w\n")
    done = stiction("replay", SPEC, tmp_path / "log.csv")
    assert is_one_message(done) and done.err.startswith("error: CC: ") and named in done.err
