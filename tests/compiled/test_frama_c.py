"""Frama-C's Eva: a step of the generated C makes no NaN and no infinity, and no undefined behaviour.

From any state and any samples below a bound that a caller may clamp to, with the spec's parameters; by interval
analysis over all of them at once, not by runs.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import pytest

from .shipped import PRECISIONS, SHIPPED, program, sources
from .toolchain import need

LARGEST = {"double": 1e12, "single": 1e6}
POSITIONS = 1e3
"""Of x and v, in m, rad and per second."""
ALARMS = re.compile(r"^\s*(\d+) alarms? generated", re.MULTILINE)
UNDECIDED = {
    "one_mass_dfo_implicit": "the determinant of its Newton step: its range over all states does not leave out zero",
    "seven_joint_arm": "sines and an LDL' solve: the ranges of its pivots are not seen to leave out zero",
}


def driver(spec: str, precision: str, largest: float) -> str:
    """A main that makes one step from anything."""
    made = program(spec, precision)
    name, any_of = made.name, "Frama_C_double_interval" if precision == "double" else "Frama_C_float_interval"

    def anything(struct: str, field: str, size: float) -> str:
        suffix = "f" if precision == "single" else ""
        return f"    {struct}.{made.reference(field)} = {any_of}(-{size!r}{suffix}, {size!r}{suffix});"

    moving = {f.name for f in made.inputs if f.meaning.startswith("measured")}
    lines = [f'#include "{name}.h"', '#include "__fc_builtin.h"', "int main(void)", "{"]
    lines += [f"    {name}_parameters parameters = {name.upper()}_PARAMETERS;", f"    {name}_state state;"]
    lines += [f"    {name}_inputs inputs;", f"    {name}_outputs outputs;"]
    lines += [anything("inputs", f.name, POSITIONS if f.name in moving else largest) for f in made.inputs]
    lines += [f"    {name}_init(&state, &parameters, &inputs);"]
    lines += [anything("state", f.name, largest) for f in made.states]
    lines += [f"    {name}_prepare(&parameters);", f"    {name}_step(&state, &parameters, &inputs, &outputs);"]
    return "\n".join([*lines, "    return outputs.fault;", "}", ""])


def alarms(folder: Path, spec: str, precision: str, largest: float, change: tuple[str, str] = ("", "")) -> int:
    name = program(spec, precision).name
    texts = sources(spec, precision)
    for file in (f"{name}.h", f"{name}.c"):
        (folder / file).write_text(texts[file].replace(*change) if change[0] else texts[file])
    (folder / "driver.c").write_text(driver(spec, precision, largest))
    command = ["frama-c", "-eva", "-eva-precision", "2", "-warn-special-float", "non-finite", "-eva-no-print"]
    done = subprocess.run(
        [*command, f"-cpp-extra-args=-I{folder}", *[str(folder / file) for file in ("driver.c", f"{name}.c")]],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    found = ALARMS.search(done.stdout)
    assert done.returncode == 0 and found is not None, done.stdout[-3000:] + done.stderr
    assert "functions analyzed (out of" in done.stdout
    return int(found.group(1))


@pytest.fixture(autouse=True)
def _frama_c() -> None:
    need("frama-c")


@pytest.mark.slow
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("spec", [s for s in SHIPPED if Path(s).name not in UNDECIDED])
def test_no_step_makes_a_nan_or_an_infinity(tmp_path: Path, spec: str, precision: str) -> None:
    assert alarms(tmp_path, spec, precision, LARGEST[precision]) == 0


@pytest.mark.slow
@pytest.mark.parametrize("spec", [s for s in SHIPPED if Path(s).name in UNDECIDED])
def test_what_is_not_decided_is_still_not(tmp_path: Path, spec: str) -> None:
    assert alarms(tmp_path, spec, "double", LARGEST["double"]) > 0


def test_what_may_overflow_is_seen(tmp_path: Path) -> None:
    """The same with numbers whose products overflow, and with a division that the code does not have."""
    assert alarms(tmp_path, "one_mass", "double", 1e12) == 0
    assert alarms(tmp_path, "one_mass", "double", 1e308) > 0
    assert alarms(tmp_path, "one_mass", "double", 1e12, ("parameters->one_over_m * (", "1.0 / v_hat * (")) > 0
