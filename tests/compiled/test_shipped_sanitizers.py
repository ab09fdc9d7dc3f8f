"""AddressSanitizer and UBSan over every shipped spec: random, reversing, standing, saturated, huge, NaN, Inf inputs."""

from __future__ import annotations

import re
import subprocess

import numpy as np
import pytest

from .driver import HARNESS, driver_files, load
from .shipped import PRECISIONS, SHIPPED, excitation, interface, sources
from .signals import broken, broken_at_first, huge, ordinary
from .toolchain import GCC, NO_CONTRACTION, STRICT, Workshop

SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g", "-O1")
EPISODE = 512


def sanitized(workshop: Workshop, files, spec: str, precision: str, rows: np.ndarray) -> subprocess.CompletedProcess:
    face = interface(spec, precision)
    beside = driver_files(files, face, HARNESS / "stream.c")
    flags = (*STRICT, NO_CONTRACTION, *SANITIZERS)
    parts = [workshop.object(beside, "stream.c", GCC, *flags), workshop.object(files, f"{face.name}.c", GCC, *flags)]
    program = workshop.link(f"{face.name}.sanitized", GCC, *SANITIZERS, *parts, "-lm")
    return subprocess.run([program, str(EPISODE)], input=rows.tobytes(), capture_output=True, check=False)


def rows_of(spec: str, precision: str) -> np.ndarray:
    drive = excitation(spec, precision)
    noise = np.random.default_rng(5).normal(size=(EPISODE, len(drive.channels))).astype(drive.dtype)
    parts = [ordinary(drive, EPISODE), huge(drive, EPISODE), broken(drive, EPISODE), broken_at_first(drive, EPISODE)]
    return np.concatenate([*parts, noise])


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("spec", SHIPPED)
def test_no_sanitizer_complains(workshop, spec, precision):
    rows, face, files = rows_of(spec, precision), interface(spec, precision), sources(spec, precision)
    done = sanitized(workshop, files, spec, precision, rows)
    assert done.returncode == 0 and done.stderr == b"", done.stderr.decode()
    outputs = np.frombuffer(done.stdout, rows.dtype).reshape(len(rows), -1)
    plain = load(workshop, files, face, GCC, "-O2")
    plain.start(rows[0])
    assert outputs[:EPISODE].tobytes() == plain.run(rows[:EPISODE])[0].tobytes()


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
