"""The emitted CMakeLists.txt and NAME.mk build the observer and its example; the header is also C++."""

from __future__ import annotations

import subprocess

import pytest

from tests.slow_cases import slow_except

from .shipped import interface, sources
from .toolchain import need

SPECS = ("two_mass", "chain")


def run(*words: str, cwd: str) -> None:
    done = subprocess.run(words, cwd=cwd, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(params=slow_except(SPECS, SPECS[:1]))
def folder(request, tmp_path):
    for name, text in sources(request.param).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path, interface(request.param)


def test_cmake_builds_the_example(folder):
    where, face = folder
    need("cmake")
    run("cmake", "-S", ".", "-B", "build", cwd=where)
    run("cmake", "--build", "build", cwd=where)
    sample = " ".join(["0.25"] * len(face.elements("inputs")))
    done = subprocess.run(
        [where / "build" / f"{face.name}_example"], input=sample, capture_output=True, text=True, check=True
    )
    assert len(done.stdout.split()) == len(face.elements("outputs"))


def test_a_project_of_ones_own_links_the_target(folder):
    where, face = folder
    need("cmake")
    own = where / "own"
    own.mkdir()
    (own / "main.c").write_text(f'#include "{face.name}.h"\nint main(void) {{ return 0; }}\n')
    (own / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.13)\nproject(own C)\nadd_subdirectory(.. observer)\n"
        f"add_executable(own main.c)\ntarget_link_libraries(own PRIVATE {face.name}_observer)\n"
    )
    run("cmake", "-S", ".", "-B", "build", cwd=own)
    run("cmake", "--build", "build", "--target", "own", cwd=own)


def test_make_builds_from_the_fragment(folder):
    where, face = folder
    n = face.name
    (where / "Makefile").write_text(
        f"include {n}.mk\nexample: example_main.c $({n}_SOURCES)\n\t$(CC) $({n}_CFLAGS) -o $@ $^ $({n}_LIBS)\n"
    )
    run("make", "example", cwd=where)
    assert (where / "example").is_file()


def test_two_instances_in_cpp_do_not_share_anything(folder):
    where, face = folder
    need("g++")
    n, first = face.name, face.elements("inputs")[0]
    output = face.elements("outputs")[0]
    (where / "main.cpp").write_text(
        f'''#include "{n}.h"
static double alone(double x, double other, bool both) {{
    const {n}_parameters p = {n.upper()}_PARAMETERS;
    {n}_state a, b; {n}_inputs u = {{}}, v = {{}}; {n}_outputs ya = {{}}, yb = {{}};
    u.{first} = x; v.{first} = other;
    {n}_init(&a, &p, &u); {n}_init(&b, &p, &v);
    for (int k = 1; k < 50; k++) {{
        u.{first} = x * k; v.{first} = other * k;
        {n}_step(&a, &p, &u, &ya);
        if (both) {n}_step(&b, &p, &v, &yb);
    }}
    return ya.{output};
}}
int main() {{ return alone(0.01, -3.0, true) == alone(0.01, 0.0, false) && alone(0.01, 0.0, false) != 0.0 ? 0 : 1; }}
'''
    )
    run("gcc", "-std=c99", "-c", f"{n}.c", cwd=where)
    run(
        "g++",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-Wno-missing-field-initializers",
        "-o",
        "both",
        "main.cpp",
        f"{n}.o",
        "-lm",
        cwd=where,
    )
    run(str(where / "both"), cwd=where)
