"""A certificate speaks of the code beside it, or is refused; what nothing vouches for is said."""

from __future__ import annotations

import copy
import hashlib
import json
import random
import re
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from codegen.app.derived import Derived
from codegen.certify.certify import Certificate
from codegen.checker import twin as reader
from codegen.checker import verify
from codegen.checker.verify import Refused
from codegen.replay.twin import load_twin
from codegen.spec import parse_spec
from tests.machines import TEXTS

from .test_verify import value

GENERATED = Path(__file__).parents[2] / "generated"
PROOFS = sorted(p for p in GENERATED.glob("*/*.json") if p.name in ("certificate.json", "limit.json", "turning.json"))
UNREAD = ("one_mass_dfo_implicit", "seven_joint_arm")  # a friction state no output shows; a proof by structure
MANY = "how the error moves under all combinations of signs: 16 were met"
REPLAYED = "replayed in rationals at points drawn at random, the twin moves its error by `matrix` for all signs met"


GUARDED = (
    "slips slower than slip_speed 1, where a guard holds the level, nor direction_rail, samples_slid, x_predicted, "
    "by which it knows its domain",
)


def sources(name: str) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in (GENERATED / name).iterdir() if p.is_file()}


def certificate(name: str, proof: str = "certificate.json") -> Any:
    return json.loads((GENERATED / name / proof).read_text("utf-8"))


def check(content: Any, files: dict[str, bytes]) -> verify.Report:
    return verify.check(json.dumps(content), sources=files)


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, marks=pytest.mark.slow) if p.parent.name == "chain" else p for p in PROOFS],
    ids=lambda p: f"{p.parent.name}-{p.stem}",
)
def test_what_is_shipped_is_that_of_its_twin(path: Path) -> None:
    report = verify.check(path.read_text("utf-8"), path.parent)
    if path.parent.name in UNREAD:
        assert "does not say where the twin shows" in " ".join(report.open)
    else:
        assert REPLAYED in report.facts
        held = GUARDED if path.parent.name == "one_mass_domain" else ()
        held = (MANY,) if path.parent.name == "chain" else held
        kernel = path.name == "certificate.json" and path.with_name("proof.json").exists()
        always = (verify.BY_KERNEL, verify.theorem.SIZES, *verify.ALWAYS[2:]) if kernel else verify.ALWAYS
        assert report.open == (*held, "the specification's SHA-256: it was not given (--spec)", *always)


@pytest.mark.parametrize("name", ["one_mass", "one_mass_domain", "two_mass_gto", "two_link_arm", "chain"])
def test_a_matrix_a_hair_off_is_refused(name: str) -> None:
    """So little that P still serves: only the twin can tell."""
    content, files = certificate(name), sources(name)
    dice = random.Random(name)
    for _ in range(3):
        wrong, (i, j) = copy.deepcopy(content), (dice.randrange(2), dice.randrange(2))
        wrong["matrix"][i][j] = ["+", wrong["matrix"][i][j], "1/1000000000000"]
        verify.check(json.dumps(wrong))
        with pytest.raises(Refused, match="`matrix` is not how the twin moves its error"):
            check(wrong, files)


def forged(content: Any, files: dict[str, bytes], text: str) -> tuple[Any, dict[str, bytes]]:
    """Another twin, with its hash in the certificate."""
    content = copy.deepcopy(content)
    content["subject"]["files"]["__init__.py"] = hashlib.sha256(text.encode()).hexdigest()
    return content, files | {"__init__.py": text.encode()}


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("one_mass", "K_F: float = 10.0", "K_F: float = 10.5"),
        ("one_mass", "sample_time: float = 0.001", "sample_time: float = 0.002"),
        ("two_link_arm", "+ parameters.m2_l1_b2 * cos_theta2", "- parameters.m2_l1_b2 * cos_theta2"),
        ("two_link_arm", "* sin_theta2 * omega1_hat * omega1_hat", "* sin_theta2 * omega1_hat * omega2_hat"),
        ("two_link_arm", "sin_theta2 = _sin(inputs.theta2)", "sin_theta2 = _sin(inputs.theta1)"),
        ("two_mass_gto", "parameters.h_K_2_x2 *", "parameters.h_K_2_x1 *"),
    ],
)
def test_another_twin_is_refused(name: str, old: str, new: str) -> None:
    files = sources(name)
    text = files["__init__.py"].decode()
    assert old in text
    content, files = forged(certificate(name), files, text.replace(old, new))
    with pytest.raises(Refused, match=r"`matrix` is not how the twin moves|the twin has another sample time"):
        check(content, files)


@pytest.mark.slow
def test_wherever_the_points_are_drawn_the_twin_is_that_of_its_certificate() -> None:
    """One state: a derivative along a direction that happens to be zero tells nothing, and refused one spec in 66."""
    machine = Derived(parse_spec(MEASURED, Path("slide.yaml")))
    files, outcome = machine.files, machine.outcome
    assert isinstance(outcome, Certificate)
    sources, content = {name: body.encode() for name, body in files.items()}, outcome.content
    for k in range(200):
        named = content | {"tool": content["tool"] | {"command": f"stiction generate {k}.yaml"}}
        verify.bound(verify.parsed(json.dumps(named)), sources, None)


MEASURED = """
name: slide
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 2, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction: {distribution: [[1]], contacts: [{name: rail, a: 5, unit: N}]}
observer: {kind: cfo, velocity: measured, gains: {K_F: 10}, sample_time: 0.001}
"""


def narrower() -> Any:
    """The arm's proof over a part of the elbow's range: true, but less than the code's envelope."""
    content = certificate("two_link_arm")
    at, slow = content["splits"]["theta2"], content["slow"][0]
    low, high = 4, len(at) - 4
    content["splits"]["theta2"], content["variables"]["theta2"] = at[low:high], [at[low], at[high - 1]]
    slow["matrices"] = [row[low:high] for row in slow["matrices"]]
    return content


def test_a_narrower_envelope_than_the_code_s_is_refused() -> None:
    content = narrower()
    assert "V falls" in " ".join(verify.check(json.dumps(content)).facts)
    with pytest.raises(Refused, match=r"theta2: the envelope of the code is \[-3927/1250, 3927/1250\], not"):
        check(content, sources("two_link_arm"))
    slower = certificate("two_link_arm")
    slower["variables"]["omega2"] = ["-1/5", "1/5"]
    with pytest.raises(Refused, match="omega2: the envelope"):
        check(slower, sources("two_link_arm"))
    one_sign = certificate("two_link_arm")
    one_sign["variables"]["s_elbow"] = ["1", "1"]
    with pytest.raises(Refused, match=r"s_elbow: the envelope of the code is \[-1, 1\]"):
        check(one_sign, sources("two_link_arm"))


def test_a_refuted_point_out_of_the_envelope_is_refused() -> None:
    content = certificate("two_link_arm", "limit.json")
    check(content, sources("two_link_arm"))
    content["variables"]["omega1"] = ["31/100", "31/100"]
    with pytest.raises(Refused, match=r"omega1: the envelope|no V with P|V may not fall"):
        check(content, sources("two_link_arm"))


def test_a_slow_variable_moves_as_the_code_says() -> None:
    content = certificate("two_link_arm")
    content["slow"][0]["velocity"] = "omega1"
    with pytest.raises(Refused, match="slow: omega1 is not what moves theta2"):
        check(content, sources("two_link_arm"))


def test_a_slow_variable_strays_as_far_as_the_code_s_accelerations_let_it() -> None:
    content, files = certificate("two_link_arm"), sources("two_link_arm")
    text = files["__init__.py"].decode()
    assert '"omega2_dot": ("-20", "20")' in text
    content["slow"][0]["stray"] = "99/10000"
    verify.check(json.dumps(content))
    with pytest.raises(Refused, match="with the code's omega2_dot, omega2 may stray further"):
        check(content, files)
    unbounded = forged(content, files, text.replace('    "omega2_dot": ("-20", "20"),\n', ""))
    assert "how far omega2 strays within a sample with the spec's accelerations" in check(*unbounded).open


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"reversals": []}, "a reversal: nothing is said of one of e_a_rail"),
        ({"assumptions": []}, "what the claim rests on: no assumption is stated"),
        ({"subject": {"name": "one_mass", "spec_sha256": "0" * 64, "files": {}}}, "any file: none is named"),
        (
            {"code": {"errors": [], "variables": {}, "motion": {}}},
            "the certificate does not say where the twin shows the",
        ),
    ],
)
def test_what_is_left_out_is_said(change: Any, words: str) -> None:
    report = check(certificate("one_mass") | change, sources("one_mass"))
    assert any(words in gap for gap in report.open)
    assert (REPLAYED in report.facts) == ("code" not in change and "subject" not in change)


BAD_CODE = [
    {"errors": ["outputs.v_hat", "outputs.nothing"], "variables": {}, "motion": {}},
    {"errors": ["outputs.v_hat", "__import__"], "variables": {}, "motion": {}},
    {"errors": ["outputs.v_hat", "outputs.F_hat_rail[3]"], "variables": {}, "motion": {}},
    {"errors": ["outputs.F_hat_rail", "outputs.v_hat"], "variables": {}, "motion": {}},
    {"errors": ["outputs.v_hat", "inputs.x"], "variables": {}, "motion": {}},
    {"errors": ["outputs.v_hat", "outputs.F_hat_rail"], "variables": {}, "motion": {"inputs.y": "outputs.v_hat"}},
    {"errors": ["outputs.v_hat", "outputs.F_hat_rail"], "variables": {"q": ["what"]}, "motion": {}},
]


@pytest.mark.parametrize("code", BAD_CODE)
def test_bad_code_is_refused_or_told(code: Any) -> None:
    try:
        report = check(certificate("one_mass") | {"code": code}, sources("one_mass"))
    except Refused as fault:
        assert str(fault)
    else:
        assert REPLAYED not in report.facts or code["variables"] == {"q": ["what"]}  # of which no use is made


@pytest.mark.parametrize(
    "text", ["", "x = (", "class State: pass", "def step(): pass", "class Parameters:\n    a: int = f()"]
)
def test_a_twin_that_cannot_be_read_is_refused_or_told(text: str) -> None:
    try:
        report = check(*forged(certificate("one_mass"), sources("one_mass"), text))
    except Refused as fault:
        assert "cannot be read" in str(fault)
    else:
        assert REPLAYED not in report.facts


@pytest.mark.parametrize("name", ["one_mass_domain", "two_mass_gto", "chain", "one_mass_cfo_semi_implicit", "rig_to"])
def test_the_reader_computes_what_python_computes(name: str) -> None:
    """The twin executed on doubles, and its derivative by differences of rationals: not by this reader."""
    text = (GENERATED / name / "__init__.py").read_text("utf-8")
    module, twin, dice = load_twin(text, name), reader.Twin(text), random.Random(name)
    made = {record: twin.record(record) for record in ("Parameters", "State", "Inputs", "Outputs")}
    twin.run("prepare", parameters=made["Parameters"])
    theirs = {record: getattr(module, record)() for record in made}
    for record in ("State", "Inputs"):
        for field, default in made[record].items():
            drawn = [round(dice.uniform(-2, 2), 3) for _ in (default if isinstance(default, list) else [0])]
            if field in ("mode", "invalid_samples"):
                continue
            pairs = [(Fraction(str(x)), Fraction(0)) for x in drawn]
            made[record][field] = pairs if isinstance(default, list) else pairs[0]
            setattr(theirs[record], field, drawn if isinstance(default, list) else drawn[0])
    names = {"state": "State", "parameters": "Parameters", "inputs": "Inputs", "outputs": "Outputs"}
    twin.run("step", **{k: made[v] for k, v in names.items()})
    module.step(*(theirs[v] for v in names.values()))
    for record in ("State", "Outputs"):
        for field, found in made[record].items():
            other = getattr(theirs[record], field)
            flat = zip(found, other, strict=True) if isinstance(found, list) else [(found, other)]
            for (x, _), y in flat:
                assert float(x) == pytest.approx(y, rel=1e-9, abs=1e-12), (record, field)


def test_derivatives_are_those_of_differences() -> None:
    formula = "abs(state.x) * state.x / (1.0 + state.x * state.x) - 3.0 * -state.x"
    text = f"def step(state, outputs):\n    outputs.y = {formula}\n"

    def at(x: Fraction) -> Any:
        outputs: dict[str, Any] = {}
        reader.Twin(text).run("step", state={"x": (x, Fraction(1))}, outputs=outputs)
        return outputs["y"]

    for x in (Fraction(7, 3), Fraction(-2, 5)):
        step = Fraction(1, 10**8)
        assert float(at(x)[1]) == pytest.approx(float((at(x + step)[0] - at(x - step)[0]) / (2 * step)), rel=1e-12)


def test_functions_belong_to_their_argument() -> None:
    for x in (Fraction(0), Fraction(3, 7), Fraction(-5)):
        (sine, slope), (cosine, fall) = reader.function("sin", x), reader.function("cos", x)
        assert sine**2 + cosine**2 == 1 and (slope, fall) == (cosine, -sine)
        assert reader.function("sin", -x)[0] == -sine and reader.function("cos", -x)[0] == cosine
    assert reader.function("exp", Fraction(1)) == reader.function("exp", Fraction(2, 2))
    assert reader.function("exp", Fraction(1)) != reader.function("exp", Fraction(2))
    with pytest.raises(reader.Unknown):
        reader.function("atan", Fraction(1))


VISCOUS = "{kind: viscous, on: rail, parameters: {b: 2.5}}"
STRIBECK = "{kind: stribeck, on: rail, parameters: {delta: 4, v_s: 0.3}}"
WOBBLING = "{kind: encoder_eccentricity, on: x, parameters: {amplitude: 0.001, period: 0.3, phase: 0}}"
DELAYED = "{kind: input_delay, on: w, parameters: {T: 0.002}}"
LAGGING = "{kind: actuator_lag, on: w, parameters: {tau: 0.05}}"
LIMITED = "{kind: saturation, on: w, parameters: {limit: 15}}"
DEAD = "{kind: dead_zone, on: w, parameters: {width: 3}}"
ONE_SIDED = "{kind: coulomb_asymmetry, on: rail, parameters: {d: 2}}"
DRIFTING = "{kind: friction_drift, on: rail, parameters: {delta: 2, T: 60}}"
ONE, ARM = "{x: [-1, 1], v: [0.1, 1]}", "{th2: [-0.5, 0.5], om1: [-0.2, -0.1], om2: [-0.2, -0.1]}"
CASES = {
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
    "an arm": ("arm", ARM, "gcfo", "measured", "K_F: [0.5, 0.05]", "euler", ""),
}


@pytest.mark.parametrize("case", CASES)
def test_other_machines_and_observers(case: str) -> None:
    name, envelope, kind, velocity, gains, step, effect = CASES[case]
    choice = f"kind: {kind}, velocity: {velocity}, gains: {{{gains}}}, sample_time: 0.0005, integration: {step}"
    text = f"{TEXTS[name]}observer: {{{choice}}}\nenvelope: {envelope}\neffects: [{effect}]\n"
    machine = Derived(parse_spec(text, Path(f"{name}.yaml")))
    files, found = machine.files, machine.outcome
    assert isinstance(found, Certificate), found.reason
    assert REPLAYED in verify.check(found.text, sources={k: v.encode() for k, v in files.items()}).facts


PRESLIDING = "{kind: presliding, on: rail, parameters: {sigma: 20000}}"


@pytest.mark.parametrize(("effect", "said"), [(PRESLIDING, True), (VISCOUS, False)])
def test_a_friction_state_that_the_observer_leaves_out_is_assumed(effect: str, said: bool) -> None:
    choice = "kind: cfo, velocity: estimated, gains: {K_F: 10, K_v: 100}, sample_time: 0.0005"
    text = f"{TEXTS['one_mass']}observer: {{{choice}}}\nenvelope: {ONE}\neffects: [{effect}]\n"
    found = Derived(parse_spec(text, Path("one_mass.yaml"))).outcome
    assert isinstance(found, Certificate), found.reason
    line = "The friction at rail has a state (law presliding) that the observer leaves out"
    assert any(a.startswith(line) for a in found.content["assumptions"]) == said


def moved_alike(content: Any, text: str, dice: random.Random) -> float:
    """The share of pairs of runs on doubles, by Python itself, whose difference moves by I + hA."""
    module = load_twin(text, "mutant")
    parameters = module.Parameters()
    module.prepare(parameters)
    h = float(Fraction(content["sample_time"]))
    step = [[(i == j) + h * value(e, {}) for j, e in enumerate(row)] for i, row in enumerate(content["matrix"])]
    names = [name for name in module.State.__slots__ if name.startswith("z_")]
    places = [raw if isinstance(raw, str) else raw[2] for raw in content["code"]["errors"]]
    good, tries = 0, 40
    for _ in range(tries):
        start = {name: dice.uniform(-9, 9) for name in names}
        other = {name: x + dice.uniform(-1e-3, 1e-3) for name, x in start.items()}
        inputs = module.Inputs(*(dice.uniform(-0.01, 0.01) for _ in module.Inputs.__slots__))
        seen = []
        for z in (start, other):
            state = module.State(**z)
            outs = [module.step(state, parameters, inputs, module.Outputs()) for _ in range(3)]
            seen.append([[getattr(out, place.removeprefix("outputs.")) for place in places] for out in outs])
        signs = [1.0 if isinstance(raw, str) else sign_of(raw[1], outs[1]) for raw in content["code"]["errors"]]
        first, second = seen
        before, after = ([s * (b - a) for s, a, b in zip(signs, first[k], second[k], strict=True)] for k in (1, 2))
        expected = [sum(a * e for a, e in zip(row, before, strict=True)) for row in step]
        size = max(map(abs, [*before, *after, 1e-12]))
        good += max(abs(x - y) for x, y in zip(after, expected, strict=True)) < 1e-8 * max(size, 1.0)
    return good / tries


def sign_of(raw: Any, outputs: Any) -> float:
    """A slip's sign, from its expression over outputs."""
    names = re.findall(r"outputs\.(\w+)", json.dumps(raw))
    return 1.0 if value(raw, {f"outputs.{name}": getattr(outputs, name) for name in names}) > 0 else -1.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "sign", "many"), [("one_mass", "rail", 30), ("two_mass", "ground", 10), ("two_link_arm", "elbow", 3)]
)
def test_a_law_that_is_right_for_one_sign_alone_is_refused(name: str, sign: str, many: int) -> None:
    """The friction of forward slips in both directions: three random points saw none but these in one run of eight."""
    files, content = sources(name), certificate(name)
    text = files["__init__.py"].decode()
    right = f"sign_{sign} * a_hat_{sign}"
    assert right in text
    for other in (f"a_hat_{sign}", f"sign_{sign} + a_hat_{sign}", f"0.0 - a_hat_{sign}"):
        for _ in range(many):
            try:
                report = check(*forged(content, files, text.replace(right, other)))
            except Refused as why:
                assert "is not how the twin moves its error" in str(why)
            else:  # a law that is so wrong that its signs turn in every sample
                assert REPLAYED not in report.facts and not report.bound


@pytest.mark.parametrize("pair", [(1, 1), (1, -1), (-1, 1), (-1, -1)])
def test_a_law_that_is_wrong_for_one_pair_of_signs_is_refused(pair: tuple[int, int]) -> None:
    """One corner of four, in which a term stands that is nothing in the others."""
    files, content = sources("two_mass"), certificate("two_mass")
    text = files["__init__.py"].decode()
    corner = f"(1.0 + {pair[0]}.0 * sign_between) * (1.0 + {pair[1]}.0 * sign_ground)"
    law = "    F_hat_between = sign_between * a_hat_between"
    assert law in text
    with pytest.raises(Refused, match="is not how the twin moves its error"):
        check(*forged(content, files, text.replace(law, f"{law} + {corner} * v2_hat")))


@pytest.mark.slow
def test_more_signs_than_are_waited_for_are_told() -> None:
    report = check(certificate("chain"), sources("chain"))
    assert MANY in report.open
    assert not any("combinations" in gap for gap in check(certificate("two_mass"), sources("two_mass")).open)


@pytest.mark.slow
def test_a_thousand_wrong_twins_are_refused_or_do_no_harm() -> None:
    """One operator or constant of ``step`` or ``prepare`` changed, the hash forged: accepted is what moves alike."""
    counts = {}
    for name in ("one_mass", "two_mass", "rig_to", "two_mass_gto"):
        files, content, dice = sources(name), certificate(name), random.Random(name)
        text = files["__init__.py"].decode()
        begin, end = text.index("    # velocity estimate"), text.index("# one sum detects")
        spots = [m for m in re.finditer(r" [-+*] |\b\d+\.\d+\b|\bparameters\.\w+", text) if begin < m.start() < end]
        kept = 0
        for _ in range(250):
            spot = dice.choice(spots)
            options = [x for x in (" - ", " + ", " * ") if x != spot.group()]
            other = dice.choice(options) if spot.group() in (" - ", " + ", " * ") else f"(2.0 * {spot.group()})"
            wrong = text[: spot.start()] + other + text[spot.end() :]
            try:
                report = check(*forged(content, files, wrong))
            except Refused:
                continue
            if REPLAYED not in report.facts:  # its signs turn in every sample, which is told
                assert any("in no two samples in a row all signs stayed" in gap for gap in report.open)
                continue
            assert moved_alike(content, wrong, dice) > 0.5, wrong[spot.start() - 60 :][:120]
            kept += 1
        counts[name] = kept
    print("accepted of 250 each:", counts)
    assert sum(counts.values()) < 500
