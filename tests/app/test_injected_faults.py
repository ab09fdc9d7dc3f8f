"""Every verb, with a fault at each call of a library that can raise: a message in plain words, and no exception."""

from __future__ import annotations

import errno
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import casadi
import numpy as np
import pytest
import ruamel.yaml
import ruamel.yaml.parser
import scipy.linalg
import scipy.optimize
import scipy.signal
import sympy
from sympy.matrices.exceptions import NonInvertibleMatrixError
from sympy.matrices.matrixbase import MatrixBase

import codegen.analysis.analysis
import codegen.analysis.conditions
import codegen.analysis.error_dynamics
import codegen.base.text
import codegen.logs.motion
import codegen.spec.yaml_text
from codegen.base.files import write_all
from stiction import derive
from tests.expected_errors import refused
from tests.slow_cases import slow_except

from .command import COMMAND, SPECS, is_one_message, stiction

VERBS: dict[str, tuple[str, ...]] = {
    "init": ("init", "made"),
    "copy": ("init", "made", "--from", "s.yaml"),
    "robot": ("init", "made", "--from", "arm.urdf"),
    "schema": ("schema", "-o", "made.json"),
    "check": ("check", "s.yaml"),
    "derive": ("derive", "s.yaml"),
    "json": ("derive", "s.yaml", "--json"),
    "certify": ("certify", "s.yaml", "-o", "made.json"),
    "verify": ("verify", "generated/one_mass/certificate.json"),
    "proof": ("verify", "generated/one_mass/proof.json", "--json"),
    "smt": ("verify", "generated/one_mass/certificate.json", "--smt", "made.smt2"),
    "generate": ("generate", "s.yaml", "-o", "made"),
    "stale": ("generate", "s.yaml", "--check"),
    "fmu": ("generate", "s.yaml", "--target", "fmu", "-o", "made"),
    "gains": ("gains", "s.yaml", "-o", "made"),
    "cancel": ("cancel", "s.yaml", "-o", "made"),
    "simulate": ("simulate", "s.yaml", "-o", "made.csv"),
    "replay": ("replay", "s.yaml", "log.csv", "-o", "made.csv"),
    "diagnose": ("diagnose", "s.yaml", "log.csv", "-o", "made"),
}
SPEC = (SPECS / "one_mass.yaml").read_text().replace("duration: 12", "duration: 1")
QUICK = ("check", "derive", "verify", "simulate", "replay", "cancel")
BEYOND = RuntimeError(".../casadi/core/function.cpp: injected")
FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
NUMERICAL: dict[str, tuple[Any, str, Exception]] = {
    **{
        f"np.linalg.{name}": (np.linalg, name, np.linalg.LinAlgError("injected"))
        for name in ("eigvals", "eigvalsh", "eigh", "solve", "inv", "cholesky", "lstsq", "pinv", "svd", "matrix_rank")
    },
    "scipy.linalg.eigh": (scipy.linalg, "eigh", np.linalg.LinAlgError("injected")),
    "scipy.linalg.solve_discrete_lyapunov": (
        scipy.linalg,
        "solve_discrete_lyapunov",
        np.linalg.LinAlgError("injected"),
    ),
    "casadi.Function": (casadi.Function, "__call__", BEYOND),
    "sympy.Matrix.inv": (MatrixBase, "inv", NonInvertibleMatrixError("injected")),
    "sympy.Matrix.LUsolve": (MatrixBase, "LUsolve", NonInvertibleMatrixError("injected")),
    "sympy.Matrix.det": (MatrixBase, "det", OverflowError("injected")),
    "sympy.Matrix.subs": (MatrixBase, "subs", ZeroDivisionError("injected")),
}
OF_THE_TOOL: dict[str, tuple[Any, str, Exception]] = {
    "sympy.Matrix.applyfunc": (MatrixBase, "applyfunc", RecursionError("injected")),
    "sympy.Matrix.multiply": (MatrixBase, "multiply", MemoryError("injected")),
    "sympy.together": (sympy, "together", NotImplementedError("injected")),
    "scipy.optimize.minimize": (scipy.optimize, "minimize", TypeError("injected")),
    "scipy.signal.butter": (scipy.signal, "butter", ValueError("injected")),
    "np.column_stack": (np, "column_stack", ValueError("injected")),
    "np.concatenate": (np, "concatenate", MemoryError("injected")),
    "json.loads": (json, "loads", RecursionError("injected")),
    "json.dumps": (json, "dumps", ValueError("injected")),
    "render": (codegen.base.text, "render", KeyError("injected")),
}
FILES: dict[str, tuple[Any, str, Exception]] = {
    "ruamel load": (ruamel.yaml.YAML, "load", AssertionError("injected")),
    "ruamel parse": (ruamel.yaml.parser.Parser, "parse_node", AttributeError("injected")),
    "os.fdopen": (os, "fdopen", FULL),
    "subprocess.run": (subprocess, "run", OSError(errno.ENOEXEC, "injected")),
    **{f"Path.{name}": (Path, name, FULL) for name in ("replace", "mkdir", "chmod", "write_text", "samefile")},
}
FAULTS = NUMERICAL | OF_THE_TOOL | FILES
RARE = {  # met by the slow verbs alone
    *(f"np.linalg.{name}" for name in ("eigh", "solve", "lstsq", "svd", "inv", "cholesky", "pinv")),
    *("scipy.linalg.eigh", "scipy.linalg.solve_discrete_lyapunov", "scipy.optimize.minimize", "scipy.signal.butter"),
    *("sympy.Matrix.inv", "sympy.Matrix.LUsolve"),
}


def users(owner: Any, name: str) -> list[tuple[Any, str]]:
    """Where a function is known: in its own module or class, and in ours that imported it by its name."""
    if isinstance(owner, type):
        return [(owner, name)]
    ours = [module for key, module in sys.modules.items() if key.startswith("codegen")]
    original = getattr(owner, name)
    known = [(m, key) for m in ours for key, value in list(vars(m).items()) if value is original and m is not owner]
    return [(owner, name), *known]


@contextmanager
def replaced(owner: Any, name: str, by: Callable[..., Any]) -> Iterator[None]:
    conditions, yaml, motion = codegen.analysis.conditions, codegen.spec.yaml_text, codegen.logs.motion
    for kept in (conditions.reduce_conditions, yaml.load_plain, motion._sections):
        kept.cache_clear()  # what was computed before meets no fault
    codegen.analysis.error_dynamics._cache.clear()
    with pytest.MonkeyPatch.context() as patch:
        for user, key in users(owner, name):
            patch.setattr(user, key, by)
        yield


@contextmanager
def injected(owner: Any, name: str, fault: BaseException) -> Iterator[list[int]]:
    """``fault`` at every call; the list grows with each."""
    calls = list[int]()

    def raising(*given: object, **named: object) -> Any:
        calls.append(1)
        raise fault

    with replaced(owner, name, raising):
        yield calls


def met_by(verb: str) -> set[str]:
    """The faults whose function a verb calls."""
    met = set[str]()

    def counted(fault: str, original: Callable[..., Any]) -> Callable[..., Any]:
        def call(*given: Any, **named: Any) -> Any:
            met.add(fault)
            return original(*given, **named)

        return call

    with ExitStack() as stack:
        for fault, (owner, name, _) in FAULTS.items():
            stack.enter_context(replaced(owner, name, counted(fault, getattr(owner, name))))
        stiction(*VERBS[verb])
    return met


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a spec, its generated code and a log."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "s.yaml").write_text(SPEC)
    shutil.copy(SPECS / "seven_joint_arm.urdf", folder / "arm.urdf")
    shutil.copytree(SPECS.parent / "generated" / "one_mass", folder / "generated" / "one_mass")
    assert stiction("simulate", folder / "s.yaml", "-o", folder / "log.csv").code == 0
    return folder


@pytest.fixture(scope="module")
def met(made: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[str]]:
    """The faults that each of the quick verbs meets."""
    folder = tmp_path_factory.mktemp("met") / "here"
    shutil.copytree(made, folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(tempfile, "tempdir", str(folder))  # with no library compiled by an earlier run
        return {verb: met_by(verb) for verb in QUICK}


@pytest.fixture
def run(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str, str], None]:
    shutil.copytree(made, tmp_path / "here")
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

    def once(verb: str, fault: str) -> None:
        owner, name, error = FAULTS[fault]
        with injected(owner, name, error) as calls:
            result = stiction(*VERBS[verb])
        said = result.out + result.err
        assert "Traceback" not in said
        if not calls:
            return
        assert result.code in (0, 2, 3, 4, 70), said
        if result.code == 2 and verb not in ("verify", "proof", "smt"):
            assert is_one_message(result)
        if result.code == 70:
            assert fault not in NUMERICAL and fault not in FILES, said
            lines = result.err.splitlines()  # behind the messages whose JSON cannot be written
            told = next(line for line in lines if not line.startswith("error: "))
            assert told.startswith("internal error: ") and type(error).__name__ in told
        if "injected" in said and fault in NUMERICAL:
            assert ("s.yaml" in said or "arm.urdf" in said) and "cannot be computed" in said

    return once


@pytest.mark.parametrize("fault", sorted(FAULTS.keys() - RARE))
def test_a_fault_is_told(run, met, fault):
    verb = next(verb for verb in QUICK if fault in met[verb])
    run(verb, fault)


@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_any_verb_is_told(run, verb, fault):
    run(verb, fault)


def test_an_internal_error_is_no_bad_input(made, monkeypatch):
    monkeypatch.chdir(made)
    with injected(codegen.analysis.analysis, "judge", TypeError("injected")):
        result = stiction("derive", "s.yaml")
        assert result.code == 70 and result.out == ""
        assert result.err.startswith("internal error: `stiction derive s.yaml` ended in TypeError: injected\n")
        assert "nothing says that the input is wrong" in result.err and "STICTION_TRACEBACK=1" in result.err
        monkeypatch.setenv("STICTION_TRACEBACK", "1")
        assert "Traceback" in stiction("derive", "s.yaml").err
        with pytest.raises(TypeError, match="injected"):
            derive("s.yaml")


def test_an_interrupt(made, monkeypatch):
    """Ctrl-C is no error: one word, and the exit status of the signal."""
    monkeypatch.chdir(made)
    with injected(codegen.analysis.analysis, "judge", KeyboardInterrupt()):
        result = stiction("derive", "s.yaml")
    assert (result.code, result.err) == (128 + signal.SIGINT, "interrupted\n")


def test_an_interrupt_that_a_library_turns_into_an_error(made, monkeypatch):
    """As CasADi does within C++; an error without Ctrl-C stays the tool's fault, the one after it too."""

    def turned(*_):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise NotImplementedError("Wrong number or type of arguments for overloaded function") from None

    monkeypatch.chdir(made)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts what runs behind it with SIGINT ignored
    with patch.object(codegen.analysis.analysis, "judge", turned):
        result = stiction("derive", "s.yaml")
    assert (result.code, result.err) == (128 + signal.SIGINT, "interrupted\n")
    with injected(codegen.analysis.analysis, "judge", NotImplementedError("as ever")):
        assert stiction("derive", "s.yaml").code == 70
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_no_memory(made, monkeypatch):
    monkeypatch.chdir(made)
    with injected(codegen.analysis.analysis, "judge", MemoryError()):
        result = stiction("derive", "s.yaml")
    assert result.code == 70 and "MemoryError: there is not enough memory" in result.err and "too small" in result.err


FORCES = ["w*1e-299*1e-299", "w/1e-299/1e-299", "w*(1e-250*x)**2", "w - 1e299*1e299*x", "w*exp(1e250*x)"]


@pytest.mark.parametrize("force", slow_except(FORCES, FORCES[1:4]))
def test_numbers_beyond_a_double(made, tmp_path, monkeypatch, force):
    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text(SPEC.replace("  - w\n", f"  - {force}\n"))
    for verb in ("check", "derive", "simulate", "gains", "cancel"):
        result = stiction(*VERBS[verb])
        assert result.code in (0, 2, 3), result.err
        assert result.code != 2 or is_one_message(result)


@pytest.mark.parametrize("verb", ["check", "derive", pytest.param("certify", marks=pytest.mark.slow)])
def test_a_nearly_singular_mass_matrix(tmp_path, monkeypatch, verb):
    monkeypatch.chdir(tmp_path)
    text = (SPECS / "two_mass.yaml").read_text()
    Path("s.yaml").write_text(text.replace("  - [m1, 0]\n  - [0, m2]", "  - [m1, m1]\n  - [m1, m1 + m1*1e-14]"))
    result = stiction(*VERBS[verb])
    assert result.code in (0, 2, 3), result.err
    assert result.code != 2 or is_one_message(result)


UNWRITABLE = "error: standard output: cannot be written (%s); expected room for a result\n"


WRITTEN = [
    (verb, unbuffered) for verb in (("version",), ("check", "absent.yaml", "--json")) for unbuffered in ("", "1")
]


@pytest.mark.parametrize(("verb", "unbuffered"), slow_except(WRITTEN, WRITTEN[::3], several=True))
def test_standard_output_that_cannot_be_written(made, verb, unbuffered):
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*COMMAND, *verb],
            env={**os.environ, "PYTHONUNBUFFERED": unbuffered, "PYTHONPATH": str(SPECS.parent)},
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            cwd=made,
        )
    *before, last = done.stderr.splitlines(keepends=True)
    assert (done.returncode, last) == (2, UNWRITABLE % os.strerror(errno.ENOSPC))
    assert [line[: len("error: absent.yaml: ")] for line in before] == ["error: absent.yaml: "] * ("--json" in verb)


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_standard_output_that_takes_a_part(tmp_path, unbuffered):
    """Without a buffer Python drops what a file did not take, and says nothing.

    So it does with compiled modules: the limit would leave them cut in ``__pycache__``, for every later process.
    """
    run = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000)); from stiction import main; "
    with (tmp_path / "schema.json").open("w") as out:
        done = subprocess.run(
            [sys.executable, "-c", f"{run}sys.argv = ['stiction', 'schema']; main()"],
            env={
                **os.environ,
                "PYTHONDONTWRITEBYTECODE": "1",
                "PYTHONUNBUFFERED": unbuffered,
                "PYTHONPATH": str(SPECS.parent),
            },
            stdout=out,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert (done.returncode, done.stderr) == (2, UNWRITABLE % os.strerror(errno.EFBIG))


def test_a_full_disk_leaves_no_files_and_no_empty_folders(tmp_path: Path) -> None:
    """`diagnose` and `generate` on a full disk left the folders that they had made, empty."""
    (tmp_path / "old").mkdir()
    before, largest = signal.signal(signal.SIGXFSZ, signal.SIG_IGN), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, largest[1]))
    try:
        with refused("FILE003 b.txt"):
            write_all(tmp_path / "old" / "new", {"a.txt": "a", "c/d/b.txt": "b" * 2000})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, largest)
        signal.signal(signal.SIGXFSZ, before)
    assert [path.name for path in tmp_path.rglob("*")] == ["old"]
