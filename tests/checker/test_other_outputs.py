"""Outputs beside the estimates, such as a friction force: what verify says that they are, and which it leaves open."""

from __future__ import annotations

import hashlib
import importlib
import json
import math
import random
import re
from dataclasses import fields
from fractions import Fraction
from math import prod
from typing import Any

import pytest

from codegen.checker import kernel, theorem, verify
from tests.checker.forged import changed, check, sources
from tests.slow_cases import slow_except

FORCE = "outputs->F_hat_rail = F_hat_rail;"
FORGED = {
    "a force that is not set": "",
    "a number": "outputs->F_hat_rail = 3.0;",
    "a force that rounding replaces": "outputs->F_hat_rail = F_hat_rail + 1e12 * v_hat - 1e12 * v_hat;",
    "a force as of a sine": "outputs->F_hat_rail = F_hat_rail + sin(v_hat);",
}
OTHER = {
    "twice the force": ("outputs->F_hat_rail = 2.0 * F_hat_rail;", "F_hat_rail = 2*a_hat_rail*sign(rail)"),
    "the other direction": ("outputs->F_hat_rail = -F_hat_rail;", "F_hat_rail = -a_hat_rail*sign(rail)"),
    "a force that moves with the slip": (
        "outputs->F_hat_rail = F_hat_rail - 0.5 * v_hat;",
        "F_hat_rail = a_hat_rail*sign(rail) - 0.5*v_hat",
    ),
}


def said(report: verify.Report) -> tuple[dict[str, str], list[str]]:
    """(output → its formula, outputs that are named as not covered)."""
    pairs = [re.fullmatch(r"in each sample (\w+(?:\[\d+\])?) = (.*)", line) for line in report.proved]
    (gaps,) = (line for line in report.proved if "not covered: " in line)
    others = re.search(r"other outputs \((.*?)\)", gaps)
    return {p[1]: p[2] for p in pairs if p}, others[1].split(", ") if others else []


def numbers(of: str, holder: Any) -> dict[str, kernel.Poly]:
    """Place of each number in a structure of the twin, such as outputs.v_hat[2] → its value."""
    found = {}
    for f in fields(holder):
        value = getattr(holder, f.name)
        entries = enumerate(value) if isinstance(value, list) else [(None, value)]
        found |= {f"{of}.{f.name}" + ("" if k is None else f"[{k}]"): kernel.term(Fraction(x)) for k, x in entries}
    return found


@pytest.mark.parametrize("why", FORGED)
def test_a_forged_force_is_named_as_not_covered(why: str) -> None:
    """Nothing was said of it: F_hat_rail, the friction estimate, could be anything under exit status 0."""
    formulas, others = said(check(*changed("one_mass", (FORCE, FORGED[why]))))
    assert others == ["F_hat_rail"] and "F_hat_rail" not in formulas
    assert formulas["F_hat_on_x"] == "a_hat_rail*sign(rail)"


@pytest.mark.parametrize("why", OTHER)
def test_another_force_is_printed_as_what_it_is(why: str) -> None:
    text, formula = OTHER[why]
    formulas, others = said(check(*changed("one_mass", (FORCE, text))))
    assert not others and f"F_hat_rail = {formulas['F_hat_rail']}" == formula


@pytest.mark.parametrize(("name", "value"), [
    ("a_rail", "a_hat_rail"), ("v", "v_hat"), ("m", "v_hat"), ("w", "2*w"), ("z_v", "v_hat"), ("V", "v_hat"),
    ("e", "v_hat"), ("P", "v_hat"), ("sign", "v_hat"), ("abs", "v_hat"), ("fabs", "v_hat"),
])  # fmt: skip
def test_an_output_with_another_name_of_the_words_is_printed_as_an_output(name: str, value: str) -> None:
    """Of an output a_rail verify said "a_rail = a_hat_rail", as if the friction level of the machine were that."""
    of = value.replace("2*", "2.0 * inputs->")
    content, files = changed("one_mass", (FORCE, f"outputs->{name} = {of};\n        {FORCE}"))
    header = files["one_mass.h"].decode()
    field = "    double F_hat_rail; /*"
    assert header.count(field) == 1
    files["one_mass.h"] = header.replace(field, f"    double {name}; /* N: more */\n{field}").encode()
    content["subject"]["files"]["one_mass.h"] = hashlib.sha256(files["one_mass.h"]).hexdigest()
    lines = [line for line in check(content, files).proved if line.startswith("in each sample ")]
    own = "2*inputs.w" if name == "w" else value
    assert f"in each sample outputs.{name} = {own}" in lines
    assert not any(line.startswith(f"in each sample {name} =") for line in lines)


@pytest.mark.parametrize("name", ["one_mass", "two_mass", "two_mass_cancellation", "rig_to", "chain", "two_link_arm"])
def test_the_formulas_are_what_the_twin_computes(name: str) -> None:
    files = sources(name)
    proof = theorem.read(files[theorem.PROOF])
    assert proof is not None
    formulas = theorem.proved(proof, files)["outputs"]
    twin, dice = importlib.import_module(f"generated.{name}"), random.Random(name)

    def drawn() -> Any:
        sizes = ((f.name, getattr(twin.Inputs(), f.name)) for f in fields(twin.Inputs))
        return twin.Inputs(**{x: [dice.uniform(-1, 1) for _ in of] if isinstance(of, list) else dice.uniform(-1, 1)
                              for x, of in sizes})  # fmt: skip

    parameters, inputs, outputs = twin.Parameters(), drawn(), twin.Outputs()
    state = twin.init(parameters, inputs)
    for _ in range(20):
        inputs = drawn()
        twin.step(state, parameters, inputs, outputs)
        at = numbers("parameters", parameters) | numbers("inputs", inputs) | numbers("outputs", outputs)
        text = kernel.Text(at | {"": kernel.term(1)}, {})
        at |= {s: kernel.function("sgn", text.value(of), {}) for s, of in proof["signs"].items()}
        for x, p in formulas.items():
            found = sum(float(c * prod(at[y].constant() for y in m)) for m, c in p.items())
            assert found == pytest.approx(float(at[x].constant()), rel=1e-12, abs=1e-12), x
    assert formulas


FAST, HELD = "-1 + sign(v_hat)*v_hat", "-0.5 + samples_held <= 0"
CALM = "-0.0003 + sign(x - x_predicted)*x - sign(x - x_predicted)*x_predicted <= 0"
LATE, MOVES = "-299.5 + samples_slid >= 0", "v_hat is not 0"
FLAGS = {  # what in_domain is set to -> where verify says that it is not 0
    "in_domain": [MOVES, f"{FAST} > 0", HELD, CALM, LATE],
    "1.0": [],
    "0.5 + 0.5 * in_domain": [],
    "in_domain_2": [MOVES, f"{FAST} > 0", HELD, CALM],
    "learning": [MOVES, f"{FAST} > 0", HELD],
    "1.0 - learning": [],
    "learning_2": [f"{FAST} is not 0"],
    "fabs(learning_2)": [f"{FAST} is not 0"],
    "1.0 - fabs(learning_2)": [f"{FAST} = 0"],
    "0.5 * fabs(learning_2) - 0.5 * learning_2": [f"{FAST} < 0"],
    "1.0 - 0.5 * fabs(learning_2) + 0.5 * learning_2": [f"{FAST} >= 0"],
    "state->x_predicted * (0.5 + in_domain_3)": [LATE],
}


def where(files: dict[str, bytes], content: Any) -> list[str]:
    """The conditions that verify prints for in_domain."""
    begin = "in each sample with fault 0 in_domain is 0 except where "
    lines = [line.removeprefix(begin) for line in check(content, files).proved if line.startswith(begin)]
    return lines[0].split(" and ") if lines else []


QUICK = ["in_domain", "1.0", "learning", "1.0 - fabs(learning_2)", "state->x_predicted * (0.5 + in_domain_3)"]
"""Here and below, further formulas that are read by the same lines are left to `make check-all`: 0.3 s for each C."""


@pytest.mark.parametrize("flag", slow_except([*FLAGS], QUICK))
def test_where_a_flag_is_not_zero_is_said(flag: str) -> None:
    """A C that always sets in_domain to 1 was accepted in the same words as the genuine one."""
    content, files = changed("one_mass_domain", ("outputs->in_domain = in_domain;", f"outputs->in_domain = {flag};"))
    assert where(files, content) == FLAGS[flag]


COUNT, DIRECTION = "const double samples_slid_next = in_domain_2 * ", "direction_rail_next = step_1;"
BY_ROUNDING = [
    "in_domain + (1e12 * v_hat + 0.3 * v_hat) - 1e12 * v_hat - 0.3 * v_hat",
    "in_domain + 1e15 * in_domain_3 + 0.3 * in_domain_3 - 1e15 * in_domain_3 - 0.3 * in_domain_3",
    "in_domain + 0.1 * sign_rail + 0.2 * sign_rail - 0.3 * sign_rail",
    "in_domain + 3.0 * fabs(v_hat) - 3.0 * sign_rail * v_hat",
    "state->x_predicted * (0.3 * fabs(in_domain_3) + 0.1 * in_domain_3 + 0.2 * in_domain_3)",
    "state->x_predicted * (in_domain + 0.1 + 0.2 - 0.3)",
]


@pytest.mark.parametrize("flag", slow_except(BY_ROUNDING, BY_ROUNDING[::2]))
def test_of_a_flag_that_rounding_sets_nothing_is_said(flag: str) -> None:
    """In exact arithmetic it is in_domain; the compiled C sets it to 5.6e-17 or 1e-4 where that is 0."""
    content, files = changed("one_mass_domain", ("outputs->in_domain = in_domain;", f"outputs->in_domain = {flag};"))
    assert where(files, content) == []


def test_a_contact_with_the_name_of_a_quantity_is_told_apart() -> None:
    """Of a contact and a position x, sign(x) was printed of both: in_domain was "0 except where sign(x)*x > 1".

    With sign(x) "the sign of v_hat" that is false: the C sets in_domain to 1 at x = -2, v_hat = 2.
    """
    flag = "outputs->in_domain = 0.5 + 0.5 * one_mass_domain_sign(fabs(inputs->x) - 1.0);"
    _, files = changed("one_mass_domain", ("outputs->in_domain = in_domain;", flag))
    proof = files[theorem.PROOF].decode().replace("sign.rail", "sign.x")
    del files[theorem.SETS]
    lines = verify.check(proof, sources=files).proved
    assert "sign.x is 1 or -1, the sign of v_hat in machine and code" in lines
    assert "in each sample F_hat_rail = a_hat_rail*sign.x" in lines
    assert "in each sample with fault 0 in_domain is 0 except where -1 + sign(x)*x >= 0" in lines
    assert not any("sign(x)" in line for line in lines if "in_domain" not in line)


NEXT = {  # a change of the C -> where verify says that the count and the direction do not become 0
    (COUNT, COUNT): ([MOVES, f"{FAST} > 0", HELD, CALM], [MOVES, f"{FAST} > 0", HELD]),
    (COUNT, "const double samples_slid_next = "): (None, [MOVES, f"{FAST} > 0", HELD]),
    (DIRECTION, "direction_rail_next = sign_rail;"): ([MOVES, f"{FAST} > 0", HELD, CALM], [MOVES]),
}


@pytest.mark.parametrize("change", NEXT, ids=["as generated", "a count without reset", "a direction at any speed"])
def test_where_count_and_direction_do_not_become_zero_is_said(change: tuple[str, str]) -> None:
    """Of a C whose count of samples is never set back nothing else was said than of the genuine one."""
    content, files = changed("one_mass_domain", change)
    begin = "in each sample with fault 0 {} becomes 0 except where "
    lines = check(content, files).proved
    for state, conditions in zip(("samples_slid", "direction_rail"), NEXT[change], strict=True):
        found = [x.removeprefix(begin.format(state)) for x in lines if x.startswith(begin.format(state))]
        assert found == ([] if conditions is None else [" and ".join(conditions)])


def test_where_in_domain_is_not_zero_in_the_twin() -> None:
    twin, dice = importlib.import_module("generated.one_mass_domain"), random.Random(2)
    p, outputs, seen = twin.Parameters(), twin.Outputs(), {0.0: 0, 1.0: 0}
    state = twin.init(p, twin.Inputs(0.0, 0.0))
    for _ in range(40_000):
        v = dice.choice([dice.uniform(-5, 5), p.slip_speed, -p.slip_speed])
        moved = dice.choice([0.0, p.largest_innovation, dice.uniform(-1e-3, 1e-3)])
        state.x_predicted, state.samples_slid = dice.uniform(-1, 1), float(dice.choice([0, 298, 299, 300]))
        x, state.direction_rail = state.x_predicted + moved, dice.choice([-1.0, 0.0, 1.0])
        state.samples_held, free = (left := float(dice.choice([0, 0, 0, 1, 88]))), left == 0
        state.z_v, predicted, late = v - p.K_v * x, state.x_predicted, state.samples_slid >= p.settle_samples
        state.z_rail, z_v, w = dice.uniform(-200, 200), state.z_v, dice.uniform(-9, 9)
        twin.step(state, p, twin.Inputs(x, w), outputs)
        assert not outputs.fault and outputs.v_hat == p.K_v * x + z_v
        push = math.copysign(outputs.v_hat != 0, outputs.v_hat) * outputs.a_hat_rail
        assert math.isclose(state.z_v, -0.001 * push + 0.001 * w - 0.1 * outputs.v_hat + z_v, abs_tol=1e-12)
        fast, calm = abs(outputs.v_hat) > p.slip_speed, abs(x - predicted) <= p.largest_innovation
        assert state.samples_held == max(left - 1, 0)
        assert (fast and free) or not state.direction_rail
        within = abs(outputs.a_hat_rail - 50) <= 10 + 1e-9  # 10 in exact arithmetic
        assert (fast and free) or (state.z_rail == outputs.a_hat_rail and within)
        assert (fast and free and calm) or not state.samples_slid
        seen[outputs.in_domain] += 1
        if outputs.in_domain:
            assert fast and free and calm and late
    assert min(seen.values()) > 500


DOWN = "const double samples_held_next = learning_1 - learning_4;"
LEFT = "-0.5 - 0.5*sign(-0.5 + samples_held) + samples_held"
COUNTED = {  # what samples_held becomes in the C -> what verify says of it
    "learning_1 - learning_4": LEFT,
    "0.5 * (learning_1 - learning_4)": "-0.25 - 0.25*sign(-0.5 + samples_held) + 0.5*samples_held",
    "state->samples_held": None,
    "learning_1 - learning_4 + 0.1 + 0.2 - 0.3": None,
    "learning_1 - learning_4 + 1e12 * state->samples_held - 1e12 * state->samples_held": None,
    "(learning_1 - learning_4) * (0.5 - learning_4) * in_domain_2": None,
}


@pytest.mark.parametrize("formula", slow_except([*COUNTED], [*COUNTED][::2]))
def test_how_samples_are_counted_down_is_said(formula: str) -> None:
    """And nothing of a count that other states change, or that rounding does: 1e12 samples_held is rounded to 1e-4."""
    forged = changed("one_mass_domain", (DOWN, f"const double samples_held_next = {formula};"))
    begin = "in each sample with fault 0 samples_held becomes "
    found = [x.removeprefix(begin) for x in check(*forged).proved if x.startswith(begin) and "except" not in x]
    assert found == ([] if COUNTED[formula] is None else [COUNTED[formula]])


HOLD = "    state->samples_held = parameters->restart_samples;\n"
START = {  # a part of the C, what is forged there
    "init": ("    state->x_predicted = inputs->x;\n    state->mode = ONE", "0.0"),
    "predict": ("    state->x_predicted = state->x_predicted + parameters", "state->samples_held"),
    "resume": (
        "    state->x_predicted = inputs->x + parameters->sample_time * outputs->v_hat;\n    state->mode",
        "87.0",
    ),
}


@pytest.mark.parametrize("function", [*START, ""])
def test_that_the_level_is_held_after_every_gap_is_said(function: str) -> None:
    """Where one of the three functions sets another number of samples than the others, none is said."""
    content, files = changed("one_mass_domain", (DOWN, DOWN))
    text, begin = (
        files["one_mass_domain.c"].decode(),
        "in the first sample with fault 0, and in the first after others, ",
    )
    assert text.count(HOLD) == 3
    if function:
        behind, value = START[function]
        at = text.rindex(HOLD, 0, text.index(behind))
        text = text[:at] + f"    state->samples_held = {value};\n" + text[at + len(HOLD) :]
        files["one_mass_domain.c"] = text.encode()
        content["subject"]["files"]["one_mass_domain.c"] = hashlib.sha256(files["one_mass_domain.c"]).hexdigest()
    found = [x.removeprefix(begin) for x in check(content, files).proved if x.startswith(begin)]
    assert found == ["direction_rail is 0", *(["samples_held is 88"] * (not function)), "samples_slid is 0"]


SMALL = ["0.1 + 0.2 - 0.3", "1e9 + 0.1 - 1e9 - 0.1", "1e6 * state->K - 1e6 * state->K"]


@pytest.mark.parametrize("more", slow_except(SMALL, SMALL[1:2]))
def test_a_number_that_rounding_makes_is_not_said_to_be_that_of_a_restart(more: str) -> None:
    """1e9 + 0.1 - 1e9 - 0.1 is 2e-8 in doubles: verify said that samples_held is 88, which it is not in that C."""
    sum_ = f"parameters->restart_samples + {more.replace('state->K', 'parameters->restart_samples')}"
    forged = changed("one_mass_domain", (HOLD, f"    state->samples_held = {sum_};\n"))
    assert not any("samples_held is 88" in line for line in check(*forged).proved)


ONLY = f" except where {MOVES} and {FAST} > 0 and {HELD}"
HELD_LEVEL = [f"z_rail becomes a_hat_rail{ONLY}", f"a_hat_rail is in [40, 60]{ONLY}"]
IN_RESTART = [
    *HELD_LEVEL,
    "v_hat is 100*x + z_v",
    "z_v becomes -0.001*sign(v_hat)*a_hat_rail + 0.001*w - 0.1*v_hat + z_v",
]
LEVEL_NEXT, CLIPPED = "const double z_rail_next = a_hat_rail + ", "* (parameters->constant_1 + 0.5 * fabs("
OTHERWISE = {  # a text of the C, what is forged there -> the lines of IN_RESTART that are then not said
    ("", ""): [],
    (LEVEL_NEXT, f"{LEVEL_NEXT}(0.5 + learning_4) * v_hat + "): [0],
    (LEVEL_NEXT, f"{LEVEL_NEXT}(0.5 + learning_4) * (inputs->w - a_hat_rail) + "): [0],
    (LEVEL_NEXT, f"{LEVEL_NEXT}(0.3 - 0.1 - 0.2) * v_hat + "): [0],
    (LEVEL_NEXT, f"{LEVEL_NEXT}1e12 * v_hat * (0.3 - 0.1 - 0.2) + "): None,
    (CLIPPED, f"{CLIPPED}v_hat) + 0.5 * fabs("): [1],
    (CLIPPED, "* (parameters->constant_1 + 0.4 * fabs("): [1],
    ("const double z_v_next = ", "const double z_v_next = (0.5 + learning_4) * inputs->w + "): [3],
    ("v_hat = state->z_v", "v_hat = 0.9 * state->z_v"): None,
    ("- learning) * (parameters", "- learning) * (1e12 * v_hat - 1e12 * v_hat + parameters"): [1],
}


@pytest.mark.parametrize("change", slow_except([*OTHERWISE], [*OTHERWISE][::2]))
def test_that_a_restart_holds_the_level_is_said(change: tuple[str, str]) -> None:
    """A C that moved the level while samples_held is above 0 was accepted in the same words as the genuine one."""
    missing, forged = OTHERWISE[change], changed("one_mass_domain", change)
    if missing is None:
        with pytest.raises(verify.Refused):
            check(*forged)
        return
    said_ = [line.removeprefix("in each sample with fault 0 ") for line in check(*forged).proved]
    assert [k for k, line in enumerate(IN_RESTART) if line not in said_] == missing


OF_V = "100*inputs.x + state.z_v"
OF_Z = "-0.001*sign(outputs.v_hat)*outputs.a_hat_rail + 0.001*inputs.w - 0.1*outputs.v_hat + state.z_v"
OF_Z_BY_X = f"-0.001*sign({OF_V})*outputs.a_hat_rail + 0.001*inputs.w - 10*inputs.x + 0.9*state.z_v"
UNCHECKED = {  # lines behind those of the step or of its end -> the formulas that are then printed
    "as generated": ("step", (), {"outputs.v_hat": OF_V, "state.z_v": OF_Z}),
    "a level that is set again": ("commit", ("outputs.a_hat_rail", "v_hat"), {"outputs.v_hat": OF_V}),
    "an estimate that is computed again": (
        "step",
        ("v_hat", "0.5 * v_hat"),
        {"state.z_v": OF_Z_BY_X},
    ),
    "a state that rounding replaces": (
        "commit",
        ("state.z_v", "z_v_next + 1e12 * v_hat - 1e12 * v_hat"),
        {"outputs.v_hat": OF_V},
    ),
    "the sign of a sine": ("commit", ("state.z_v", "sgn(sin(v_hat))"), {"outputs.v_hat": OF_V}),
}


@pytest.mark.parametrize("case", slow_except([*UNCHECKED], [*UNCHECKED][:3]))
def test_a_formula_of_lines_that_the_kernel_refuses_is_not_printed_either(case: str) -> None:
    """The kernel refuses such a C before its formulas are read; what they print does not rely on that."""
    part, line, printed = UNCHECKED[case]
    files = sources("one_mass_domain")
    proof = theorem.read(files[theorem.PROOF])
    assert proof is not None
    shown = theorem.proved(proof, files)
    c = shown["c"]
    forged = c._replace(**{part: [*getattr(c, part), *([line] if line else [])]})
    assert theorem.formulas(proof, shown | {"c": forged}) == printed


CLOCK = {  # a further quantity q of the machine, q' = 5, of which the C shows the state before it adds to it
    "h": [("    double z_rail; ", "    double q; /* m/s: more */\n    double z_rail; "),
          ("    double v_hat; ", "    double q_hat; /* m/s: more */\n    double v_hat; ")],
    "c": [("    state->z_rail = parameters->rail_a;", "    state->q = 0.0;\n    state->z_rail = parameters->rail_a;"),
          ("        state->z_rail = 0.0;", "        state->q = 0.0;\n        state->z_rail = 0.0;"),
          ("fabs(state->z_rail)\n", "fabs(state->z_rail) + fabs(state->q)\n"),
          ("check = z_v_next", "check = z_v_next + q_next"),
          ("    const double z_v_next", "    const double q_next = state->q + 0.005;\n    const double z_v_next"),
          ("        outputs->v_hat = v_hat;", "        outputs->q_hat = state->q;\n        outputs->v_hat = v_hat;"),
          ("        state->z_rail = z_rail_next;", "        state->q = q_next;\n        state->z_rail = z_rail_next;")],
}  # fmt: skip


def test_an_estimate_that_is_a_state_is_not_said_to_be_the_next_one() -> None:
    """verify said that q_hat is 0.005 + state.q, where the C sets it to state.q and then adds 0.005 to that."""
    files = sources("one_mass_domain")
    del files[theorem.SETS]
    for end, pairs in CLOCK.items():
        text = files[f"one_mass_domain.{end}"].decode()
        for old, new in pairs:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        files[f"one_mass_domain.{end}"] = text.encode()
    proof = json.loads(files[theorem.PROOF])
    proof["mass_matrix"] = [["parameters.m", "0"], ["0", "1"]]
    proof["force"].append("5")
    proof["acceleration"]["true.q"] = "5"
    proof["errors"].append({"truth": "true.q", "estimate": "outputs.q_hat", "sign": ""})
    proof["states"]["state.q"] = "outputs.q_hat"
    for matrix in ("matrix", "lyapunov_matrix"):
        proof[matrix] = [*([*row, "0"] for row in proof[matrix]), ["0", "0", "1"]]
    proof["witness"] |= {"true.q": "1", "outputs.q_hat": "1"}
    proof |= {"decay_rate": "-1", "reversals": []}
    lines = verify.check(json.dumps(proof), sources=files).proved
    said_ = [line.removeprefix("in each sample with fault 0 ") for line in lines if "q_hat is" in line]
    assert said_ == []
