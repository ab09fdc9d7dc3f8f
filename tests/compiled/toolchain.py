"""Compilers and their flags. Objects are kept between sessions by the hash of compiler, flags and sources."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from codegen.base.compiler import cached

STRICT = (
    *("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"),
    *("-Wconversion", "-Wdouble-promotion", "-Wfloat-equal", "-Wshadow"),
)
"""What every generated file must pass under every compiler: the list of issue 4."""

NO_CONTRACTION = "-ffp-contract=off"
M4F = ("-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard")
M7 = ("-mcpu=cortex-m7", "-mthumb", "-mfpu=fpv5-d16", "-mfloat-abi=hard")


@dataclass(frozen=True)
class Compiler:
    """A command with the flags that choose its machine."""

    label: str
    command: str
    machine: tuple[str, ...] = ()


GCC, CLANG = Compiler("gcc", "gcc"), Compiler("clang", "clang")
ARM_M4F = Compiler("cortex-m4f", "arm-none-eabi-gcc", M4F)
ARM_M7 = Compiler("cortex-m7", "arm-none-eabi-gcc", M7)
COMPILERS = (GCC, CLANG, ARM_M4F, ARM_M7)


def need(*tools: str) -> None:
    """Skip the test where a tool is absent; gcc, which the project itself needs, is never absent."""
    for tool in tools:
        if tool != "gcc" and shutil.which(tool) is None:
            pytest.skip(f"there is no {tool} here; `make toolchains` installs it")


def run(*command: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(c) for c in command], cwd=cwd, capture_output=True, text=True, check=False)


@cache
def version(command: str) -> str:
    """What a compiler says of itself, with the revision of its package."""
    return run(command, "--version").stdout


def compiled(command: Sequence[str], folder: Path, source: str) -> bytes:
    """What a compiler makes of a file that may include others of its folder; any message of it is an error."""

    def make() -> bytes:
        with TemporaryDirectory() as scratch:
            made = Path(scratch) / "made"
            done = run(*command, folder / source, "-o", made, *(["-lm"] if "-shared" in command else []))
            assert done.returncode == 0 and not done.stderr, f"{' '.join(command)} {source}\n{done.stderr}"
            return made.read_bytes()

    texts = [part for p in sorted(folder.glob("*.[ch]")) for part in (p.name, p.read_text("utf-8"))]
    return cached(["a test's", version(command[0]), *command, "", source, *texts], make)


def linked(command: Sequence[str | Path]) -> bytes:
    """What a compiler links of objects; any message of it is an error. Files are keyed by their bytes."""

    def make() -> bytes:
        with TemporaryDirectory() as scratch:
            done = run(*command, "-o", Path(scratch) / "made")
            assert done.returncode == 0 and not done.stderr, f"{' '.join(map(str, command))}\n{done.stderr}"
            return (Path(scratch) / "made").read_bytes()

    parts = [hashlib.sha256(p.read_bytes()).hexdigest() if isinstance(p, Path) else p for p in command]
    return cached(["a test's link", version(str(command[0])), *parts], make)


class Workshop:
    """A folder of compiled things, shared by the tests of a session and by its workers."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def unpack(self, files: Mapping[str, str]) -> Path:
        """A folder with these files in it."""
        target = self.folder / _hash(*[part for pair in sorted(files.items()) for part in pair])
        if not target.exists():
            scratch = self._scratch()
            scratch.mkdir(parents=True)
            for name, text in files.items():
                (scratch / name).write_text(text, encoding="utf-8")
            _settle(scratch, target)
        return target

    def object(self, files: Mapping[str, str], source: str, compiler: Compiler, *flags: str) -> Path:
        """Compile one of the files; any message of the compiler is an error."""
        need(compiler.command)
        folder = self.unpack(files)
        target = folder / f"{source}.{_hash(compiler.label, *flags)}.o"
        if not target.exists():
            scratch, command = self._scratch(), (compiler.command, *compiler.machine, *flags, "-c")
            scratch.write_bytes(compiled(command, folder, source))
            scratch.replace(target)
        return target

    def link(self, target: str, compiler: Compiler, *parts: str | Path) -> Path:
        """Link objects into a program or, with -shared among the parts, a library."""
        made = self.folder / f"{target}.{_hash(compiler.label, *map(str, parts))}"
        if not made.exists():
            scratch = self._scratch()
            scratch.write_bytes(linked((compiler.command, *compiler.machine, *parts)))
            scratch.chmod(0o755)
            scratch.replace(made)
        return made

    def _scratch(self) -> Path:
        self.folder.mkdir(parents=True, exist_ok=True)
        return self.folder / f"{os.getpid()}.{os.urandom(6).hex()}"


def symbols(object_file: Path, nm: str = "nm") -> dict[str, str]:
    """Symbol → nm's letter."""
    done = run(nm, object_file)
    assert done.returncode == 0, done.stderr
    return {line.split()[-1]: line.split()[-2] for line in done.stdout.splitlines()}


def nm_of(compiler: Compiler) -> str:
    return "arm-none-eabi-nm" if compiler.command.startswith("arm-") else "nm"


def _settle(scratch: Path, target: Path) -> None:
    """Rename a finished folder; another worker may have been first with the same content."""
    try:
        scratch.rename(target)
    except OSError:
        shutil.rmtree(scratch)


def _hash(*parts: str) -> str:
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:20]
