"""Every shipped spec's C compiles without a warning everywhere; its object needs libm and no more."""

from __future__ import annotations

import re
import shutil

import pytest

from tests.slow_cases import slow_except

from .driver import HOST_FLAGS
from .shipped import KINDS, PRECISIONS, SHIPPED, interface, program, sources
from .toolchain import ARM_M4F, CLANG, COMPILERS, GCC, STRICT, Compiler, Workshop, need, nm_of, run, symbols

MATHEMATICS = {"sin", "cos", "sincos", "tan", "exp", "log", "sqrt", "tanh", "pow"}
COMPILERS_OWN = {"memcpy", "memmove", "memset"}
"""What gcc and clang ask of every C, also without a library; they make calls of loops that copy arrays."""
SOFTWARE_DOUBLE = re.compile(r"__aeabi_(d|f2d|i2d|ui2d|cd|l2d)")
# one line beside the generated code, for each warning, that must make it fail
FAULTY = {
    "-Wconversion": "int faulty(long long x); int faulty(long long x) { return x; }",
    "-Wdouble-promotion": "double faulty(float x); double faulty(float x) { return x * 2.0; }",
    "-Wfloat-equal": "int faulty(double x, double y); int faulty(double x, double y) { return x == y; }",
    "-Wshadow": "int faulty(int x); int faulty(int x) { { int x = 1; (void)x; } return x; }",
    "-Wunused": "int faulty(void); int faulty(void) { int x = 1; return 2; }",
    "-Wpedantic": "int faulty(void); int faulty(void) { return 0b1; }",
}

PAIRS = [(spec, compiler) for spec in SHIPPED for compiler in COMPILERS]
QUICK = [(spec, compiler) for spec, compiler in PAIRS if compiler is GCC or spec in KINDS]
"""Every spec by one compiler, one of each kind by all."""


def flags_of(compiler: Compiler) -> tuple[str, ...]:
    """Those of the builds that the other tests run, so that each file is compiled once."""
    return (*HOST_FLAGS, "-O2") if compiler in (GCC, CLANG) else (*STRICT, "-O2", "-ffp-contract=off")


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize(("spec", "compiler"), slow_except(PAIRS, QUICK, several=True))
def test_no_warning(workshop, spec, precision, compiler):
    files = sources(spec, precision)
    for name in files:
        if name.endswith(".c"):
            workshop.object(files, name, compiler, *flags_of(compiler))


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("spec", ["two_mass", "two_link_arm", "thesis/rig_dfoa", "thesis/rig_to"])
def test_no_warning_without_a_fault_policy(workshop, spec, precision):
    files = sources(spec, precision, "none")
    for name in ("example_main.c", f"{interface(spec).name}.c"):
        for compiler in (GCC, ARM_M4F):
            if shutil.which(compiler.command):
                workshop.object(files, name, compiler, *flags_of(compiler))


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize(("spec", "compiler"), slow_except(PAIRS, QUICK, several=True))
def test_mathematics_and_nothing_else_is_linked(workshop, spec, precision, compiler):
    files, face = sources(spec, precision), interface(spec, precision)
    found = symbols(workshop.object(files, f"{face.name}.c", compiler, *flags_of(compiler)), nm_of(compiler))
    suffix = "f" if precision == "single" else ""
    allowed = {f"{function}{suffix}" for function in MATHEMATICS}
    if program(spec).arrays:
        allowed |= COMPILERS_OWN
    missing = {s for s, letter in found.items() if letter == "U"}
    if compiler is ARM_M4F and precision == "double":
        missing = {s for s in missing if not SOFTWARE_DOUBLE.match(s)}
    assert missing <= allowed
    assert set(found.values()) <= {"T", "t", "U", "r"}
    exported = {s for s, letter in found.items() if letter == "T"}
    assert {f"{face.name}_init", f"{face.name}_step"} <= exported
    assert all(s.startswith(f"{face.name}_") for s in exported)


@pytest.mark.parametrize("compiler", COMPILERS, ids=lambda c: c.label)
@pytest.mark.parametrize("warning", FAULTY)
def test_each_warning_is_an_error(workshop, warning, compiler):
    need(compiler.command)
    files = dict(sources("two_mass"))
    files["two_mass.c"] += f"\n{FAULTY[warning]}\n"
    with pytest.raises(AssertionError, match="error:"):
        workshop.object(files, "two_mass.c", compiler, *flags_of(compiler))
    workshop.object(files, "two_mass.c", compiler, *flags_of(compiler), warning.replace("-W", "-Wno-", 1))


def test_a_global_and_a_stranger_are_noticed(workshop):
    files = dict(sources("two_mass"))
    files["two_mass.c"] += '\n#include <stdio.h>\nint counter;\nvoid f(void);\nvoid f(void) { (void)printf("x"); }\n'
    found = symbols(workshop.object(files, "two_mass.c", GCC, *HOST_FLAGS, "-O2"))
    assert found["counter"] in "BbC" and "U" in {found.get("printf"), found.get("putchar")}


@pytest.mark.parametrize("precision", PRECISIONS)
def test_every_header_in_one_cpp_program(workshop: Workshop, precision):
    """C++ takes each header, twice, first of all, and all of them together: no symbol of one is another's."""
    need("g++")
    files, lines = {}, []
    for spec in SHIPPED:
        name = interface(spec, precision).name
        files[f"{name}.h"] = sources(spec, precision)[f"{name}.h"]
        lines += [f'#include "{name}.h"'] * 2
    for spec in SHIPPED:
        name = interface(spec, precision).name
        lines += [f"void use_{name}() {{ {name}_state s; {name}_inputs i = {name}_inputs(); {name}_outputs o;"]
        lines += [f"const {name}_parameters p = {name.upper()}_PARAMETERS;"]
        lines += [f"{name}_init(&s, &p, &i); {name}_step(&s, &p, &i, &o); }}"]
    folder = workshop.unpack(files | {"all.cpp": "\n".join(lines) + "\n"})
    done = run(
        "g++", "-std=c++11", "-pedantic", "-Wall", "-Wextra", "-Werror", "-c", folder / "all.cpp", "-o", "/dev/null"
    )
    assert done.returncode == 0, done.stderr
