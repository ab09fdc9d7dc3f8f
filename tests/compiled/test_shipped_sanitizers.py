"""AddressSanitizer and UBSan over every shipped spec: random, reversing, standing, saturated, huge, NaN, Inf inputs."""

from __future__ import annotations

import re
import subprocess

import numpy as np
import pytest

from .driver import HARNESS, driver_files, load
from .interface import Interface, read_interface
from .lane_driver import lane_files
from .shipped import PRECISIONS, REPRESENTATIVE, SHIPPED, excitation, interface, sources
from .signals import broken, broken_at_first, hostile, huge, ordinary
from .toolchain import GCC, NO_CONTRACTION, STRICT, Workshop

SANITIZERS = ("-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all", "-g", "-O1")
EPISODE = 512
HOSTILE = 20_000


def sanitized(
    workshop: Workshop, files, spec: str, precision: str, rows: np.ndarray, face: Interface | None = None
) -> subprocess.CompletedProcess:
    face = face or interface(spec, precision)
    beside = driver_files(files, face, HARNESS / "stream.c")
    flags = (*STRICT, NO_CONTRACTION, *SANITIZERS)
    parts = [workshop.object(beside, "stream.c", GCC, *flags), workshop.object(files, f"{face.name}.c", GCC, *flags)]
    program = workshop.link(f"{face.name}.sanitized", GCC, *SANITIZERS, *parts, "-lm")
    return subprocess.run([program, str(EPISODE)], input=rows.tobytes(), capture_output=True, check=False)


def sanitized_lanes(workshop: Workshop, spec: str, precision: str, rows: np.ndarray) -> subprocess.CompletedProcess:
    face, files = interface(spec, precision), lane_files(spec, precision)
    beside = driver_files(sources(spec, precision), face, HARNESS / "lane_stream.c")
    flags = ("-std=c99", NO_CONTRACTION, *SANITIZERS)
    parts = [workshop.object(files, c, GCC, *flags) for c in ("driver.c", f"{face.name}_lanes.c")]
    parts += [workshop.object(beside, "lane_stream.c", GCC, *flags)]
    program = workshop.link(f"{face.name}_lanes.sanitized", GCC, *SANITIZERS, *parts, "-lm")
    return subprocess.run([program, str(EPISODE)], input=rows.tobytes(), capture_output=True, check=False)


def rows_of(spec: str, precision: str) -> np.ndarray:
    drive = excitation(spec, precision)
    noise = np.random.default_rng(5).normal(size=(EPISODE, len(drive.channels))).astype(drive.dtype)
    parts = [ordinary(drive, EPISODE), huge(drive, EPISODE), broken(drive, EPISODE), broken_at_first(drive, EPISODE)]
    return np.concatenate([*parts, noise])


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("spec", REPRESENTATIVE)
def test_no_sanitizer_complains(workshop, spec, precision):
    rows, face, files = rows_of(spec, precision), interface(spec, precision), sources(spec, precision)
    done = sanitized(workshop, files, spec, precision, rows)
    assert done.returncode == 0 and done.stderr == b"", done.stderr.decode()
    outputs = np.frombuffer(done.stdout, rows.dtype).reshape(len(rows), -1)
    plain = load(workshop, files, face, GCC, "-O2")
    plain.start(rows[0])
    assert outputs[:EPISODE].tobytes() == plain.run(rows[:EPISODE])[0].tobytes()


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["hold", "none"])
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("spec", SHIPPED)
def test_no_sanitizer_complains_of_hostile_inputs(workshop, spec, precision, fault):
    """With ``hold``, every estimate besides is a number, whatever came in."""
    files = sources(spec, precision, fault)
    face = read_interface(interface(spec, precision).name, files[f"{interface(spec, precision).name}.h"])
    rows = hostile(excitation(spec, precision), HOSTILE)
    done = sanitized(workshop, files, spec, precision, rows, face)
    assert done.returncode == 0 and done.stderr == b"", done.stderr.decode()
    outputs = np.frombuffer(done.stdout, rows.dtype)
    assert len(outputs) == HOSTILE * len(face.elements("outputs"))
    assert fault == "none" or np.isfinite(outputs).all()


@pytest.mark.slow
@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("spec", SHIPPED)
def test_no_sanitizer_complains_of_hostile_inputs_in_lanes(workshop, spec, precision):
    """And the last lane has the bits of the scalar code."""
    rows = hostile(excitation(spec, precision), HOSTILE // 10)
    done = sanitized_lanes(workshop, spec, precision, rows)
    assert done.returncode == 0 and done.stderr == b"", done.stderr.decode()
    assert done.stdout == sanitized(workshop, sources(spec, precision), spec, precision, rows).stdout


@pytest.mark.slow
@pytest.mark.parametrize("spec", SHIPPED)
def test_no_sanitizer_complains_of_an_example(workshop, spec):
    files, rows = sources(spec), hostile(excitation(spec), 400)
    parts = [
        workshop.object(files, c, GCC, "-std=c99", *SANITIZERS) for c in ("example_main.c", f"{interface(spec).name}.c")
    ]
    example = workshop.link(f"{interface(spec).name}.example", GCC, *SANITIZERS, *parts, "-lm")
    text = " ".join(repr(float(number)) for number in rows.ravel())
    done = subprocess.run([example], input=text.encode(), capture_output=True, check=False)
    assert done.returncode == 0 and done.stderr == b"", done.stderr.decode()
    assert done.stdout.count(b"\n") == len(rows)


@pytest.mark.parametrize(
    "fault",
    [
        "((double *)state)[sizeof *state / sizeof(double)] = 0.0;",
        "int shift = 31 + (inputs->x1 < 1e9); (void)(1 << shift);",
        "static double *gone; gone = gone + (inputs->x1 > 1e9); *gone = 1.0;",
    ],
    ids=["beside the state", "undefined shift", "null"],
)
def test_a_fault_is_noticed(workshop, fault):
    files, rows = dict(sources("two_mass")), rows_of("two_mass", "double")
    files["two_mass.c"], count = re.subn(
        r"(void two_mass_step\([^)]*\)\s*\{)", lambda m: f"{m[1]}\n    {fault}", files["two_mass.c"]
    )
    assert count == 1
    assert sanitized(workshop, files, "two_mass", "double", rows).returncode != 0
