"""A spec that cannot be used: one message with file and line, exit 2, nothing written, whatever the verb."""

from __future__ import annotations

import pytest

from .command import SPECS, contents, is_one_message, process, stiction

ONE, TWO = (SPECS / "one_mass.yaml").read_text(), (SPECS / "two_mass.yaml").read_text()
CALL = "__import__('os').system('touch hacked')"


def changed(text: str, old: str, new: str) -> str:
    assert text.count(old) == 1, old
    return text.replace(old, new)


def simulated(entry: str) -> str:
    """One mass with another last line of its simulation, which is line 30."""
    return changed(ONE, "encoder_step: {x: 1e-5}", entry)


FAULTS = {
    "missing key": (
        changed(ONE, "force:                    # g(x, v, w), everything but friction\n  - w\n", ""),
        "force",
    ),
    "missing inner key": (changed(ONE, "{velocity: v, unit: m}", "{unit: m}"), ":5: coordinates.x.velocity"),
    "unknown key": (changed(ONE, "observer:", "obsever:"), "unknown key `obsever`"),
    "unknown name": (changed(ONE, "\n  - w\n", "\n  - kk*w\n"), ":13: force[0]: unknown name `kk`"),
    "a parameter as a number": (
        changed(ONE, "m: {value: 1, unit: kg}", "m: 0.02"),
        ":9: parameters.m: `0.02`; expected a mapping with tolerance, unit, value, as in `{value: 0.02, unit: UNIT}`",
    ),
    "a parameter as a quantity": (
        changed(ONE, "m: {value: 1, unit: kg}", "m: 35 g*cm^2"),
        "a mapping with tolerance, unit, value, as in `{value: 35, unit: g*cm^2}`",
    ),
    "an input as a unit": (changed(ONE, "w: {unit: N}", "w: N"), "a mapping with unit, as in `{unit: N}`"),
    "a torque's unit in a mass matrix": (
        changed(ONE, "m: {value: 1, unit: kg}", "m: {value: 1, unit: kg*cm}"),
        "kgf*cm for a torque, kg*cm^2 for an inertia (did you mean 'kg*cm^2'?)",
    ),
    "a torque's unit elsewhere": (
        changed(ONE, "m: {value: 1, unit: kg}", "m: {value: 1, unit: kg}\n  T: {value: 1, unit: kg*cm}"),
        "kgf*cm for a torque, kg*cm^2 for an inertia (did you mean 'kgf*cm'?)",
    ),
    "call": (changed(ONE, "\n  - w\n", f'\n  - "{CALL}"\n'), "force[0]"),
    "call in parameter": (changed(ONE, "value: 1,", f'value: "{CALL}",'), "parameters.m.value"),
    "attribute": (changed(ONE, "\n  - w\n", "\n  - w.__class__\n"), "`w.__class__`"),
    "lambda": (changed(ONE, "\n  - w\n", '\n  - "(lambda: w)()"\n'), "force[0]"),
    "yaml tag": (changed(ONE, "name: one_mass", "name: !!python/object/apply:os.getcwd []"), "s.yaml:2: the tag"),
    "not yaml": (ONE + "\n}{", "indented unlike the lines above"),
    "not a mapping": ("- 1\n- 2\n", "expected a mapping"),
    "empty": ("", "expected a mapping"),
    "not utf-8": (b"name: \xff\xfe", "not UTF-8"),
    "mass not symmetric": (changed(TWO, "[m1, 0]", "[m1, m2]"), "expected a symmetric mass matrix"),
    "mass not positive": (changed(ONE, "[m]", "[-m]"), "positive definite"),
    "mass not positive somewhere": (
        changed(changed(ONE, "[m]", "[m*cos(x/L)]"), "kg}\n", "kg}\n  L: {value: 1, unit: m}\n").replace(
            "v: [-5, 5]", "v: [-5, 5]\n  x: [0, 2]"
        ),
        "at x =",
    ),
    "mass not square": (changed(ONE, "[m]", "[m, 0]"), "expected 1 by 1"),
    "distribution of wrong shape": (changed(TWO, "[[1, 0], [-1, 1]]", "[[1], [-1]]"), "friction.distribution"),
    "distribution of zeros": (changed(TWO, "[[1, 0], [-1, 1]]", "[[1, 0], [-1, 0]]"), "column 2 of zeros"),
    "gain of wrong shape": (changed(TWO, "[500, 700]", "[500, 700, 3]"), "observer.gains.K_F"),
    "gain of wrong rows": (changed(TWO, "[500, 700]", "[[500, 700]]"), "observer.gains.K_F"),
    "gain of wrong sign": (changed(TWO, "[500, 700]", "[500, -700]"), "expected a positive gain"),
    "gain of zero": (changed(ONE, "K_v: 100", "K_v: 0"), "expected a positive gain"),
    "gain that is text": (changed(ONE, "K_v: 100", "K_v: much"), "observer.gains.K_v"),
    "gain missing": (changed(ONE, ", K_v: 100", ""), "gain `K_v` is missing"),
    "gain of no velocity observer": (changed(ONE, "velocity: estimated", "velocity: measured"), "a gain `K_v`"),
    "gain unknown": (changed(ONE, "K_v: 100", "K_w: 100"), "unknown gain `K_w`"),
    "observer unknown": (changed(ONE, "kind: cfo", "kind: cof"), "did you mean 'cfo'"),
    "observer for one coordinate": (changed(TWO, "kind: gcfo ", "kind: cfo "), "expected gcfo"),
    "sample time": (changed(ONE, "sample_time: 0.001\nenvelope", "sample_time: -1\nenvelope"), "a positive time"),
    "unit": (changed(ONE, "w: {unit: N}", "w: {unit: V}"), "mass_matrix[0][0]"),
    "unit unknown": (changed(ONE, "w: {unit: N}", "w: {unit: newtom}"), "inputs.w.unit"),
    "law unknown": (changed(ONE, "law: coulomb", "law: columb"), "did you mean 'coulomb'"),
    "level negative": (changed(ONE, "a: 50", "a: -50"), "friction.contacts[0].a"),
    "effect unknown": (changed(ONE, "effects: []", "effects: [{kind: coging, on: x, parameters: {}}]"), "'cogging'"),
    "effect nowhere": (
        changed(ONE, "effects: []", "effects: [{kind: offset, on: rail, parameters: {f0: 1}}]"),
        "effects[0].on",
    ),
    "envelope reversed": (changed(ONE, "v: [-5, 5]", "v: [5, -5]"), "low < high"),
    "name of several lines": (changed(ONE, "name: one_mass", 'name: "one\\n\\nmass"'), "name"),
    "name with control characters": (changed(ONE, "name: one_mass", 'name: "one\\e[2Jmass"'), "name"),
    "number that is none": (changed(ONE, "value: 1,", "value: .nan,"), "parameters.m.value"),
    "a whole number beyond all doubles": (
        changed(ONE, "K_F: 10,", f"K_F: 1{'0' * 400},"),
        ":22: observer.gains.K_F: the number 1000",
    ),
    "such a number in the envelope": (changed(ONE, "v: [-5, 5]", f"v: [-5, 1{'0' * 400}]"), ":25: envelope.v[1]: the"),
    "such a duration": (
        changed(ONE, "duration: 12", f"duration: 1{'0' * 400}"),
        ":29: simulation.duration: the number",
    ),
    "a number too long for Python": (changed(ONE, "value: 1,", f"value: 1{'0' * 9000},"), ":9: a number of thousands"),
    "brackets without end": (changed(ONE, "name: one_mass", f"name: {'[' * 3000}"), ":2: more than 20 lists"),
    "lists without end": (f"{ONE}rest:\n  {'- ' * 3000}a\n", ":34: more than 20 lists and mappings"),
    "a long expression": (
        changed(ONE, "\n  - w\n", f"\n  - {'w + ' * 400}zz\n"),
        ":13: force[0]: unknown name `zz` in `w + ",
    ),
    "duration negative": (
        changed(ONE, "duration: 12", "duration: -3"),
        ":29: simulation.duration: -3 s; expected a pos",
    ),
    "duration too long": (changed(ONE, "duration: 12", "duration: 1e9"), ":29: simulation.duration: 1000000000"),
    "seed negative": (simulated("seed: -3"), ":32: simulation.seed: `-3`; expected 0 or a positive"),
    "seed broken": (simulated("seed: 1.5"), ":32: simulation.seed: `1.5`; expected a whole number"),
    "encoder step negative": (simulated("encoder_step: {x: -0.1}"), ":32: simulation.encoder_step.x: "),
    "noise negative": (simulated("position_noise: {x: -5}"), ":32: simulation.position_noise.x: "),
    "noise of a velocity negative": (simulated("velocity_noise: {v: -5}"), ":32: simulation.velocity_noise.v: "),
    "limit of zero": (simulated("input_limit: {w: 0}"), ":32: simulation.input_limit.w: input_limit 0; exp"),
    "delay of nothing": (
        simulated("observer: true\n  cancel_delay: 2"),
        ":33: simulation.cancel_delay: `cancel_delay`",
    ),
    "free gain of both signs": (changed(ONE, "K_F: 10,", "K_F: {free: [-1, 1]},"), ":22: observer.gains.K_F.free: "),
    "a contact to cancel without its list": (
        changed(ONE, "\nobserver:", "\ncancellation: {contacts: rail}\nobserver:"),
        ":19: cancellation.contacts: `rail`; expected 'all' or 'cancellable', or a list",
    ),
    "a broken delay": (
        simulated("observer: true\n  cancel: 1\n  cancel_delay: 1.5"),
        ":34: simulation.cancel_delay: `1.5`; expected a whole number",
    ),
    "a parameter called true": (
        changed(ONE, "  m: {", "  true: {"),
        ":9: parameters.true: the name `true`, a reserved",
    ),
    "a parameter called NULL": (
        changed(ONE, "  m: {", "  NULL: {value: 1, unit: kg}\n  m: {"),
        ":9: parameters.null: the name `null`, a reserved word",
    ),
    "a parameter called i386, a macro of gcc -m32": (
        changed(ONE, "  m: {", "  i386: {value: 1, unit: kg}\n  m: {"),
        ":9: parameters.i386: the name `i386`, a reserved word",
    ),
    "a contact called as its law's parameter": (
        changed(ONE, "name: rail,", "name: a,"),
        "the name `a_a` (formed from contact `a` and parameter `a` of its law), which the generated observer uses",
    ),
    "the same effect again": (
        changed(ONE, "effects: []", "effects:\n" + "  - {kind: offset, on: x, parameters: {f0: 1}}\n" * 2),
        ":20: effects[1]: the same offset on x twice",
    ),
    "division by zero": (changed(ONE, "\n  - w\n", "\n  - w/0\n"), "divides by zero"),
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(folder, text: str | bytes) -> None:
    (folder / "s.yaml").write_bytes(text if isinstance(text, bytes) else text.encode())


@pytest.mark.parametrize("fault", FAULTS)
def test_fault(folder, fault):
    text, words = FAULTS[fault]
    write(folder, text)
    before = contents(folder)
    result = stiction("check", "s.yaml")
    assert is_one_message(result), result
    assert result.err.startswith("error: s.yaml") and words in result.err
    assert len(result.err) < 600
    again = stiction("generate", "s.yaml")
    assert again == result
    assert contents(folder) == before


@pytest.mark.parametrize(
    ("old", "new", "other"),
    [
        ("{value: 1, unit: kg}", "{value: 1, unit: kgg}", "unit `kgg`"),
        ("\n  - w\n", "\n  - kk*w\n", "unknown name `kk`"),
        ("v: [-5, 5]", "v: [5, -5]", "envelope.v: [5, -5]"),
        ("name: rail, law: coulomb, a: 50", "name: rail, law: coulomb, a: 50, tolerance: 5 %", "no tolerance"),
    ],
)
def test_a_misspelt_gain_is_told_with_the_other_faults(folder, old, new, other):
    """It was told in a run of its own, after all else was mended."""
    (folder / "s.yaml").write_text(changed(changed(ONE, "K_F: 10", "K_f: 10"), old, new))
    result = stiction("check", "s.yaml")
    assert result.code == 2 and other in result.err and "unknown gain `K_f`" in result.err, result.err
    assert "did you mean 'K_F'" in result.err and result.err.count("error: ") == 2


@pytest.mark.parametrize("key", ["inputs", "position_gain"])
def test_without_inputs(folder, key):
    """They were told as names among none: expected one of nothing."""
    text = changed(ONE, "inputs:\n  w: {unit: N}\n", "")
    write(folder, changed(text, "inputs: {w: 61*sin(2*pi*0.5*t) + 8*sin(2*pi*1.3*t)}", f"{key}: {{w: 3}}"))
    result = stiction("check", "s.yaml")
    missing = "no inputs are declared (`inputs:` is missing)"
    force = f"s.yaml:11: force[0]: unknown name `w` in `w`; expected one of m, v, x; {missing} [SPEC008]"
    drive = f"s.yaml:29: simulation.{key}.w: the input `w`, but {missing}; expected `inputs:` with it [SPEC008]"
    assert result.code == 2 and result.err.splitlines() == [f"error: {force}", f"error: {drive}"]


@pytest.mark.parametrize(
    "verb",
    [("derive",), ("certify", "-o", "c.json"), ("simulate", "-o", "l.csv"), ("diagnose", "x.csv"), ("generate",)],
)
def test_every_verb(folder, verb):
    write(folder, FAULTS["unknown name"][0])
    before = contents(folder)
    result = stiction(verb[0], "s.yaml", *verb[1:])
    assert is_one_message(result) and "s.yaml:13: force[0]" in result.err
    assert contents(folder) == before


def test_as_a_process(folder):
    write(folder, FAULTS["call"][0])
    result = process("generate", "s.yaml", cwd=folder)
    assert is_one_message(result) and "s.yaml:13: force[0]" in result.err
    assert list(contents(folder)) == ["s.yaml"]


@pytest.mark.parametrize("verb", [("derive",), ("certify",), ("generate",)])
def test_without_observer(folder, verb):
    text = ONE[: ONE.index("observer:")] + ONE[ONE.index("envelope:") :]
    write(folder, text)
    result = stiction(*verb, "s.yaml")
    assert is_one_message(result) and "no `observer:` section" in result.err
    assert stiction("check", "s.yaml").code == 0
    assert list(contents(folder)) == ["s.yaml"]


def test_without_simulation(folder):
    write(folder, ONE[: ONE.index("simulation:")])
    result = stiction("simulate", "s.yaml", "-o", "log.csv")
    assert is_one_message(result) and "simulation" in result.err
    assert list(contents(folder)) == ["s.yaml"]


def test_without_envelope(folder):
    write(folder, ONE[: ONE.index("envelope:")])
    assert stiction("certify", "s.yaml").code == 0  # Psi of one mass depends on no operating point
