"""cppcheck with its MISRA addon and clang-tidy over every shipped spec's C; deviations are those of docs/misra.md."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from .shipped import PRECISIONS, SHIPPED, interface, sources
from .toolchain import Workshop, need, run

MISRA_PAGE = Path(__file__).parents[2] / "docs" / "misra.md"
CPPCHECK = ("cppcheck", "--addon=misra", "--std=c99", "-j2", "-q", "--enable=warning,style,performance,portability")
TIDY = (
    *("-*", "bugprone-*", "cert-*", "clang-analyzer-*"),
    *("readability-misleading-indentation", "readability-non-const-parameter", "readability-redundant-*"),
    *("readability-inconsistent-declaration-parameter-name", "readability-else-after-return"),
    *("readability-duplicate-include", "readability-isolate-declaration", "readability-braces-around-statements"),
)
NO_TIDY = {
    "bugprone-easily-swappable-parameters": "state, parameters, inputs and outputs are of four types",
    "cert-err34-c": "the example reads with scanf and checks its count; it is no part of the observer",
}
QUICK = ("two_mass", "two_link_arm", "thesis/rig_dfoa")
FINDING = re.compile(r"^(?P<file>[^\s:]+):\d+:\d+: (?:\w+): .*\[(?P<rule>[^\]]+)\]$", re.MULTILINE)


@cache
def deviations() -> dict[str, str]:
    """Rule → reason, from the table of docs/misra.md."""
    rows = re.findall(r"^\| (\d+\.\d+) \| (.+?) \|", MISRA_PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    return dict(rows)


def findings(*files: Path) -> dict[str, set[str]]:
    """What cppcheck says: rule or check → the files it is said about."""
    done = run(*CPPCHECK, *files)
    assert done.returncode == 0, done.stderr
    found: dict[str, set[str]] = {}
    for match in FINDING.finditer(done.stderr):
        found.setdefault(match["rule"].removeprefix("misra-c2012-"), set()).add(Path(match["file"]).name)
    return found


def observers(workshop: Workshop, precision: str, specs: tuple[str, ...]) -> list[Path]:
    names = [(spec, interface(spec, precision).name) for spec in specs]
    return [workshop.unpack(sources(spec, precision)) / f"{name}.c" for spec, name in names]


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("specs", [QUICK, pytest.param(SHIPPED, marks=pytest.mark.slow)], ids=["three", "all"])
def test_misra_deviations_are_the_documented_ones(workshop, specs, precision):
    need("cppcheck")
    found = findings(*observers(workshop, precision, specs))
    assert set(found) == set(deviations()), found
    assert all(reason.endswith(".") for reason in deviations().values())


@pytest.mark.slow
@pytest.mark.parametrize("precision", PRECISIONS)
def test_clang_tidy_is_silent(workshop, precision):
    need("clang-tidy")
    checks = ",".join([*TIDY, *(f"-{check}" for check in NO_TIDY)])
    files = observers(workshop, precision, SHIPPED)
    files += [path.with_name("example_main.c") for path in files]
    done = run("clang-tidy", f"-checks={checks}", "--warnings-as-errors=*", *files, "--", "-std=c99")
    assert done.returncode == 0 and not FINDING.search(done.stdout), done.stdout


def test_a_null_pointer_is_noticed(workshop):
    need("cppcheck", "clang-tidy")
    files = dict(sources("two_mass"))
    files["two_mass.c"] += "int f(int *p); int f(int *p) { return (p == 0) ? *p : 1; }\n"
    path = workshop.unpack(files) / "two_mass.c"
    assert "11.9" in findings(path)
    done = run("clang-tidy", f"-checks={','.join(TIDY)}", path, "--", "-std=c99")
    assert "clang-analyzer-core.NullDereference" in done.stdout
