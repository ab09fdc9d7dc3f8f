"""The single-precision observers on an emulated Cortex-M4F: the host's bits, no double helper, a step's cost."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest

from .cortex_m.image import HERE, QEMU, build, count_calls, emulate, figures
from .driver import HARNESS, HOST_FLAGS, driver_files
from .interface import Interface
from .shipped import SHIPPED, excitation, interface, sources
from .signals import broken, broken_at_first, huge, ordinary
from .test_shipped_warnings import SOFTWARE_DOUBLE
from .toolchain import GCC, Workshop, need, symbols

EPISODE = 64
QUICK = ("two_mass", "two_link_arm", "thesis/two_mass_gdfo")
EVERY = [spec if spec in QUICK else pytest.param(spec, marks=pytest.mark.slow) for spec in SHIPPED]


@pytest.fixture(autouse=True)
def tools():
    need("arm-none-eabi-gcc", "qemu-system-arm")


def rows_of(spec: str, samples: int = EPISODE) -> np.ndarray:
    drive = excitation(spec, "single")
    parts = [ordinary(drive, samples * 5), *(huge(drive, samples, seed) for seed in range(4)), broken(drive, samples)]
    return np.concatenate([*parts, broken_at_first(drive, samples)])


def host_outputs(workshop: Workshop, files, face: Interface, rows: np.ndarray, own_trigonometry: bool) -> np.ndarray:
    """A program of its own, so that its sinf comes before the C library's."""
    beside = driver_files(files, face, HARNESS / "stream.c", *HERE.glob("*.[ch]"))
    units = ["stream.c"] + ["trigonometry.c"] * own_trigonometry
    objects = [workshop.object(beside, unit, GCC, *HOST_FLAGS, "-O1") for unit in units]
    objects.append(workshop.object(files, f"{face.name}.c", GCC, *HOST_FLAGS, "-O2"))
    program = workshop.link(f"{face.name}.stream", GCC, *objects, "-lm")
    done = subprocess.run([program, str(EPISODE)], input=rows.tobytes(), capture_output=True, check=True)
    return np.frombuffer(done.stdout, rows.dtype).reshape(len(rows), -1)


def both(workshop: Workshop, spec: str, own_trigonometry: bool, files=None) -> tuple[np.ndarray, np.ndarray]:
    """(target, host) outputs."""
    given, face, rows = sources(spec, "single"), interface(spec, "single"), rows_of(spec)
    image = build(workshop, files or given, face, rows, EPISODE, own_trigonometry=own_trigonometry)
    return emulate(image, face), host_outputs(workshop, given, face, rows, own_trigonometry)


@pytest.mark.parametrize("spec", EVERY)
def test_the_target_computes_the_bits_of_the_host(workshop, spec):
    target, host = both(workshop, spec, own_trigonometry=True)
    assert target.dtype == host.dtype == np.float32
    assert target.tobytes() == host.tobytes()
    assert np.all(np.isfinite(target)) and np.all(np.std(target[:EPISODE, :2], axis=0) > 0)


@pytest.mark.parametrize("spec", ["two_link_arm", "seven_joint_arm"])
def test_with_the_libm_of_each_side_the_outputs_are_near(workshop, spec):
    target, host = both(workshop, spec, own_trigonometry=False)
    target, host = target[: 5 * EPISODE], host[: 5 * EPISODE]
    scale = np.max(np.abs(host), axis=0)
    assert np.all(np.abs(target - host) <= 2e-3 * scale + 1e-6)


@pytest.mark.parametrize("spec", EVERY)
def test_no_double_helper_in_the_whole_image(workshop, spec):
    files, face, rows = sources(spec, "single"), interface(spec, "single"), rows_of(spec)
    image = build(workshop, files, face, rows, EPISODE)
    found = symbols(image, "arm-none-eabi-nm")
    assert not [s for s in found if SOFTWARE_DOUBLE.match(s)]
    assert not [s for s in found if s in ("malloc", "_sbrk", "printf")]


def test_a_changed_bit_is_noticed(workshop):
    files = dict(sources("two_mass", "single"))
    files["two_mass.c"] = files["two_mass.c"].replace("inputs->x1", "(inputs->x1 * 1.00000012F)")
    target, host = both(workshop, "two_mass", own_trigonometry=True, files=files)
    assert target.tobytes() != host.tobytes()


def test_contraction_is_noticed(workshop):
    """The M4F has a fused multiply-add: with it the bits are others, so the comparison sees it."""
    files, face, rows = sources("two_mass", "single"), interface("two_mass", "single"), rows_of("two_mass")
    image = build(workshop, files, face, rows, EPISODE, ("-O2", "-std=gnu99", "-ffp-contract=fast"))
    host = host_outputs(workshop, files, face, rows, own_trigonometry=False)
    assert emulate(image, face).tobytes() != host.tobytes()


def test_a_fault_of_the_target_is_an_error(workshop):
    files = dict(sources("two_mass", "single"))
    files["two_mass.c"] = files["two_mass.c"].replace("inputs->x1", "(*(const volatile float *)0xF0000000u)")
    face, rows = interface("two_mass", "single"), rows_of("two_mass")
    with pytest.raises(RuntimeError, match="fault"):
        emulate(build(workshop, files, face, rows, EPISODE), face)


@pytest.mark.parametrize("spec", ["two_mass", pytest.param("seven_joint_arm", marks=pytest.mark.slow)])
def test_cost_of_a_step(workshop, spec):
    files, face = sources(spec, "single"), interface(spec, "single")
    found = figures(workshop, files, face, ordinary(excitation(spec, "single"), 40))
    assert found.calls_libm == (spec == "seven_joint_arm")
    assert len(face.elements("outputs")) < found.mean_instructions <= found.instructions
    # two bytes an instruction at least; each is executed about once in straight-line code
    used = found.step_bytes - found.unused_bytes + found.library_bytes
    assert found.unused_bytes > 0 and found.instructions < used < 8 * found.instructions


def test_instructions_are_counted_one_by_one(workshop):
    """A step of known length: an empty one is a single branch back to the caller."""
    files, face, rows = dict(sources("two_mass", "single")), interface("two_mass", "single"), rows_of("two_mass")[:10]
    header = files["two_mass.h"]
    files["two_mass.c"] = (
        '#include "two_mass.h"\n'
        "void two_mass_init(two_mass_state *s, const two_mass_parameters *p, const two_mass_inputs *i) {}\n"
        "void two_mass_prepare(two_mass_parameters *p) {}\n"
        "void two_mass_step(two_mass_state *s, const two_mass_parameters *p, const two_mass_inputs *i,"
        ' two_mass_outputs *o) { __asm__ volatile("nop\\n nop\\n nop\\n vadd.f32 s0, s0, s0"); }\n'
    )
    assert "two_mass_prepare" in header
    image = build(workshop, files, face, rows, len(rows), quiet=True)
    assert list(count_calls(image, "two_mass_step", "main")) == [5] * len(rows)
    assert QEMU[2] == "mps2-an386"
