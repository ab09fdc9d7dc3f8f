"""Forgeries over genuine generated files: each was accepted once, and is refused or has an exit status of its own.

Where a forger once wrote into the Python twin, by which a certificate was bound, he writes the same into the C.
"""

from __future__ import annotations

import copy
import functools
import hashlib
import io
import json
import random
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from codegen.app.derived import Derived
from codegen.certify.certify import Certificate
from codegen.checker import files, frame, verify
from codegen.checker.verify import Refused
from codegen.spec import parse_spec
from tests.checker.forged import GENERATED, certificate, changed, check, sources
from tests.machines import TEXTS
from tests.slow_cases import drawn, slow_except
from tests.twin import load_twin

TWIN = "__init__.py"
LAW = "parameters->one_over_m * (inputs->w - F_hat_rail)"
NEXT = "        state->z_v = z_v_next;\n"
CHECK = "    const double check = z_v_next"
NOT_PROVED = "the kernel does not prove proof.json of the C"
STEP = "void one_mass_step("


def refused(*given: Any) -> None:
    with pytest.raises(Refused, match=NOT_PROVED):
        check(*given)


# What is written into the C of one_mass, in place of what.
UNREAD = {
    "a helper redefined": ("return (u > 0.0) ? 1.0", "return (u > 300.0) ? 7.0"),
    "a step defined twice": (STEP, "void one_mass_step(void) { }\n\n" + STEP),
    "a macro for the step": ("#include <math.h>\n", "#include <math.h>\n#define one_mass_step other_step\n"),
    "a parameter set in a step": (NEXT, NEXT + "        ((one_mass_parameters *)parameters)->K_F = 0.0;\n"),
    "another header": ("#include <math.h>\n", "#include <math.h>\n#include <stdlib.h>\n"),
    "a function from elsewhere": ("#include <math.h>\n", "#include <math.h>\n#define fabs(u) 0.0\n"),
    "an attribute": (STEP, "__attribute__((weak)) " + STEP),
    "a global": (STEP, "static double kept;\n\n" + STEP),
    "fabs redefined": (STEP, "static double fabs(double u) { return 0.0; }\n\n" + STEP),
    "a local for the sign": (NEXT, NEXT + "        double one_mass_sign = 0.0;\n"),
    "a branch": (NEXT, "        if (v_hat < 5.0) { state->z_v = 0.0; }\n" + NEXT),
    "a choice": (LAW, LAW + " * (v_hat < 5.0 ? 1.0 : 2.0)"),
    "a comparison as a number": (LAW, LAW + " * (1.0 + (v_hat < 5.0))"),
    "a call": (LAW, LAW + " + floor(0.0)"),
    "a loop without end": (NEXT, "        for (;;) { }\n" + NEXT),
    "a jump": (NEXT, "        goto end;\n" + NEXT),
    "an output that is remembered": (LAW, LAW + " + 0.0 * outputs->v_hat"),
    "a guard that never holds": ("if (fabs(check) <= 1e+150 &&", "if (fabs(check) <= 1e-150 &&"),
    "another guard": ("if (fabs(check) <= 1e+150 &&", "if (fabs(check) <= 5.0 &&"),
    "a guard of a product": (CHECK, "    const double check = 1e149 * z_v_next"),
    "another restart": ("        one_mass_init(state, parameters, inputs);", "        state->z_v = 0.0;"),
    "statements between": ("void one_mass_init(", "int print(int);\n\nvoid one_mass_init("),
}


@pytest.mark.parametrize("case", UNREAD)
def test_c_with_more_than_the_kernel_reads_is_refused(case: str) -> None:
    refused(*changed("one_mass", UNREAD[case]))


def beyond(what: str, limit: str, way: str = "+") -> tuple[tuple[str, str], ...]:
    """Where this is larger (or, with -, smaller) the step doubles its velocity."""
    far = f"    const double far = 0.5 {way} 0.5 * one_mass_sign({what} - {limit});\n{CHECK}"
    return (CHECK, far), (NEXT, "        state->z_v = z_v_next + far * v_hat;\n")


@pytest.mark.parametrize(("limit", "way"), [("300.0", "-"), ("5.0", "-"), ("0.1", "-"), ("5000.0", "+")])
def test_another_law_for_slow_or_fast_slips_is_refused(limit: str, way: str) -> None:
    refused(*changed("one_mass", *beyond("fabs(v_hat)", limit, way)))


@pytest.mark.parametrize("limit", ["100.0", "20000.0"])
@pytest.mark.parametrize("what", ["inputs->w", "inputs->x", "a_hat_rail"])
def test_another_law_where_what_is_no_variable_is_large_is_refused(what: str, limit: str) -> None:
    refused(*changed("one_mass", *beyond(what, limit)))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("one_mass", "parameters->h_K_F * sign_rail", "1.05 * parameters->h_K_F * sign_rail"),
        ("one_mass", "state->z_v + parameters->sample_time", "state->z_v + 2.0 * parameters->sample_time"),
        ("two_mass_gto", "parameters->h_K_2_x2 *", "parameters->h_K_2_x1 *"),
    ],
)
def test_other_gains_are_refused(name: str, old: str, new: str) -> None:
    refused(*changed(name, (old, new)))


def test_another_sample_time_is_refused() -> None:
    content = certificate("one_mass") | {"sample_time": "1/2000"}
    content["reversals"][0]["dwell_samples"] = 136
    with pytest.raises(Refused, match=r"the sample time of one_mass\.h is another"):
        check(content, sources("one_mass"))


@pytest.mark.parametrize(("name", "sign"), [("one_mass", "rail"), ("two_mass", "ground")])
@pytest.mark.parametrize("other", ["a_hat", "sign + a_hat", "0.0 - a_hat"])
def test_a_law_that_is_right_for_one_sign_alone_is_refused(name: str, sign: str, other: str) -> None:
    """The friction of forward slips in both directions: three random points saw none but these in one run of eight."""
    wrong = other.replace("sign", f"sign_{sign}").replace("a_hat", f"a_hat_{sign}")
    refused(*changed(name, (f"sign_{sign} * a_hat_{sign};", f"{wrong};")))


@pytest.mark.parametrize("pair", [(1, 1), (1, -1), (-1, 1), (-1, -1)])
def test_a_law_that_is_wrong_for_one_pair_of_signs_is_refused(pair: tuple[int, int]) -> None:
    """One corner of four, in which a term stands that is nothing in the others."""
    corner = f"(1.0 + {pair[0]}.0 * sign_between) * (1.0 + {pair[1]}.0 * sign_ground)"
    law = "sign_between * a_hat_between;"
    refused(*changed("two_mass", (law, f"{law[:-1]} + {corner} * v2_hat;")))


AXIS, RAIL = "    double z_y; /* m/s: observer state */\n", "    double z_rail;"


@pytest.mark.parametrize(
    "grows",
    [
        "7.13 * state->z_y",
        "0.5 * state->z_y + 0.00001 * state->z_y * state->z_y",
        "state->z_y + (1.0 + one_mass_sign(fabs(state->z_y) - 500.0)) * state->z_y",
    ],
)
@pytest.mark.parametrize("name", ["z_y", "memory", "direction_y"])
def test_an_unstable_axis_that_no_error_covers_is_refused(name: str, grows: str) -> None:
    line = f"        state->z_y = {grows};\n".replace("z_y", name)
    content, sources = changed("one_mass", (NEXT, NEXT + line))
    header = sources["one_mass.h"].decode()
    assert RAIL in header
    header = header.replace(RAIL, AXIS.replace("z_y", name) + RAIL)
    content["subject"]["files"]["one_mass.h"] = hashlib.sha256(header.encode()).hexdigest()
    refused(content, sources | {"one_mass.h": header.encode()})


def test_a_state_that_two_errors_do_not_tell_apart_is_refused() -> None:
    """The estimate of the level shows the velocity's state too, and none its own."""
    refused(*changed("one_mass", ("a_hat_rail = state->z_rail - ", "a_hat_rail = state->z_v - 0.0 * state->z_rail - ")))


def unbound(content: Any, sources: dict[str, bytes], words: str) -> None:
    report = check(content, sources)
    assert verify.status(report) == verify.NO_CODE and not report.proved and words in report.unproved


@pytest.mark.parametrize(
    "names", [["e_x", "e_a_rail"], ["e_v", "e_F_rail"], ["e_v", "e_a_rail_"], ["e_v1", "e_a_rail"]]
)
def test_errors_are_the_lags_of_the_outputs_of_their_names(names: list[str]) -> None:
    content = certificate("one_mass") | {"reversals": []}  # which names its contact by its error
    content["error"] = [entry | {"name": name} for entry, name in zip(content["error"], names, strict=True)]
    unbound(content, sources("one_mass"), "the names of the errors")


def test_which_outputs_the_errors_are_of_is_said_by_the_proof_alone() -> None:
    """A second statement of it could be another one."""
    said = {"errors": ["outputs.v_hat", "outputs.a_hat_rail"], "variables": {}, "motion": {}}
    with pytest.raises(Refused, match=r"missing or extra.*'code'"):
        check(certificate("one_mass") | {"code": said}, sources("one_mass"))


def test_errors_that_bear_each_other_s_names_are_not_the_proof_s() -> None:
    content = certificate("two_mass")
    names = [entry["name"] for entry in content["error"]]
    assert names[:2] == ["e_v1", "e_v2"]
    for entry, name in zip(content["error"], [names[1], names[0], *names[2:]], strict=True):
        entry["name"] = name
    unbound(content, sources("two_mass"), "the names of the errors")


@pytest.mark.parametrize(
    "name",
    slow_except(
        ["one_mass", "one_mass_domain", "two_mass_gto", "two_link_arm", "chain"],
        ["one_mass", "two_mass_gto", "two_link_arm"],  # the others have no more kinds of entries
    ),
)
@pytest.mark.parametrize("proof", ["certificate.json", "limit.json"])
def test_a_matrix_a_hair_off_is_not_bound(name: str, proof: str) -> None:
    """So little that P still serves: only the C can tell."""
    dice = random.Random(name)
    wrong, (i, j) = certificate(name, proof), (dice.randrange(2), dice.randrange(2))
    wrong["matrix"][i][j] = ["+", wrong["matrix"][i][j], "1/1000000000000"]
    unbound(wrong, sources(name), "the matrix")


def test_a_reversal_turns_the_errors_that_bear_its_sign() -> None:
    """Two errors with one sign, and a reversal that turns one of them: of another error than the code's."""
    top, proof = verify.parsed(json.dumps(certificate("one_mass"))), json.loads(sources("one_mass")["proof.json"])
    assert verify.agreement.unlike(top, proof) == ""
    proof["errors"][0]["sign"] = "sign.rail"
    assert verify.agreement.unlike(top, proof) == "what turns at a reversal"
    top["reversals"][0]["flips"] = [0]
    assert verify.agreement.unlike(top, proof) == "what turns at a reversal"


@pytest.mark.parametrize("slip", [".v_hat", "outputs.v_hat/0", "- " * 9_000 + "outputs.v_hat", "(" * 9_000, "None"])
def test_a_sign_of_no_expression_is_no_traceback(slip: str) -> None:
    proof = certificate("one_mass", "proof.json")
    proof["signs"]["sign.rail"] = slip
    with pytest.raises(Refused, match=r"does not prove proof\.json of the C"):
        check(certificate("one_mass"), sources("one_mass") | {"proof.json": json.dumps(proof).encode()})


@pytest.mark.parametrize("case", ["a power of powers", "a product of many"])
def test_an_expression_beside_the_matrix_takes_neither_time_nor_memory(
    case: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A parameter in no entry of the matrix; the first is x^(64^5), of a tuple of a thousand million names."""
    monkeypatch.setattr(frame, "SECONDS", 1)
    content, x = certificate("one_mass"), functools.reduce(lambda x, _: ["^", x, "64"], range(5), "x")
    many = ["*", *(["+", "x", f"1/{k + 2}"] for k in range(1000))]
    content["variables"]["x"] = ["0", "1"]
    content["parameters"].append({"name": "unused", "expression": x if case == "a power of powers" else many})
    begun = time.thread_time()
    assert verify.status(check(content, sources("one_mass"))) == verify.NO_CODE
    assert time.thread_time() - begun < 5


def test_a_number_of_a_parameter_beside_the_matrix_is_written_as_in_the_matrix() -> None:
    """Python makes of 1e999999999 a fraction of a thousand million digits, for minutes; 1e9999 shows the same."""
    content = certificate("one_mass")
    content["parameters"].append({"name": "unused", "expression": ["+", "1", "1e9999"]})
    with pytest.raises(Refused, match="'1e9999' is no 'RATIONAL'"):
        check(content, sources("one_mass"))


def test_a_matrix_with_more_than_signs_is_not_bound() -> None:
    content = certificate("one_mass")
    content["parameters"] = [{"name": "root", "expression": ["sqrt", "1"]}]
    content["matrix"][0][0] = ["*", "root", content["matrix"][0][0]]
    unbound(content, sources("one_mass"), "the matrix")


def test_a_certificate_for_one_sign_alone_is_not_bound() -> None:
    """The kernel's matrix is for all signs; a range that leaves one out, or a point between them, is another claim."""
    name, variable = "two_mass", {"s_ground": ["1", "1"]}
    unbound(
        certificate(name) | {"variables": variable},
        sources(name),
        "the signs and ranges for which it holds",
    )
    assert check(certificate(name) | {"variables": {"s_ground": ["-1", "1"]}}, sources(name)).proved
    between = certificate(name, "limit.json") | {"variables": {"s_ground": ["0", "0"]}}
    unbound(between, sources(name), "the signs and ranges for which it holds")


def test_a_certificate_of_a_wider_range_than_its_proof_is_not_bound() -> None:
    name = "two_link_arm"
    proof = json.loads(sources(name)["proof.json"])
    proof["box"]["true.omega1"] = ["-1/10", "1/10"]
    narrow = sources(name) | {"proof.json": json.dumps(proof).encode()}
    for file in ("certificate.json", "limit.json"):
        unbound(certificate(name, file), narrow, "ranges for which it holds")
    slow = {"omega1": ["-1/20", "1/10"], "omega2": ["0", "3/10"]}
    inside = certificate(name) | {"variables": certificate(name)["variables"] | slow}
    assert check(inside, narrow).proved
    wider = {"theta2": ["-100", "100"]}  # an angle's range is all round
    assert check(certificate(name) | {"variables": certificate(name)["variables"] | wider}, sources(name)).proved


def test_what_differs_from_the_proof_but_for_the_matrix_is_verified_by_itself() -> None:
    """Another V of the same matrix: the checker decides it, and the kernel's words do not speak of its own."""
    content = certificate("one_mass") | {"decay_rate": "1"}
    content["reversals"][0]["dwell_samples"] = 800
    report = check(content, sources("one_mass"))
    assert verify.status(report) == 0 and not any("V = e'Pe" in line for line in report.proved)
    assert any("V is multiplied by at most 1 - 2*alpha*h = 0.998 " in fact for fact in report.facts)
    with pytest.raises(Refused, match="V may not fall"):
        check(content | {"decay_rate": "12"}, sources("one_mass"))
    content["reversals"][0]["growth"] = "3"
    with pytest.raises(Refused, match="V may grow by more than 3"):
        check(content, sources("one_mass"))


@pytest.mark.parametrize("unit", ["mN", "\N{MICRO SIGN}N", "\N{FULLWIDTH LATIN CAPITAL LETTER N}", "N?"])
def test_a_unit_is_the_code_s(unit: str) -> None:
    content = certificate("one_mass")
    content["error"][1]["unit"] = unit
    with pytest.raises(Refused, match=r"the units of one_mass\.h are others"):
        check(content, sources("one_mass"))


def test_a_variable_that_is_not_the_plain_quantity_is_bound_to_no_code() -> None:
    """omega1 is 100000 times the estimate, so that the proof covers a range 100000 times narrower."""
    content = certificate("two_link_arm")
    text = json.dumps(content["parameters"]).replace('"omega1"', '["*", "1/100000", "omega1"]')
    content["parameters"] = json.loads(text)
    unbound(content, sources("two_link_arm"), "the matrix")


def run(path: Path) -> tuple[int, str]:
    script = Path(verify.__file__)
    done = subprocess.run([sys.executable, "-I", str(script), str(path)], capture_output=True, text=True)
    assert done.stderr == ""
    return done.returncode, done.stdout


def edited(content: Any, case: str) -> Any:
    if case == "no files":
        return content | {"subject": content["subject"] | {"files": {}}}
    if case == "no C":
        files = {name: digest for name, digest in content["subject"]["files"].items() if not name.endswith(".c")}
        return content | {"subject": content["subject"] | {"files": files}}
    if case == "an invented matrix":
        matrix = [["-50", "0"], ["0", "-50"]]
        more = {"lyapunov_matrix": [["1", "0"], ["0", "1"]], "decay_rate": "10", "reversals": []}
        return content | more | {"matrix": matrix}
    return content


CASES = ["", "no files", "no C", "an invented matrix", "no C here", "no proof here", "no twin here"]


@pytest.mark.parametrize("case", CASES)
def test_what_is_bound_to_no_code_has_an_exit_status_of_its_own(case: str, tmp_path: Path) -> None:
    folder = tmp_path / "one_mass"
    shutil.copytree(GENERATED / "one_mass", folder)
    (folder / "certificate.json").write_text(json.dumps(edited(certificate("one_mass"), case)))
    away = {"no C here": "one_mass.c", "no proof here": "proof.json", "no twin here": TWIN}
    if case in away:
        (folder / away[case]).unlink()
    status, out = run(folder / "certificate.json")
    bound = case in ("", "no twin here")  # of which nothing is claimed
    assert status == (0 if bound else 5), out
    assert "\nthe algebra holds:\n" in out
    assert ("proved of one_mass.c itself by the kernel, with the values of one_mass.h:" in out) == bound
    assert ("it was not bound to code:" in out) == (not bound)
    verdict = "verified for the C" if bound else "the algebra holds; it was not bound to code"
    said = f"{verdict} (exit status {0 if bound else 5})"
    first, *more, last = out.splitlines()
    assert (first, last) == (f"one_mass: {said}", said)
    short = more[: more.index("in full, with what it rests on:")]
    assert len(short) == (3 if bound else 0)  # the rate and two bounds: of velocity and friction
    assert all(more.count(line) + more.count(f"  {line}") == 2 for line in short)  # words that are proved below


def test_of_the_twin_nothing_is_claimed() -> None:
    content, sources_ = certificate("one_mass"), sources("one_mass")
    text = sources_[TWIN].replace(b"K_F: float = 10.0", b"K_F: float = 10.5")
    with pytest.raises(Refused, match=r"__init__\.py differs from"):
        check(content, sources_ | {TWIN: text})
    content["subject"]["files"][TWIN] = hashlib.sha256(text).hexdigest()
    report = check(content, sources_ | {TWIN: text})
    assert any(gap.startswith("what __init__.py, the Python version, computes") for gap in report.open)
    assert not any("__init__" in line or "twin" in line for line in report.proved)


CLAIMS = [p for p in sorted(GENERATED.glob("*/*.json")) if p.name not in ("manifest.json", "ellipsoid.json")]
"""Shipped claims that are verified by their own file; an ellipsoid.json is verified with its proof.json."""


@pytest.mark.parametrize(  # of a machine with several claims, each of which costs 0.3 s, one
    "path",
    slow_except(
        CLAIMS, [p for p in CLAIMS if p.stem not in ("limit", "certificate", "weak", "passing") or "link" in str(p)]
    ),
    ids=lambda p: f"{p.parent.name}-{p.stem}",
)
def test_what_is_shipped_is_of_its_c_or_says_why_not(path: Path) -> None:
    """Refused is none; of the C is every certificate, refutation and turning.json beside a proof of its matrix."""
    report = verify.check(path.read_text("utf-8"), path.parent)
    machine, beside = path.parent.name, path.with_name("proof.json")
    ranged = beside.exists() and bool(json.loads(beside.read_text("utf-8"))["box"])
    free = path.name == "proof.json" or (beside.exists() and (not ranged or machine == "two_link_arm"))
    limited = machine == "one_mass_domain" or (ranged and free)
    assert verify.status(report) == ((verify.DOMAIN if limited else 0) if free else verify.NO_CODE), report.unproved
    assert report.unbound == ()


HUGE = ["^", ["^", ["^", ["^", ["^", "2", "64"], "64"], "64"], "64"], "64"]


@pytest.mark.parametrize("power", [["^", "2", "999999999"], ["^", "2", "-999999999"], ["^", "2", "1/2"], HUGE])
def test_a_power_without_end_is_refused(power: Any) -> None:
    """The last one took 17 s of CPU and 3 GB, as no multiplication of it came to an end: the time was asked between."""
    content = certificate("two_link_arm")
    content["parameters"][0]["expression"] = power
    with pytest.raises(Refused, match=r"exponent|a number is too long"):
        check(content, sources("two_link_arm"))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"reversals": []}, "reversals: nothing is claimed about one of e_a_rail"),
        ({"assumptions": []}, "the assumptions: none is stated"),
    ],
)
def test_what_is_left_out_is_said(change: Any, words: str) -> None:
    assert words in check(certificate("one_mass") | change, sources("one_mass")).open


def test_another_c_than_that_of_the_subject_binds_nothing() -> None:
    content, sources_ = certificate("one_mass"), sources("one_mass") | {"other.c": b""}
    content["subject"]["files"] = {"other.c": hashlib.sha256(b"").hexdigest()}
    unbound(content, sources_, "its C or its header is not here, or not among its files")


VISCOUS = "{kind: viscous, on: rail, parameters: {b: 2.5}}"
STRIBECK = "{kind: stribeck, on: rail, parameters: {delta: 4, v_s: 0.3}}"
WOBBLING = "{kind: encoder_eccentricity, on: x, parameters: {amplitude: 0.001, period: 0.3, phase: 0}}"
DELAYED = "{kind: input_delay, on: w, parameters: {T: 0.002}}"
LAGGING = "{kind: actuator_lag, on: w, parameters: {tau: 0.05}}"
LIMITED = "{kind: saturation, on: w, parameters: {limit: 15}}"
DEAD = "{kind: dead_zone, on: w, parameters: {width: 3}}"
ONE_SIDED = "{kind: coulomb_asymmetry, on: rail, parameters: {d: 2}}"
DRIFTING = "{kind: friction_drift, on: rail, parameters: {delta: 2, T: 60}}"
PRESLIDING = "{kind: presliding, on: rail, parameters: {sigma: 20000}}"
ONE, ARM = "{x: [-1, 1], v: [0.1, 1]}", "{th2: [-0.5, 0.5], om1: [-0.2, -0.1], om2: [-0.2, -0.1]}"
MACHINES = {
    "an effect at the contact": ("one_mass", ONE, "cfo", "estimated", "K_F: 10, K_v: 100", "euler", VISCOUS),
    "a law that falls": ("one_mass", ONE, "cfo", "estimated", "K_F: 10, K_v: 100", "semi_implicit", STRIBECK),
    "a sensor that is off": ("one_mass", ONE, "to", "estimated", "K_2: -20, K_v: 100", "euler", WOBBLING),
    "an input that is delayed": ("one_mass", ONE, "to", "estimated", "K_2: -20, K_v: 100", "euler", DELAYED),
    "friction that drifts": ("one_mass", ONE, "to", "estimated", "K_2: -20, K_v: 100", "euler", DRIFTING),
    "an input with limits": ("one_mass", ONE, "cfo", "estimated", "K_F: 10, K_v: 100", "euler", f"{LIMITED}, {DEAD}"),
    "a level of a side": ("one_mass", ONE, "cfo", "estimated", "K_F: 10, K_v: 100", "euler", ONE_SIDED),
    "an input that lags": ("one_mass", ONE, "to", "estimated", "K_2: -20, K_v: 100", "euler", LAGGING),
    "exponential": ("one_mass", ONE, "cfo", "estimated", "K_F: 10, K_v: 100", "exponential", ""),
    "measured velocity": ("one_mass", ONE, "cfo", "measured", "K_F: 10", "euler", VISCOUS),
    "plain": ("one_mass", ONE, "cfo", "estimated", "K_F: 10, K_v: 100", "euler", ""),
    "an arm": ("arm", ARM, "gcfo", "measured", "K_F: [0.5, 0.05]", "euler", ""),
}
BOUND = dict.fromkeys(("an effect at the contact", "a level of a side", "an arm", "measured velocity", "plain"), 0)
BOUND |= {"an input with limits": 0, "exponential": 0} | dict.fromkeys(
    ("an input that is delayed", "friction that drifts"), 4
)
BOUND |= dict.fromkeys(("an input that lags", "a law that falls"), 4)


@pytest.mark.parametrize("case", MACHINES)
def test_other_machines_and_observers(case: str) -> None:
    """What the kernel cannot read yet is verified as algebra, and it is said why."""
    name, envelope, kind, velocity, gains, step, effect = MACHINES[case]
    choice = f"kind: {kind}, velocity: {velocity}, gains: {{{gains}}}, sample_time: 0.0005, integration: {step}"
    text = f"{TEXTS[name]}observer: {{{choice}}}\nenvelope: {envelope}\neffects: [{effect}]\n"
    machine = Derived(parse_spec(text, Path(f"{name}.yaml")))
    files, found = machine.files, machine.outcome
    assert isinstance(found, Certificate), found.reason
    report = verify.check(found.text, sources={k: v.encode() for k, v in files.items()})
    print(case, verify.status(report), found.not_by_kernel)
    assert verify.status(report) == BOUND.get(case, 5)
    assert bool(report.proved) == (found.kernel is not None) != bool(found.not_by_kernel)
    if effect == VISCOUS and velocity == "estimated":
        law = "(m) v' = -a_rail*sign(rail) - b*v - k*x - v*viscous_rail_b + w; x' = v; a_rail constant"
        assert any(line.startswith(f"machine: {law}") for line in report.proved), report.proved[0]


@pytest.mark.parametrize(("effect", "said"), [(PRESLIDING, True), (VISCOUS, False)])
def test_a_friction_state_that_the_observer_leaves_out_is_assumed(effect: str, said: bool) -> None:
    choice = "kind: cfo, velocity: estimated, gains: {K_F: 10, K_v: 100}, sample_time: 0.0005"
    text = f"{TEXTS['one_mass']}observer: {{{choice}}}\nenvelope: {ONE}\neffects: [{effect}]\n"
    found = Derived(parse_spec(text, Path("one_mass.yaml"))).outcome
    assert isinstance(found, Certificate), found.reason
    line = "The friction law of rail (presliding) has a state that the observer does not model"
    assert any(a.startswith(line) for a in found.content["assumptions"]) == said


def test_a_name_with_an_escape_does_not_reach_the_screen_as_it_stands(tmp_path: Path) -> None:
    script = Path(verify.__file__)
    for name in ("\x1b[31m", "a\nverified:"):
        for options in ([name], [GENERATED / "rig" / "certificate.json", "--spec", tmp_path / f"{name}.yaml"]):
            (tmp_path / f"{name}.yaml").write_text("another")
            done = subprocess.run([sys.executable, "-I", script, *options], capture_output=True, text=True, check=False)
            said = done.stdout + done.stderr
            assert done.returncode in (2, 3) and said.count("\n") == 1 and said[:-1].isprintable()


def test_a_device_that_has_nothing_to_read_yet_is_unreadable(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Waiting(io.BytesIO):
        def read(self, size: int | None = -1) -> Any:
            return None

        def fileno(self) -> int:
            return handle.fileno()

    (tmp_path / "log").write_text("")
    with (tmp_path / "log").open("rb") as handle:
        monkeypatch.setattr("builtins.open", lambda *_, **__: Waiting())
        with pytest.raises(OSError, match="nothing to read"):
            files.read(tmp_path / "log")


def in_python(name: str, twin: str, statements: str) -> ModuleType:
    """The twin with these statements of C in place of its own, for Python to run on doubles."""
    bare = re.sub(r"/\*.*?\*/", "", statements, flags=re.DOTALL)
    lines = [" ".join(line.split()).removeprefix("const double ") for line in bare.split(";") if line.strip()]
    text = "".join(f"    {line}\n" for line in lines).replace("->", ".")
    text = text.replace(f"{name}_sign(", "_sign(").replace("fabs(", "abs(")
    begin, end = twin.index("    # velocity estimate"), twin.index("    # this sum is")
    return load_twin(twin[:begin] + text + twin[end:], "mutant")


def shown(module: ModuleType, places: list[str], seed: int) -> list[list[float]]:
    """The estimates over a few samples from a drawn state."""
    dice, parameters, outputs = random.Random(seed), module.Parameters(), module.Outputs()
    state = module.State(**{z: dice.uniform(-9, 9) for z in module.State.__slots__ if z.startswith("z_")})
    found = []
    for _ in range(4):
        module.step(state, parameters, module.Inputs(*(dice.uniform(-1, 1) for _ in module.Inputs.__slots__)), outputs)
        found.append([getattr(outputs, place) for place in places])
    return found


@pytest.mark.parametrize(
    "name", slow_except(["one_mass", "two_mass", "rig_to", "two_mass_gto"], ["one_mass", "rig_to"])
)
@drawn(80, 250)
def test_wrong_laws_are_refused_or_do_no_harm(name: str, draws: int) -> None:
    """One operator, constant or parameter of `step` is another, its hash stated: Python says whether that shows."""
    dice, genuine, twin = random.Random(name), sources(name)[f"{name}.c"].decode(), sources(name)[TWIN].decode()
    begin, end = genuine.index("    /* velocity estimate"), genuine.index("    /* this sum is")
    plain = re.sub(r"/\*.*?\*/", lambda m: "." * len(m[0]), genuine, flags=re.DOTALL)
    spots = [m for m in re.finditer(r" [-+*] |\b\d+\.\d+\b|\bparameters->\w+", plain) if begin < m.start() < end]
    proof = json.loads(sources(name)["proof.json"])
    places = [e["estimate"].removeprefix("outputs.") for e in proof["errors"]]
    right = [shown(in_python(name, twin, genuine[begin:end]), places, seed) for seed in range(5)]
    kept = 0
    for _ in range(draws):
        spot = dice.choice(spots)
        options = [x for x in (" - ", " + ", " * ") if x != spot.group()]
        other = dice.choice(options) if spot.group() in (" - ", " + ", " * ") else f"(2.0 * {spot.group()})"
        wrong = genuine[: spot.start()] + other + genuine[spot.end() :]
        try:
            check(*changed(name, (genuine, wrong)))
        except Refused:
            continue
        moved = in_python(name, twin, wrong[begin : end + len(wrong) - len(genuine)])
        for seed in range(5):
            assert np.allclose(shown(moved, places, seed), right[seed], rtol=1e-9, atol=1e-9), wrong[
                spot.start() - 60 :
            ]
        kept += 1
    assert kept < draws / 2


@pytest.mark.parametrize("place", ["subject", "contact"])
def test_a_name_is_no_sentence_among_what_holds(place: str) -> None:
    """What holds as algebra is printed with these names, of a certificate that is bound to no code too."""
    said = "rail: the friction error is at most 1 mN. Besides"
    content = copy.deepcopy(certificate("one_mass"))
    if place == "subject":
        content["subject"]["name"] = "verified for the C (exit status 0)"
    else:
        content["reversals"][0]["contact"], content["error"][1]["name"] = said, f"e_a_{said}"
    with pytest.raises(Refused, match="is no 'WORD'"):
        check(content, {})


@pytest.mark.skipif(sys.platform != "linux", reason="/proc/self/mem")
def test_a_file_that_fails_while_it_is_read_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    """An error of reading, unlike one of opening, comes without the file's name: `None` was printed."""
    assert verify.main(["/proc/self/mem"]) == 2
    assert capsys.readouterr().err == "error: /proc/self/mem: Input/output error\n"
