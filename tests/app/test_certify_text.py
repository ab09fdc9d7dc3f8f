"""What ``stiction certify`` prints, in which order, and what its bound leaves out."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from decimal import ROUND_CEILING
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from codegen.app.certify import Certified, certify
from codegen.app.derived import derived_from
from codegen.base.significant import rounded_to
from codegen.base.terminal import PlainConsole, output
from codegen.certify.bound.bounds import DomainBound
from codegen.checker import verify
from codegen.checker.errors import NOT_MOVED
from codegen.replay.engine import Engine

from .command import SPECS, stiction

TEXT = (SPECS / "one_mass.yaml").read_text().replace("  x_noise: [-5e-6, 5e-6]\n", "")
WITHOUT = "noise of x is taken as zero"


@cache
def found() -> Certified:
    return certify(SPECS / "one_mass.yaml")


def lines_of(verb: str, text: str, folder: Path, *options: str) -> list[str]:
    path = folder / "one_mass.yaml"
    path.write_text(text)
    done = stiction(verb, path, *options)
    assert done.code == 0, done.err
    return done.out.splitlines()


def test_a_weight_on_an_incline_is_proved_of_the_c(tmp_path: Path) -> None:
    """A constant angle in degrees: the kernel had no sine of a number, and `verify` ended with 5."""
    text = (SPECS / "one_mass.yaml").read_text()
    tilted = text.replace("  m: {", "  tilt: {value: 1, unit: deg}\n  grav: {value: 9.81, unit: m/s^2}\n  m: {", 1)
    tilted = re.sub(r"(?m)^  - w$", "  - w - m*grav*sin(tilt)", tilted, count=1)
    assert "sin(tilt)" in tilted
    assert "proved from its text" in " ".join(lines_of("certify", tilted, tmp_path))
    lines_of("generate", tilted, tmp_path, "-o", str(tmp_path / "made"))
    assert stiction("verify", tmp_path / "made").code == 0


def test_the_bound_is_printed_before_what_was_checked_and_what_is_assumed(tmp_path: Path) -> None:
    """A new user looked for the bound behind a screen of assumptions, and for what is not covered in 55 lines."""
    text = (SPECS / "one_mass.yaml").read_text()
    lines = lines_of("certify", text, tmp_path)
    assert re.fullmatch(r"certified: \|e_a_rail\| <= \S+ N long after a reversal; rate \S+ 1/s", lines[0])
    assert lines[1].startswith("  region  ") and len(lines) <= 25 and max(map(len, lines)) <= 120
    kinds = [line[2:18].strip() for line in lines[1:] if line[2:18].strip()]
    assert kinds[:3] == ["region", "rate", "error bound"] and kinds[-2:] == ["not covered", "more"]
    assert not any(WITHOUT in line for line in lines)
    details = lines_of("certify", text, tmp_path, "--details")
    assert details[: len(lines) - 1] == lines[:-1]
    kinds = [line[2:18].strip() for line in details[len(lines) - 1 :] if line[2:18].strip()]
    assert kinds.index("claim") < kinds.index("checked") < kinds.index("assumes") == len(kinds) - 1


def test_the_levels_of_a_dfo_are_in_the_region() -> None:
    """They are in the claim's first sentence; the envelope has no range for them."""
    made = certify(SPECS / "thesis" / "one_mass_dfo_implicit.yaml")
    assert made.certificate is not None and made.certificate.content["variables"]["a_rail"] == ["40", "60"]
    text = " ".join(made.text().split())
    assert "a_rail in [40, 60]" in text and "a reversal of" not in text
    alone = replace(made, region={**made.region, "a_rail": (50.0, 50.0)})
    assert "a_rail = 50 alone" in " ".join(alone.text().split())


def test_the_region_and_the_time_constant_are_those_of_the_certificate(tmp_path: Path) -> None:
    """By the factor of V in a sample that `checked` prints: it falls to e^-2 in the time constant."""
    words = " ".join(
        " ".join(lines_of("certify", (SPECS / "one_mass.yaml").read_text(), tmp_path, "--details")).split()
    )
    assert "sample time 0.001 s; in SI units v in [-5, 5], v_dot in [-210, 210], x_noise in [-5e-06, 5e-06];" in words
    time, factor = (
        float(re.search(said, words)[1]) for said in (r"time constant of at most (\S+) s", r"2\*alpha\*h = (\S+) in")
    )
    assert factor ** (time / 1e-3) == pytest.approx(math.exp(-2), rel=3e-3)
    growth, dwell = re.search(
        r"a reversal of rail multiplies V by at most (\S+), and (\d+) samples later", words
    ).groups()
    assert float(growth) * factor ** int(dwell) <= 1 < float(growth) * factor ** (int(dwell) - 2)


def test_of_many_errors_the_largest_is_in_the_first_line_and_each_is_stated() -> None:
    """A chain of 16 contacts printed 64 lines of bounds before what they assume."""
    one = found().bounds[0]
    bounds = [replace(one, name=f"e_a_{k}", steady=1.0 + k % 4) for k in range(8)]
    named = [{"name": b.name, "meaning": "as the contact's"} for b in bounds]
    outcome = replace(found().outcome, content={**found().outcome.content, "error": named})
    text = replace(found(), outcome=outcome, bounds=tuple(bounds)).text()
    words = " ".join(text.split())
    assert text.startswith("certified: 8 error bounds, the largest |e_a_3| <= 4 N long after a reversal; rate ")
    for k in range(8):
        assert words.count(f"|e_a_{k}| <= {1 + k % 4} N") == (3 if k == 3 else 1)
    said = (
        "reversal at most 8.623 N at the end of one, 3 samples after its start; counted from there, at most 5.75 N from"
    )
    assert words.count(said) == 1
    assert words.count("in between no bound is stated, and the error may be larger") == 1


@pytest.mark.parametrize("verb", ["certify", "gains"])
def test_noise_that_the_envelope_does_not_bound_is_said_to_be_taken_as_zero(verb: str, tmp_path: Path) -> None:
    lines = lines_of(verb, TEXT, tmp_path)
    text = " ".join(" ".join(lines).split())
    assert "long after a reversal" in text and not re.search(r"parts [^)]*noise [01]", text)
    assert WITHOUT in text


def test_the_rate_of_the_slowest_eigenvalue_says_its_measure(tmp_path: Path) -> None:
    """From the |z| that `gains` prints: -ln|z|/h there and (1 - |z|^2)/(2h) in `certify`."""
    text, h = (SPECS / "one_mass.yaml").read_text(), 1e-3
    gains = "\n".join(lines_of("gains", text, tmp_path))
    printed = re.search(r"= -ln\|z\|/h \(each sample multiplies it by \|z\| = (\S+)\)", gains)
    assert printed
    z = float(printed[1])
    certified = " ".join(" ".join(lines_of("certify", text, tmp_path, "--details")).split())
    found = re.search(r"z of a sample has \(1 - \|z\|\^2\)/\(2h\) = (\S+) 1/s, another measure than", certified)
    assert found and float(found[1]) == pytest.approx((1 - z**2) / (2 * h), rel=1e-3)


@pytest.mark.parametrize("noisy", [True, False])
def test_exact_measurements_are_said_to_be_the_rate_s_assumption_where_the_bound_has_noise(
    noisy: bool, tmp_path: Path
) -> None:
    lines = lines_of("certify", (SPECS / "one_mass.yaml").read_text() if noisy else TEXT, tmp_path, "--details")
    text = " ".join(" ".join(lines).split())
    assert ("include the position noise of the envelope" in text) is noisy
    assert "measurements are exact." in text


def test_a_long_line_is_broken_at_the_width_of_a_screen_and_in_a_file_it_is_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of a refused machine lines had 500 characters, which a screen breaks within words and not indented."""
    text = "refused: short\n  sliding.json: " + "in a_rail [40, 60], " * 30 + "\n"
    assert output.fitted(text) == text
    monkeypatch.setattr(PlainConsole, "is_terminal", True)
    monkeypatch.setattr(PlainConsole, "width", 70)
    first, *broken, last = output.fitted(text).split("\n")
    assert first == "refused: short" and last == "" and max(map(len, broken)) <= 70 and len(broken) > 8
    assert broken[0].startswith("  sliding.json: in") and all(re.match(r"    \S", line) for line in broken[1:])
    assert " ".join(broken).split() == text.split()[2:]


def test_a_bound_that_exceeds_the_friction_is_useless() -> None:
    made = found()
    assert not isinstance(made.bounds, str)
    bound = replace(made.bounds[0], steady=51.0, largest=50.0)
    assert bound.useless and not replace(bound, steady=49.0).useless
    first = replace(made, bounds=(bound,)).text().splitlines()[0]
    assert "<= 51 N" in first and "of no use" in first


def test_facts_are_broken_once_on_a_narrow_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Words broken at 114 characters were broken again at 80: every other line had a few words."""
    monkeypatch.setattr(PlainConsole, "is_terminal", True)

    def printed(width: int) -> list[str]:
        monkeypatch.setattr(PlainConsole, "width", width)
        return [line[18:].rstrip() for line in output.fitted(found().text()).splitlines()[1:]]

    wide, narrow = printed(400), printed(80)
    words = " ".join(narrow).split()
    assert words == " ".join(wide).split() and max(map(len, narrow)) <= 62
    short = sum(len(line) + 1 + len(after.split()[0]) <= 62 for line, after in pairwise(narrow) if after)
    assert short <= len(wide)  # a line with space left for the next word ends a fact


ARM = """name: tilt_arm
coordinates: {q: {velocity: w, unit: rad}}
inputs: {i: {unit: N*m}}
parameters: {J: {value: 0.05, unit: kg*m^2}}
mass_matrix: [[J]]
force: [i]
friction: {distribution: [[1]], contacts: [{name: gear, a: 0.35, unit: N*m}]}
observer: {kind: cfo, velocity: estimated, gains: {K_F: 60, K_v: 900}, sample_time: 4 ms}
envelope: {w: [-3, 3], w_dot: [-20, 20], q_noise: [-0.01 deg, 0.01 deg]}
"""


def test_a_proposed_sample_time_is_the_printed_one_and_a_useless_bound_is_said_with_it(tmp_path: Path) -> None:
    """Two lines, one above the other, gave 0.000885 s and 0.000886 s for the longest sample time."""
    (tmp_path / "arm.yaml").write_text(ARM)
    done = stiction("certify", tmp_path / "arm.yaml")
    lines = " ".join(done.err.split())
    largest = re.search(r"at these gains: euler (\S+) s", lines)
    proposed = re.search(r"sample_time: (\S+) with a rate of [^;]*; its error bound is of little use: (.*?)$", lines)
    assert done.code == 3 and largest and proposed and largest[1] == proposed[1]
    words = re.match(r"\|e_a_gear\| <= (\S+) N\*m, the friction at most 0.35 N\*m", proposed[2])
    assert words and float(words[1]) > 0.35


AXIS = """name: axis
coordinates: {x: {velocity: v, unit: m}}
inputs: {u: {unit: N}}
parameters: {m: {value: 79, unit: kg}}
mass_matrix: [[m]]
force: [u]
friction: {distribution: [[1]], contacts: [{name: guide, LAW, unit: N}]}
effects: [EFFECTS]
observer: {kind: gcfo, velocity: estimated, gains: {K_F: 600, K_v: 200}, sample_time: 1 ms}
envelope: {v: [-0.3, 0.3], v_dot: [-2, 2], x_noise: [-0.5 um, 0.5 um]}
"""
NARROW = "law: gaussian, F_c: 40, F_s: 65, v_s: 5 mm/s"
OTHER_LEVEL = "{kind: position_dependent_friction, on: guide, parameters: {amplitude: 5, period: 0.01, phase: 0}}"


@pytest.mark.parametrize(
    ("law", "effects", "friction"),
    [(NARROW, "", "at most 65 N by the envelope or the law"), (NARROW, OTHER_LEVEL, "65 N as declared")],
)
def test_a_bound_above_the_friction_is_said_to_be_of_no_use(
    law: str, effects: str, friction: str, tmp_path: Path
) -> None:
    """A new user read 1128 N for a guide with 65 N of friction, without a word. To 20 mm/s the law is steep everywhere.

    Up to 0.3 m/s it is not above the threshold of the bound, which takes its slope there alone.
    """
    fast = AXIS.replace("LAW", law).replace("EFFECTS", effects)
    slow = fast.replace("v: [-0.3, 0.3]", "v: [-0.02, 0.02]")
    text = " ".join(" ".join(lines_of("certify", slow, tmp_path)).split())
    bound = re.search(r"\|e_a_guide\| <= (\S+) N long after a reversal \(of no use: not below the friction", text)
    assert bound and float(bound[1]) > 65
    assert f"friction itself is {friction}" in text and "raise K_F" in text and "a small Stribeck speed" in text
    found = re.search(r"\|e_a_guide\| <= (\S+) N long after a reversal;", " ".join(lines_of("certify", fast, tmp_path)))
    assert found and float(found[1]) < 2


def test_what_to_change_for_a_better_bound_is_called_as_in_the_spec(tmp_path: Path) -> None:
    """The user of a tracking observer read "raise K_F", a gain that it does not have, and "narrow NAME_dot"."""
    tracker = AXIS.replace("LAW", "law: tustin, F_c: 40, F_s: 65, v_c: 5 mm/s").replace("EFFECTS", "")
    tracker = (
        tracker.replace("gcfo", "to").replace("K_F: 600", "K_2: -600").replace("v: [-0.3, 0.3]", "v: [-0.02, 0.02]")
    )
    text = " ".join(" ".join(lines_of("certify", tracker, tmp_path)).split())
    assert "raise |K_2|, or narrow v_dot in the envelope" in text
    assert "K_F" not in text and "NAME_" not in text


def test_a_declared_stribeck_curve_is_named_as_the_reason_for_no_bound(tmp_path: Path) -> None:
    """The slope of `g` meant nothing to a user whose `force:` has no speed in it."""
    stribeck = "{kind: stribeck, on: guide, parameters: {delta: 25, v_s: 5 mm/s}}"
    text = AXIS.replace("LAW", "law: coulomb, a: 40").replace("EFFECTS", stribeck)
    words = " ".join(" ".join(lines_of("certify", text, tmp_path)).split())
    assert "the effects on guide are curved over the slip speed" in words and "`stiction laws` lists them" in words


def test_a_distribution_that_depends_on_the_position_is_named_as_the_reason(tmp_path: Path) -> None:
    """The message named a state of the code, three times."""
    text = (SPECS / "one_mass.yaml").read_text()
    moving = re.sub(r"distribution: *(\[\[1\]\]|\n *- \[1\])", "distribution: [[1 + kap*x]]", text)
    moving = re.sub(r"(?m)^envelope:.*\n", "envelope:\n  x: [-1, 1]\n", moving)
    moving = moving.replace("  m: {", "  kap: {value: 0.25, unit: 1/m}\n  m: {", 1)
    assert moving.count("kap*x") == 1
    said = " ".join(" ".join(lines_of("certify", moving, tmp_path)).split())
    assert "U depends on the position" in said and "state.z" not in said, said


def test_another_reason_is_not_taken_for_a_distribution_that_depends_on_the_position(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise verify.Refused(f"{NOT_MOVED}: ['state.z_v']")

    monkeypatch.setattr(verify, "of_its_proof", refused)
    (path := tmp_path / "one_mass.yaml").write_text((SPECS / "one_mass.yaml").read_text())
    assert certify(path).outcome.not_by_kernel == f"{NOT_MOVED}: ['state.z_v']"


def test_a_force_with_a_formula_is_not_refused_like_that_of_a_robot_file(tmp_path: Path) -> None:
    text = (SPECS / "one_mass.yaml").read_text()
    text = re.sub(r"(?m)^  - w$", "  - w - b*v*log(2 + v*v/(u*u))/u", text, count=1)
    path = tmp_path / "one_mass.yaml"
    path.write_text(text.replace("  m: {", "  b: {value: 0.1, unit: N}\n  u: {value: 1, unit: m/s}\n  m: {", 1))
    done = stiction("certify", path)
    assert "contains a logarithm" in done.err and "formula" not in done.err and "K_2" not in done.err


def test_a_domain_that_no_domain_helps_says_what_does(tmp_path: Path) -> None:
    text = (SPECS / "one_mass_domain.yaml").read_text()
    drag = re.sub(
        r"(?m)^(effects:.*\n)?observer:",
        "effects: [{kind: quadratic_drag, on: x, parameters: {c: 0.1}}]\nobserver:",
        text,
        count=1,
    )
    (path := tmp_path / "drag.yaml").write_text(drag)
    done = stiction("certify", path)
    assert done.code == 2 and "expected a spec without that, or no `domain`" in done.err, done.err


GANTRY = """
name: gantry
coordinates: {{p: {{velocity: vp, unit: m}}, q: {{velocity: vq, unit: m}}}}
inputs: {{F1: {{unit: N}}, F2: {{unit: N}}}}
parameters:
  m: {{value: 15, unit: kg}}
  k: {{value: 2000, unit: N/mm}}
mass_matrix: {mass}
force: {force}
friction:
  distribution: {distribution}
  contacts:
    - {{name: left, law: coulomb, a: 60, unit: N}}
    - {{name: right, law: coulomb, a: 75, unit: N}}
observer: {{kind: gcfo, velocity: estimated, integration: semi_implicit, gains: {{K_F: 500, K_v: [300, 300]}},
  sample_time: 0.5 ms}}
envelope: {{vp: [-1, 1], vq: {vq}, vp_dot: [-4, 4], vq_dot: {vq_dot}}}
"""


def test_two_coordinates_with_a_stiff_spring_are_better_as_mean_and_difference(tmp_path: Path) -> None:
    each = GANTRY.format(
        mass="[[m, 0], [0, m]]",
        force="[F1 - k*(p - q), F2 + k*(p - q)]",
        distribution="[[1, 0], [0, 1]]",
        vq="[-1, 1]",
        vq_dot="[-4, 4]",
    )
    mean = GANTRY.format(
        mass="[[2*m, 0], [0, m/2]]",
        force="[F1 + F2, (F1 - F2)/2 - k*q]",
        distribution="[[1, 1], [0.5, -0.5]]",
        vq="[-0.01, 0.01]",
        vq_dot="[-1, 1]",
    )
    said = [" ".join(" ".join(lines_of("certify", text, tmp_path)).split()) for text in (each, mean)]
    bounds = [float(re.search(r"\|e_a_left\| <= (\S+) N", text)[1]) for text in said]
    assert bounds[1] < 60 < bounds[0] and bounds[1] < bounds[0] / 50
    assert "their mean and their difference" in said[0] and "their mean" not in said[1]


def test_what_rounding_does_to_the_bound_in_the_domain_is_printed(tmp_path: Path) -> None:
    """It may add more there than long after a reversal, and its ``slip_speed`` may be too low for single precision."""
    text = (SPECS / "one_mass_domain.yaml").read_text()
    path = tmp_path / "one_mass_domain.yaml"
    path.write_text(text.replace("slip_speed: 1,", "slip_speed: 0.56395,"))
    made = certify(path)
    assert not isinstance(made.rounding, str) and not isinstance(made.bounds, str)
    domain, double, single = made.bounds[0].domain, made.rounding["double"], made.rounding["single"]
    assert isinstance(domain, DomainBound) and domain.inside is not None and double.inside is not None
    assert domain.inside < double.inside < 1.001 * domain.inside
    assert single.inside is None and single.least_slip_speed is not None and 0.56395 < single.least_slip_speed < 0.6
    words = " ".join(made.text().split())
    assert f"is at most {rounded_to(double.inside, 4, ROUND_CEILING)} N in double precision" in words
    least = rounded_to(single.least_slip_speed, 4, ROUND_CEILING)
    assert f"has no bound in single precision, where the least slip_speed is {least}" in words


def test_a_bound_that_needs_a_speed_above_those_of_the_envelope_is_said_to_hold_nowhere(tmp_path: Path) -> None:
    """The threshold of one_mass is 0.122 m/s: in an envelope of slower motion the bound was printed without a word."""
    text = (SPECS / "one_mass.yaml").read_text()
    assert "  v: [-5, 5]" in text
    for fastest, reached in (("0.12", False), ("0.13", True)):
        lines = lines_of("certify", text.replace("  v: [-5, 5]", f"  v: [-{fastest}, {fastest}]"), tmp_path)
        words = " ".join(" ".join(lines).split())
        assert ("(holds nowhere in the region: slips there are below the threshold)" in lines[0]) != reached
        assert ("says nothing: rail slides at 0.12 m/s or less there" in words) != reached


def test_what_a_run_above_the_bound_needs_is_printed_as_an_assumption() -> None:
    """A run that loses samples is above the bound, and so is one with a level that moves.

    The mass accelerates by 210 m/s² over eight invalid samples: 16 N at the valid ones after them, 1.79 N printed.
    """
    made, machine = found(), derived_from(SPECS / "one_mass.yaml")
    assert not isinstance(made.bounds, str)
    engine, period = Engine(machine.program, machine.sources), 0.001
    time = np.arange(1200) * period
    for lost, level, excess in ((0, 0.0, False), (8, 0.0, True), (0, 100.0, True)):
        pushed = 0.008 if lost else 0.0
        acceleration = np.where((time >= 0.6) & (time < 0.6 + pushed - 1e-9), 210.0, 0.0)
        true = 50 + level * time
        v = 1 + np.concatenate([[0.0], np.cumsum(acceleration * period)[:-1]])
        x = np.concatenate([[0.0], np.cumsum(v * period + acceleration * period**2 / 2)[:-1]])
        rows = np.column_stack([x, acceleration + true])
        rows[601 : 601 + lost, 0] = np.nan
        engine.start(rows[0])
        estimates, faults = engine.run(rows)
        error = np.abs(true - estimates[:, engine.outputs.index("a_hat_rail")])
        used = (np.asarray(faults) == 0) & (time > 0.59)
        assert (error[used].max() > made.bounds[0].steady) == excess
    words = " ".join(made.text().split())
    assert "friction obeys its law; all samples are valid" in words
