"""What a forger may write into the C where a step is not used: begin, lose samples, go on after them."""

from __future__ import annotations

import json
import math
import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.app.derived import Derived
from codegen.certify.certify import Certificate
from codegen.checker import errors, verify
from codegen.checker.verify import Refused
from codegen.replay.engine import Engine
from codegen.spec import parse_spec
from tests.checker.forged import GENERATED, POINT, certificate, changed, check, replace_once, sources
from tests.slow_cases import slow_except
from tests.twin import load_twin

MISSED = "    state->z_v = state->z_v - parameters->sample_time * parameters->K_v * outputs->v_hat;\n"
RESUMED = (
    "    state->z_v = outputs->v_hat - parameters->K_v * (inputs->x + parameters->sample_time * outputs->v_hat);\n"
)
LEVEL = "    state->z_rail = outputs->a_hat_rail + parameters->K_F * fabs(outputs->v_hat);\n"
BEGUN = "    state->z_v = -(parameters->K_v * inputs->x);\n"
AT = "    state->z_rail = parameters->rail_a;\n"
# What is written into the C of one_mass, in place of what. How modes are counted and left is in test_modes.py.
ATTACKS = {
    "init: a velocity": (BEGUN, BEGUN.replace("-(", "1.0 - (")),
    "init: the position stays in the velocity": (BEGUN, "    state->z_v = -(0.0 * inputs->x);\n"),
    "init: a level by the command": (AT, AT.replace("rail_a", "rail_a + 9.0 * inputs->w")),
    "init: a level by the position": (AT, AT.replace("rail_a", "rail_a + fabs(inputs->x)")),
    "predict: nothing goes along": (MISSED, ""),
    "predict: the wrong way": (MISSED, MISSED.replace("z_v - ", "z_v + ")),
    "predict: twice as far": (MISSED, MISSED + MISSED),
    "predict: a level grows": (MISSED, MISSED + "    state->z_rail = 2.0 * state->z_rail;\n"),
    "predict: a level turns": (MISSED, MISSED + "    state->z_rail = -state->z_rail;\n"),
    "predict: a level by what was held": (MISSED, MISSED + "    state->z_rail = state->z_rail + outputs->v_hat;\n"),
    "resume: nothing": (RESUMED, ""),
    "resume: a velocity": (RESUMED, RESUMED.replace("outputs->v_hat - ", "9.0 - ")),
    "resume: at the old position": (RESUMED, RESUMED.replace(" + parameters->sample_time * outputs->v_hat", "")),
    "resume: the level of forward motion": (LEVEL, LEVEL.replace("fabs(outputs->v_hat)", "outputs->v_hat")),
    "resume: a level": (LEVEL, "    state->z_rail = 0.0;\n"),
}


@pytest.mark.parametrize("case", ATTACKS)
def test_what_no_observer_does_between_steps_is_refused(case: str) -> None:
    with pytest.raises(Refused, match=f"of the C: {case.split(':')[0]}: .*(more than a constant|what was held)"):
        check(*changed("one_mass", ATTACKS[case]))


MEMORY: dict[
    str, list[tuple[str, str]]
] = {  # q of z_rail = ... + q v_hat: a memory that no formula has, 0 after a step
    "h": [
        (
            "    double z_rail; /* N: observer state */",
            "    double z_rail; /* N: state */\n    double q; /* N*s/m: state */",
        )
    ],
    "c": [
        (AT, f"{AT}    state->q = 0.0;\n"),
        (" + fabs(state->z_rail);", " + fabs(state->z_rail) + fabs(state->q);"),
        ("        state->z_rail = 0.0;", "        state->z_rail = 0.0;\n        state->q = 0.0;"),
        (LEVEL, LEVEL.replace(";", " + state->q * outputs->v_hat;")),
        ("fabs(v_hat); /* N */", "fabs(v_hat) - state->q * v_hat;\n    const double q_next = 0.0;"),
        ("z_rail_next = state->z_rail", "z_rail_next = state->z_rail - state->q * v_hat"),
        ("check = z_v_next", "check = q_next + z_v_next"),
        ("        state->z_v = z_v_next;\n", "        state->z_v = z_v_next;\n        state->q = q_next;\n"),
    ],
}


@pytest.mark.parametrize("function", ["", "predict", "resume"])
def test_a_memory_that_turns_what_was_held_into_other_estimates_is_refused(function: str) -> None:
    """The level of 50 N was 36 N after an invalid sample, where q was set to 7 N s/m behind z_rail."""
    files = {x: text.decode() for x, text in sources("one_mass").items() if x != "ellipsoid.json"}
    line = {"predict": MISSED, "resume": LEVEL.replace(";", " + state->q * outputs->v_hat;")}.get(function)
    other = [(line, f"{line}    state->q = 7.0;\n")] if line else []
    replace_once(files, {"one_mass.h": MEMORY["h"], "one_mass.c": MEMORY["c"] + other})
    proof = certificate("one_mass", "proof.json")
    proof["states"]["state.z_rail"] += " + state.q*outputs.v_hat"
    given = {x: text.encode() for x, text in files.items()}
    if line:
        with pytest.raises(Refused, match=f"{function}: .*z_rail.* do not go on with what was held"):
            check(proof, given)
    else:
        assert verify.status(check(proof, given)) == verify.DOMAIN


FAST = "gains: {K_F: 10, K_v: 1000}"
WAITING = "    (void)parameters;\n    /* after 1 invalid"


@pytest.mark.parametrize("invalid", [1, 2, 30])
def test_where_every_valid_sample_after_an_invalid_one_sets_the_states_none_is_predicted(invalid: int) -> None:
    """At h K_v = 1 no prediction is stable, so `resume` follows a single invalid sample. `predict` does nothing then,
    and may do anything: `resume` sets the states from what was held. It was demanded to go on with the estimates."""
    text = (GENERATED.parent / "specs" / "one_mass.yaml").read_text("utf-8")
    machine = Derived(parse_spec(text.replace("gains: {K_F: 10, K_v: 100}", FAST), Path("one_mass.yaml")))
    files, outcome = machine.files, machine.outcome
    assert isinstance(outcome, Certificate) and outcome.kernel is not None, outcome
    given = {name: text.encode() for name, text in files.items()}
    assert verify.status(verify.check(files["certificate.json"], sources=given)) == 0
    proof, code = json.loads(files["proof.json"]), files["one_mass.c"]
    assert "state->invalid_samples >= 1u" in code and WAITING in code
    moved = code.replace(WAITING, MISSED + MISSED + "    /* after 1 invalid")
    assert check(proof, {"one_mass.c": moved.encode(), "one_mass.h": given["one_mass.h"]}).proved
    counted = moved.replace(">= 1u", ">= 2u")
    with pytest.raises(Refused, match=r"of the C: predict: .* do not go on with what was held"):
        check(proof, {"one_mass.c": counted.encode(), "one_mass.h": given["one_mass.h"]})
    engine = Engine(machine.program, machine.sources)
    rows = np.column_stack([np.linspace(0.0, 0.1, 100 + invalid), np.full(100 + invalid, 50.0)])
    held = slice(60, 60 + invalid)
    rows[held] = np.nan
    engine.start(rows[0])
    out = engine.run(rows)[0]
    assert (out[60 : 62 + invalid] == out[59]).sum() >= out.shape[1] * (invalid + 1)
    assert out[61 + invalid] == pytest.approx(out[59], rel=0.02)


@pytest.mark.parametrize("level", ["1e+99 * 1e+99", "1e+99 * parameters->sample_time * 1e+99"])
def test_an_observer_that_begins_beyond_the_limit_is_refused(level: str) -> None:
    """Each valid sample begins anew, and no sample is ever used."""
    with pytest.raises(Refused, match="of the C: the sum `check` may be above its limit"):
        check(*changed("one_mass", (AT, f"    state->z_rail = {level};\n")))


@pytest.mark.parametrize(("power", "holds"), [(2, True), (13, False)])
def test_a_quotient_that_takes_the_sum_of_every_step_beyond_the_limit_is_refused(power: int, holds: bool) -> None:
    """For w in [-1, 1] 1/(1e-12 (2 + w)) is above 3e11, and its power of 13 above 1e149: each sample was a fault."""
    files = sources("one_mass")
    sum_ = "    const double check = z_v_next + z_rail_next"
    quotient = "    const double r = 1.0 / (1e-12 * (2.0 + inputs->w));\n"
    trap = f"    const double trap = {' * '.join(['r'] * power)};\n{sum_} + trap"
    files["one_mass.c"] = files["one_mass.c"].replace(sum_.encode(), (quotient + trap).encode())
    proof = certificate("one_mass", "proof.json") | {"box": {"inputs.w": ["-1", "1"]}, "witness": POINT}
    del files["ellipsoid.json"]
    if holds:
        assert check(proof, files).proved
    else:
        with pytest.raises(Refused, match="of the C: the sum `check` may be above its limit"):
            check(proof, files)


FIELD, BEGINS = "    double z_rail; /* N: observer state */\n", "fabs(state->z_v) + fabs(state->z_rail);"
SUM, SET = "    const double check = z_v_next + z_rail_next;", "        state->z_rail = z_rail_next;\n"


@pytest.mark.parametrize(
    ("moves", "missed", "factor", "why"),
    [
        ("1.0 * inputs->w", "", "1.0", ""),
        ("1e2 * inputs->w", "", "1.0", ""),
        ("1e20 * inputs->w", "", "1.0", "the sum `check` may be above its limit"),
        ("1e30 * inputs->w", "", "0.0", "a product with it, is too large"),
        ("1.0 * inputs->w", "    state->z_q = 2.0 * state->z_q;\n", "1.0", "state.z_q may grow"),
        ("1.0 * inputs->w", "    state->z_q = 1e99 * outputs->v_hat;\n", "0.0", "a product with it, is too large"),
    ],
)
def test_another_state_is_as_large_as_the_code_makes_it(moves: str, missed: str, factor: str, why: str) -> None:
    """A state of which nothing is claimed was taken as usual. With z = 1e20 w a power of z made a sample a fault.

    So w = 1 N was enough for the observer to begin anew in every second sample.
    """
    files = {name: text.decode() for name, text in sources("one_mass").items() if name != "ellipsoid.json"}
    power = f"    const double power = {factor} * ({' * '.join(['state->z_q'] * 10)});\n"
    replace_once(files, {
        "one_mass.h": [(FIELD, f"{FIELD}    double z_q; /* 1: observer state */\n")],
        "one_mass.c": [
            (AT, f"{AT}    state->z_q = 0.0;\n"),
            ("        state->z_rail = 0.0;\n", "        state->z_rail = 0.0;\n        state->z_q = 0.0;\n"),
            (BEGINS, f"{BEGINS[:-1]} + fabs(state->z_q);"),
            (SUM, f"    const double z_q_next = {moves};\n{power}{SUM[:-1]} + z_q_next + power;"),
            (SET, f"{SET}        state->z_q = z_q_next;\n"),
            (MISSED, MISSED + missed),
        ],
    })  # fmt: skip
    given = {name: text.encode() for name, text in files.items()}
    if why:
        with pytest.raises(Refused, match=why):
            check(certificate("one_mass", "proof.json"), given)
    else:
        assert check(certificate("one_mass", "proof.json"), given).proved


def test_a_next_state_that_is_set_again_behind_the_sum_is_refused() -> None:
    """w = 1e20 made it NaN after the sum had been compared: a sample with fault 0, and an observer that begins anew."""
    first, set_ = "    const double z_v_next =", "        state->z_v = z_v_next;\n"
    again = "        z_v_next += 0.0 * (1e99 * 1e99 * 1e90 * inputs->w);\n"
    with pytest.raises(Refused, match="`z_v_next` is set again"):
        check(*changed("one_mass", (first, first.replace("const ", "")), (set_, again + set_)))


@pytest.mark.parametrize(
    ("old", "by"),
    [(BEGUN.rstrip(";\n"), "inputs->x"), (RESUMED.rstrip(";\n"), "outputs->v_hat"), (AT.rstrip(";\n"), "inputs->w")],
)
def test_a_division_that_an_unread_text_names_is_no_safer(old: str, by: str) -> None:
    """At 0 it gives no number: an observer that begins there never runs.

    The text is a witness, which nothing asks for without a domain or a box; its exp has it read for its rounding. With
    that, the division counted as one that the kernel had shown to be of what is positive.
    """
    content, files = changed("one_mass", (old, f"{old} + 0.0 / {by}"))
    for witness in ({}, {"unread": f"exp(0)/{by.replace('->', '.')}"}):
        proof = json.dumps(json.loads(files["proof.json"]) | {"witness": witness}).encode()
        with pytest.raises(Refused, match=r"a division by what may be zero|is its rounding"):
            check(content, files | {"proof.json": proof})


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("chain", "parameters->K_v_v[i] * outputs->v_hat[i]", "parameters->K_v_v[i] * outputs->v_hat[0]"),
        ("chain", "state->z_ground[i] = parameters->ground_a[i]", "state->z_ground[i] = inputs->x[i]"),
        (
            "two_mass",
            "parameters->K_F_ground * fabs(outputs->v2_hat)",
            "parameters->K_F_ground * fabs(outputs->v1_hat)",
        ),
        ("two_mass_gto", "z_v1 - parameters->sample_time", "z_v1 + parameters->sample_time"),
        ("rig_to", "state->z_theta = outputs->tracked_theta", "state->z_theta = 2.0 * outputs->tracked_theta"),
    ],
)
def test_other_machines(name: str, old: str, new: str) -> None:
    with pytest.raises(Refused, match=r"of the C: (init|predict|resume): "):
        check(*changed(name, (old, new)))


def test_two_states_that_begin_with_one_level_are_refused() -> None:
    """z_ground is to show a constant of its own: one that both levels share is no constant of each."""
    proof = json.loads(sources("two_mass")["proof.json"])
    files = {name: text.decode() for name, text in sources("two_mass").items() if name.endswith((".c", ".h"))}
    held = verify.theorem.held
    shown = errors.prove(proof, files)
    held.require(proof, shown)
    mixed = dict(proof["states"])
    mixed["state.z_ground"] = mixed["state.z_ground"].replace("outputs.a_hat_ground", "outputs.a_hat_between")
    with pytest.raises(ValueError, match="init: "):
        held.require(proof | {"states": mixed}, shown)


PROOFS = sorted(GENERATED.glob("*/proof.json"))


@pytest.mark.parametrize(
    "path", slow_except(PROOFS, [p for p in PROOFS if p.parent.name != "chain"]), ids=lambda p: p.parent.name
)
def test_what_is_shipped_begins_and_goes_on_so(path: Path) -> None:
    """But for one with a domain, outside of which it begins: there nothing is said."""
    said = verify.check(path.read_text("utf-8"), path.parent).proved
    assert (verify.statements.HELD in said) == (not json.loads(path.read_text("utf-8"))["domain"])


def runs_on(module: Any, seed: int) -> list[Callable[[], bool]]:
    """The three demands on one_mass, by Python itself on doubles: after init, one lost sample, and a hundred."""
    dice = random.Random(seed)
    parameters, h = module.Parameters(), module.Parameters().sample_time

    def near(a: float, b: float) -> bool:
        return abs(a - b) <= 1e-9 * (1 + abs(a) + abs(b))

    def begins() -> bool:
        given = [module.Inputs(dice.uniform(-9, 9), dice.uniform(-9, 9)) for _ in range(2)]
        seen = [module.step(module.init(parameters, x), parameters, x, module.Outputs()) for x in given]
        return all(near(o.v_hat, 0) and near(o.a_hat_rail, seen[0].a_hat_rail) and not o.fault for o in seen)

    def goes_on(lost: int) -> bool:
        def run(missing: int) -> Any:
            state, out = module.State(z_v=z[0], z_rail=z[1]), module.Outputs()
            module.step(state, parameters, module.Inputs(x, w), out)
            v = out.v_hat
            for _ in range(missing):
                module.step(state, parameters, module.Inputs(math.nan, w), out)
                if not out.fault:
                    return None
            if missing > 8:  # the good sample that sets the states
                module.step(state, parameters, module.Inputs(x + (missing + 1) * h * v, w), out)
                if (out.fault, out.v_hat) != (1, v):
                    return None
                missing += 1
                held = (v, out.a_hat_rail)
                module.step(state, parameters, module.Inputs(x + (missing + 1) * h * v, w), out)
                return None if out.fault else near(out.v_hat, held[0]) and near(out.a_hat_rail, held[1])
            module.step(state, parameters, module.Inputs(x + (missing + 1) * h * v, w), out)
            return None if out.fault else (out.v_hat, out.a_hat_rail)

        x, w, z = dice.uniform(-1, 1), dice.uniform(-50, 50), [dice.uniform(-90, 90), dice.uniform(-90, 90)]
        if lost > 8:
            return run(lost) is True
        plain, held = run(0), run(lost)
        return held is not None and all(map(near, plain, held))

    return [begins, lambda: goes_on(1), lambda: goes_on(100)]


@pytest.mark.parametrize("count", slow_except([50, 150], [50]))
def test_mutants_are_accepted_just_where_they_run_on(count: int) -> None:
    """One operator or name in what init, predict and resume give the states is another, in the C and in Python."""
    twin, dice = sources("one_mass")["__init__.py"].decode(), random.Random(5)
    places = {  # of the C -> of the twin
        BEGUN: "z_v=-(parameters.K_v * inputs.x)",
        AT: "z_rail=parameters.rail_a",
        **{line: line.strip(" ;\n").replace("->", ".").replace("fabs", "abs") for line in (MISSED, RESUMED, LEVEL)},
    }
    refused = kept = 0
    for k in range(count):
        line = dice.choice([*places])
        spot = dice.choice([*re.finditer(r" [-+*] |\b(?:parameters|outputs)->\w+", line)])
        options = [x for x in (" - ", " + ", " * ") if x != spot.group()]
        other = dice.choice(options) if spot.group() in (" - ", " + ", " * ") else f"(2.0 * {spot.group()})"
        wrong = line[: spot.start()] + other + line[spot.end() :]
        told = wrong.strip(" ;\n").replace("->", ".").replace("fabs", "abs").replace("state.", "", line in (BEGUN, AT))
        told = told.replace(" = ", "=", line in (BEGUN, AT))
        assert twin.count(places[line]) == 1
        module = load_twin(twin.replace(places[line], told), "mutant")
        sound = all(demand() for seed in range(6) for demand in runs_on(module, 100 * k + seed))
        try:
            check(*changed("one_mass", (line, wrong)))
        except Refused:
            assert not sound, wrong
            refused += 1
        else:
            assert sound, wrong
            kept += 1
    assert refused > count / 2 and kept > 0


def of_faults(name: str, *changes: tuple[str, str]) -> str:
    """The line of the report that says which samples are not used."""
    (line,) = (x for x in check(*changed(name, *changes)).proved if x.startswith("a sample is used"))
    return line


@pytest.mark.parametrize("most", [1, 2, 4, 8])
def test_how_many_invalid_samples_lead_to_holding_is_printed(most: int) -> None:
    """And the twin, of the same count, does not use the next valid sample just after as many."""
    assert f" after {most} or more invalid samples in a row" in of_faults("one_mass", (">= 8u", f">= {most}u"))
    twin = sources("one_mass")["__init__.py"].decode()
    assert twin.count("invalid_samples >= 8") == 1
    module = load_twin(twin.replace("invalid_samples >= 8", f"invalid_samples >= {most}"), "counts")
    parameters = module.Parameters()
    for lost in range(1, 11):
        state, out = module.init(parameters, module.Inputs(0.0, 0.0)), module.Outputs()
        for x in [0.0, *[math.nan] * lost, 0.0]:
            module.step(state, parameters, module.Inputs(x, 0.0), out)
        assert (out.fault == 1) == (lost >= most)


def test_an_input_beyond_the_limit_with_next_states_within_it_is_not_said_to_be_invalid() -> None:
    """A sample was said to be invalid where the sum of its inputs is above 1e+150; this one is used, with fault 0."""
    said = of_faults("one_mass")
    assert said.startswith("a sample is used, with fault 0, if the sum of the next states")
    assert "with fault 1, a sample is invalid if the sum of its inputs' magnitudes is not in" in said
    module = load_twin(sources("one_mass")["__init__.py"].decode(), "large")
    state, out = module.init(module.Parameters(), module.Inputs(0.0, 0.0)), module.Outputs()
    module.step(state, module.Parameters(), module.Inputs(0.0, 1e152), out)
    assert out.fault == 0 and abs(state.z_v + state.z_rail) <= 1e150


def test_next_states_that_cancel_in_the_sum_are_said_to_be_used() -> None:
    """The twin uses the sample in which both next states are beyond the limit, and their sum is not."""
    said = of_faults("one_mass")
    assert "is in [-1e+150, 1e+150], even if a next state is not and cancels in the sum;" in said
    module = load_twin(sources("one_mass")["__init__.py"].decode(), "cancels")

    def after(level: float) -> tuple[Any, Any]:
        state, out = module.State(z_v=1e152, z_rail=level), module.Outputs()
        module.step(state, module.Parameters(), module.Inputs(0.0, 0.0), out)
        return state, out

    low, high = -1e155, 1e155  # where the sum of the next states is below 0, and above: bisection
    p = module.Parameters()

    def total(level: float) -> float:
        v_dot = -p.one_over_m * (level - p.K_F * 1e152)
        return 1e152 + p.sample_time * (v_dot - p.K_v * 1e152) + level + p.h_K_F * v_dot

    for _ in range(400):
        middle = (low + high) / 2
        low, high = (middle, high) if total(middle) < 0 else (low, middle)
    state, out = after(low)
    assert out.fault == 0 and min(abs(state.z_v), abs(state.z_rail)) > 1e150
    assert after(low / 2)[1].fault == 1
