"""Libraries around the generated C: complete, compiled and run."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from tests.app.command import SPECS, is_one_message, stiction

ROOT = SPECS.parent
LARGER = ("two_mass", "chain")
"""With several coordinates, and with arrays."""
ARDUINO_H = """
#include <math.h>
#include <stdint.h>
extern "C" unsigned long micros(void);
struct SerialPort { void begin(long); void print(const char *); void println(float); void println(int); };
extern SerialPort Serial;
"""
BOARD = r"""
#include "Arduino.h"
#include <stdio.h>
static unsigned long now = 4294960000UL; /* it runs over after seven samples */
unsigned long micros(void) { return (now += 250UL) & 0xffffffffUL; }
SerialPort Serial;
void SerialPort::begin(long) {}
void SerialPort::print(const char *text) { printf("%s", text); }
void SerialPort::println(float value) { printf("%.9g\n", (double)value); }
void SerialPort::println(int value) { printf("%d\n", value); }
extern void setup();
extern void loop();
int main() { setup(); for (int k = 0; k < 1000; k++) loop(); return 0; }
"""
WARNINGS = ["-Wall", "-Wextra", "-Werror", "-Wdouble-promotion"]


def exported(folder: Path, spec: str = "one_mass", to: str = "arduino") -> None:
    done = stiction("export", SPECS / f"{spec}.yaml", "--to", to, "-o", folder)
    assert done.code == 0, done.err


def compiled(command: list[object]) -> None:
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("spec", ["one_mass", pytest.param("two_mass", marks=pytest.mark.slow)])
def test_the_arduino_library_builds_and_its_example_runs(tmp_path: Path, spec: str) -> None:
    """The sketch as the IDE makes it: Arduino.h before it, compiled as C++; the library's C as C."""
    if shutil.which("g++") is None:
        pytest.skip("no g++")
    library = tmp_path / "library"
    exported(library, spec)
    (tmp_path / "Arduino.h").write_text(ARDUINO_H)
    (tmp_path / "board.cpp").write_text(BOARD)
    sketch = (library / f"examples/{spec}_serial/{spec}_serial.ino").read_text()
    (tmp_path / "sketch.cpp").write_text('#include "Arduino.h"\n' + sketch)
    folders = ["-I", tmp_path, "-I", library / "src"]
    compiled(["cc", "-std=c99", *WARNINGS, "-c", library / f"src/{spec}.c", "-o", tmp_path / "c.o"])
    compiled(
        [
            "g++",
            "-std=c++11",
            *WARNINGS,
            *folders,
            tmp_path / "sketch.cpp",
            tmp_path / "board.cpp",
            tmp_path / "c.o",
            "-o",
            tmp_path / "run",
        ]
    )
    printed = subprocess.run([tmp_path / "run"], capture_output=True, text=True, check=True).stdout
    assert printed.count("fault 0") == printed.count("fault") == 2  # 250 samples, each hundredth printed
    assert "nan" not in printed


def test_a_name_that_a_sketch_has_for_a_number_is_refused(tmp_path: Path) -> None:
    """binary.h of the Arduino core has `#define B1 1`: the struct of the header had a field called 1."""
    text = (SPECS / "one_mass.yaml").read_text("utf-8").replace("m: {value", "B1: {value").replace("[m]", "[B1]")
    (spec := tmp_path / "b.yaml").write_text(text)
    done = stiction("export", spec, "--to", "arduino", "-o", tmp_path / "library")
    assert done.code == 2 and is_one_message(done)
    assert "`B1`" in done.err and "did you mean 'B1_1'?" in done.err


def test_the_arduino_library_is_what_its_formats_ask_for(tmp_path: Path) -> None:
    library = tmp_path / "library"
    exported(library)
    lines = [line.partition("=") for line in (library / "library.properties").read_text().splitlines()]
    properties = {key: value for key, _, value in lines}
    needed = {"name", "version", "author", "maintainer", "sentence", "paragraph", "category", "url", "architectures"}
    assert needed <= set(properties) and properties["includes"] == "one_mass.h"
    package = json.loads((library / "library.json").read_text())
    assert package["headers"] == "one_mass.h" and (library / "src" / package["headers"]).is_file()
    listed = json.loads((library / "manifest.json").read_text())["files"]
    found = {p.relative_to(library).as_posix() for p in library.rglob("*") if p.is_file()}
    assert found == {*listed, "manifest.json"}
    assert "Certified rate" in (library / "README.md").read_text()


def test_the_library_s_code_is_the_single_precision_that_generate_writes(tmp_path: Path) -> None:
    """Whose bits, warnings and faults tests/compiled examines."""
    library, code = tmp_path / "library", tmp_path / "code"
    exported(library)
    assert stiction("generate", SPECS / "one_mass.yaml", "--precision", "single", "-o", code).code == 0
    for name in ("one_mass.h", "one_mass.c"):
        text = (library / "src" / name).read_text()
        assert text == (code / name).read_text()
        assert "double" not in re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL)


@pytest.mark.parametrize("spec", ["one_mass", *(pytest.param(name, marks=pytest.mark.slow) for name in LARGER)])
def test_the_simulink_block_has_the_bits_of_the_plain_c(tmp_path: Path, spec: str) -> None:
    """Outputs asked for twice a sample, and one sample that is not a number; beside example_main.c of `generate`."""
    block, code = tmp_path / "block", ROOT / "generated" / spec
    exported(block, spec, "simulink")
    strict = ["-std=c99", "-ffp-contract=off", "-Wall", "-Wextra", "-Wno-unused-macros", "-Werror"]
    own, plain = tmp_path / "own", tmp_path / "plain"
    stand_in = Path(__file__).parent
    compiled(
        ["cc", *strict, "-I", stand_in, "-I", block, block / f"{spec}_sfun.c", block / f"{spec}.c", "-lm", "-o", own]
    )
    compiled(["cc", *strict, code / "example_main.c", code / f"{spec}.c", "-lm", "-o", plain])
    for name in (f"{spec}.h", f"{spec}.c"):
        assert _code((block / name).read_text()) == _code((code / name).read_text())
    wide = {"one_mass": 2, "two_mass": 3, "chain": 17}[spec]
    rng = np.random.default_rng(4)
    samples = np.cumsum(rng.normal(0, 1e-3, (300, wide)), axis=0)
    text = "\n".join(" ".join(f"{v:.17g}" for v in row) for row in samples).splitlines()
    text[150] = " ".join(["nan"] * wide)
    runs = [
        subprocess.run([program], input="\n".join(text), capture_output=True, text=True, check=True).stdout.split()
        for program in (own, plain)
    ]
    assert len(runs[0]) % 300 == 0 and runs[0] == runs[1]
    assert runs[0][len(runs[0]) // 300 * 151 - 1] == "1"


def _code(text: str) -> str:
    return re.sub(r"/\*.*?\*/", " ", text, flags=re.DOTALL)


def test_a_folder_of_another_is_kept(tmp_path: Path) -> None:
    (tmp_path / "README.md").write_text("mine")
    assert is_one_message(stiction("export", SPECS / "one_mass.yaml", "--to", "arduino", "-o", tmp_path))
    assert [p.name for p in tmp_path.iterdir()] == ["README.md"]
    library = tmp_path / "library"
    exported(library)
    exported(library)


@pytest.mark.parametrize("file", ["README.md", "manifest.json"])
def test_an_edited_file_is_kept(tmp_path: Path, file: str) -> None:
    library = tmp_path / "library"
    exported(library)
    edited = (library / file).read_text("utf-8").replace("0.1.0", "0.1.1", 1).replace("# ", "# my ", 1)
    (library / file).write_text(edited, "utf-8")
    result = stiction("export", SPECS / "one_mass.yaml", "--to", "arduino", "-o", library)
    assert is_one_message(result) and "[FILE008]" in result.err and f"{file}, edited" in result.err
    assert (library / file).read_text("utf-8") == edited
