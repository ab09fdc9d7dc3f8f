"""The cancelling input in generated C and Python: the same bits, the right numbers, nothing where none is asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from codegen.app.derived import Derived
from codegen.cancellation import with_cancellation
from codegen.emit.package import emit_sources, make_header
from codegen.observers import observer_of
from codegen.program import build_program
from codegen.replay.engine import Engine
from codegen.spec import parse_spec
from tests.machines import machine_text, read
from tests.twin import TwinEngine

from .test_best_input import ENVELOPE, INPUTS_OF_X, MASS_OF_X, numbers, smallest_best

SPECS = Path(__file__).parents[2] / "specs"
U_OF_X = [["1", "0"], ["-cos(x2)", "1"], ["0", "sin(x1)"]]


def run_both(text: str, rows: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Names of the outputs, and the outputs of C, equal to the twin's to the bit; (N, outputs)."""
    spec = read(text)
    program = build_program(with_cancellation(spec, observer_of(spec)))
    files = emit_sources(program, make_header("machine.yaml", "0" * 64, ""))
    found = []
    for engine in (Engine(program, files), TwinEngine(program, files)):
        engine.start(rows[0])
        found.append(engine.run(rows)[0])
    assert found[0].tobytes() == found[1].tobytes()
    return [name for name, _, _ in program.outputs], found[0]


@pytest.mark.parametrize("name", ["tall", "wide", "dependent"])
def test_c_and_twin_compute_the_best_input_in_the_same_bits(name):
    text = machine_text(MASS_OF_X, INPUTS_OF_X[name], U_OF_X, "{gain: 0.75}", "mgto", ENVELOPE)
    r = len(INPUTS_OF_X[name][0])
    generator = np.random.default_rng(5)
    rows = np.hstack([generator.uniform(-0.5, 0.5, (200, 6)), generator.normal(size=(200, r))])
    names, found = run_both(text, rows)
    column = {name: k for k, name in enumerate(names)}
    for k in range(0, 200, 40):
        at = {"x1": rows[k, 0], "x2": rows[k, 1]}
        friction = np.array([found[k, column[f"F_hat_on_x{i + 1}"]] for i in range(3)])
        best = smallest_best(numbers(INPUTS_OF_X[name], at), numbers(MASS_OF_X, at), friction, "mass_inverse")
        assert [found[k, column[f"u_cancel_w{j + 1}"]] for j in range(r)] == pytest.approx(0.75 * best, rel=1e-9)


def test_appendix_b_leaves_an_input_at_zero():
    text = machine_text([[1, 0], [0, 2]], [[1, 2, 0], [0, 1, 1]], [[1, 0], [0, 1]], "{method: appendix_b}")
    names, found = run_both(text, np.random.default_rng(1).normal(size=(50, 7)))
    inputs = found[:, [names.index(f"u_cancel_w{j + 1}") for j in range(3)]]
    assert list(np.all(inputs == 0, axis=0)).count(True) == 1


def test_the_input_does_not_depend_on_the_sample_s_own_input():
    text = machine_text(MASS_OF_X, INPUTS_OF_X["tall"], U_OF_X, "{}", "mgto", ENVELOPE)
    rows = np.random.default_rng(2).uniform(-0.4, 0.4, (3, 8))
    other = rows.copy()
    other[-1, 6:] += 100.0
    names, found = run_both(text, rows)
    chosen = [k for k, name in enumerate(names) if name.startswith("u_cancel")]
    assert np.array_equal(found[:, chosen], run_both(text, other)[1][:, chosen])


def test_the_section_changes_nothing_else():
    """The states stay; only what the section adds is new."""
    path = SPECS / "two_mass.yaml"
    plain = parse_spec(path.read_text(encoding="utf-8"), path)
    asked = parse_spec(plain.text + "\ncancellation: {gain: 0.9}\n", path)
    without, with_it = Derived(plain).program, Derived(asked).program
    assert [str(e) for e in with_it.next_state] == [str(e) for e in without.next_state]
    assert [o for o in with_it.outputs if "cancel" not in o[0]] == list(without.outputs)
    assert {p.name for p in with_it.parameters} - {p.name for p in without.parameters} == {"cancellation_gain"}
    assert "cancel" not in "".join(Derived(plain).files.values())


def test_the_section_changes_no_estimate_of_an_implicit_step():
    """The equations that are solved for the input are no part of the step, which solves M a = g - F for a."""
    text = machine_text(MASS_OF_X, INPUTS_OF_X["tall"], U_OF_X, "{gain: 0.75}", "mgto", ENVELOPE)
    text = text.replace("sample_time: 0.001", "sample_time: 0.001, integration: implicit")
    rows = np.random.default_rng(3).uniform(-0.4, 0.4, (50, 8))
    names, found = run_both(text, rows)
    without, plain = run_both(text.replace("cancellation: {gain: 0.75}", ""), rows)
    assert np.array_equal(found[:, [names.index(name) for name in without]], plain)


def test_single_precision_has_the_input_too():
    text = (SPECS / "two_mass.yaml").read_text(encoding="utf-8") + "cancellation: {}\ncode: {precision: single}\n"
    machine = Derived(parse_spec(text, SPECS / "two_mass.yaml"))
    program, files = machine.program, machine.files
    assert "u_cancel_w" in [name for name, _, _ in program.outputs]
    assert "float u_cancel_w;" in files["two_mass.h"] and "double" not in files["two_mass.h"]
