"""What is certified of a refused DFO region by region, against the generated twin and matrices written by hand."""

from __future__ import annotations

import json
import runpy
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
import sympy

from codegen.analysis.analysis import Analysis, analyse
from codegen.analysis.operating_points import evaluate
from codegen.certify import along_friction, enclosure
from codegen.certify.along_friction import AlongFriction
from codegen.certify.certify import Refusal, certify
from codegen.certify.content import frame
from codegen.certify.enclosure import Enclosure
from codegen.certify.family import Family, NotEnclosable
from codegen.certify.lyapunov import common_lyapunov_at
from codegen.certify.region_proofs import REGION_PROOFS, Regions, find_regions
from codegen.certify.regions import RegionSearch
from codegen.certify.remedies import sample_times
from codegen.certify.remedies.sample_times import largest_sample_times
from codegen.checker.verify import Refused, check
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.spec import Spec, parse_spec, read_spec

ROOT = Path(__file__).parents[2]
GENERATED = ROOT / "generated"
SHIPPED = ["one_mass_dfo", "rig_dfoa", "rig_dfob", "two_mass_gdfo"]
CLAIMS = [name for name in REGION_PROOFS if name != "sliding_limit.json"]
PAIRS = [(name, claim) for name in SHIPPED for claim in CLAIMS if (GENERATED / name / claim).exists()]
LEVELS = {"one_mass_dfo": [50.0], "rig_dfoa": [30.0], "rig_dfob": [30.0], "two_mass_gdfo": [10.0, 20.0]}
DELTA = 1e-4
DRAWN = 40


def content(name: str, claim: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((GENERATED / name / claim).read_text("utf-8"))
    return found


def number(text: str) -> float:
    return float(Fraction(text))


def analysis_of(name: str, changes: dict[str, str] | None = None) -> Analysis:
    path = ROOT / "specs/thesis" / f"{name}.yaml"
    text = path.read_text("utf-8")
    for old, new in (changes or {}).items():
        assert old in text
        text = text.replace(old, new)
    spec = parse_spec(text, path)
    return analyse(spec, build_observer(spec, build_system(spec)))


@pytest.mark.parametrize("claim", ["sliding.json", "weak.json", "recovery.json"])
def test_a_line_says_what_V_falls_by_and_which_number_is_the_rate(claim: str) -> None:
    given = content("rig_dfoa", claim)
    rate, h = number(given["decay_rate"]), number(given["sample_time"])
    regions = Regions({"passing.json": content("rig_dfoa", "passing.json"), claim: given}, h, False)
    line = regions.words[claim]
    if rate < 0:
        assert f"by at most the factor {1 - 2 * rate * h:.6g} a sample (rate {rate:.4g} 1/s)" in line
    else:
        assert f"each sample multiplies V by at most 1 - 2*rate*h, rate {rate:.4g} 1/s" in line


class Machine:
    """The committed twin, set to any operating point; the thesis' relations between states and estimates by hand."""

    def __init__(self, name: str) -> None:
        self.twin = SimpleNamespace(**runpy.run_path(str(GENERATED / name / "__init__.py")))
        self.parameters, self.levels = self.twin.Parameters(), np.array(LEVELS[name])
        self.h = self.parameters.sample_time
        k = vars_of(self.parameters)
        self.gain = np.array([v for n, v in k.items() if n == "K_a" or n.startswith("K_a_")])
        two = name == "two_mass_gdfo"
        self.onto = np.array([[1.0, 0.0], [-1.0, 1.0]]) if two else np.eye(1)  # U of (7.4), written again

    def state(self, estimates: Any) -> Any:
        """At x = 0, where z_v = v̂, z_f = f̂ (K_f2 = 0) and z_a = â − K_a f̂ û."""
        n = len(self.levels)
        v, f, a = estimates[:n], estimates[n : 2 * n], estimates[2 * n :]
        values = [*v, *f, *(a - self.gain * f * (self.onto.T @ v))]
        return self.twin.State(*[float(x) for x in values])

    def after(self, estimates: Any, velocity: Any, force: float) -> Any:
        """The estimates one sample later, the machine moving from x = 0 with a velocity."""
        n, state = len(self.levels), self.state(estimates)
        here = self.twin.Inputs(*[0.0] * n, force)
        self.twin.step(state, self.parameters, here)
        there = self.twin.Inputs(*[float(self.h * v) for v in velocity], force)
        out = self.twin.step(state, self.parameters, there)
        assert out.fault == 0
        return np.array([*vars_of(out).values()][: 3 * n])  # velocities, friction states and levels stand first

    @property
    def sizes(self) -> Any:
        """Of the estimates, times DELTA what they are moved by."""
        n = len(self.levels)
        return np.concatenate([np.ones(n), np.ones(n) * 1e-3, self.levels])

    def transition(self, v: Any, f: Any, force: float) -> tuple[Any, Any]:
        """(Φ by differences, the slips' rates) where the estimates are the truth."""
        point, size = np.concatenate([v, f, self.levels]), self.sizes
        columns = []
        for k in range(len(point)):
            moved = [point.copy(), point.copy()]
            moved[0][k] += DELTA * size[k]
            moved[1][k] -= DELTA * size[k]
            high, low = (self.after(p, v, force) for p in moved)
            columns.append((high - low) / (2 * DELTA * size[k]))
        following = self.after(point, v, force)
        return np.array(columns).T, self.onto.T @ (following[: len(v)] - v) / self.h


def vars_of(record: Any) -> dict[str, float]:
    return {name: getattr(record, name) for name in record.__slots__}


def box_of(cert: dict[str, Any]) -> dict[str, tuple[float, float]]:
    return {name: (number(low), number(high)) for name, (low, high) in cert["variables"].items()}


def largest(inner: Any, p: Any) -> float:
    root = np.linalg.inv(np.linalg.cholesky(p))
    return float(np.linalg.eigvalsh(root @ inner @ root.T).max())


@pytest.mark.parametrize(("name", "claim"), PAIRS)
def test_the_committed_twin_keeps_what_is_claimed_for_either_sign_of_friction(name: str, claim: str) -> None:
    cert, machine, dice = content(name, claim), Machine(name), np.random.default_rng(1)
    p = np.array([[number(x) for x in row] for row in cert["lyapunov_matrix"]])
    box, n, fall = box_of(cert), len(machine.levels), 1 - 2 * number(cert["decay_rate"]) * machine.h
    contacts = [e["name"].removeprefix("e_a_") for e in cert["error"] if e["name"].startswith("e_a_")]
    seen = worst = 0.0
    lowest, largest_level = (np.array([box[f"a_{c}"][end] for c in contacts]) for end in (0, 1))
    assert (lowest <= 0.95 * machine.levels).all() and (largest_level >= 1.05 * machine.levels).all()
    while seen < DRAWN:
        machine.levels = dice.uniform(lowest, largest_level) if seen % 2 else dice.choice([lowest, largest_level])
        side = dice.choice([-1.0, 1.0], n)
        f, u, rate = (
            side * [dice.uniform(*box.get(part.format(c), (-1, 1))) for c in contacts]
            for part in ("f_{}_along", "slip_{}_along", "slip_{}_dot_along")
        )
        if np.abs(np.abs(f) - 1).min() < 0.01 * DELTA:
            continue  # on the kink of the law there is no derivative
        v = np.linalg.solve(machine.onto.T, u)
        friction = machine.onto @ (machine.levels * f)
        force = float(friction[0] + rate[0]) if n == 1 else float(dice.uniform(-300, 300))
        step, rates = machine.transition(v, f, force)
        if n == 1:
            assert rates == pytest.approx(rate, rel=1e-3, abs=1e-3)
        allowed = np.array([box[f"slip_{c}_dot_along"][1] for c in contacts])
        if (np.abs(rates) > allowed).any():
            continue
        turn = np.diag([*[1.0] * 2 * n, *side])
        moved = turn @ step @ turn
        worst = max(worst, largest(moved.T @ p @ moved, p) - fall)
        seen += 1
    assert worst <= 2e-7


def test_a_claim_that_holds_for_the_declared_level_alone_is_not_issued() -> None:
    assert not (GENERATED / "one_mass_dfo/presliding.json").exists()
    found = RegionSearch(along(analysis_of("one_mass_dfo"))).regions()
    assert "presliding" in [region.kind for region in found]  # at the declared level alone


@pytest.mark.parametrize("name", SHIPPED)
def test_what_the_claims_say_of_each_other(name: str) -> None:
    """One P through zero and while sliding; its growth at a turn of friction; and the proved limit, by eigenvalues."""
    passing, recovery = content(name, "passing.json"), content(name, "recovery.json")
    assert passing["lyapunov_matrix"] == recovery["lyapunov_matrix"]
    assert number(passing["decay_rate"]) < 0 < number(recovery["decay_rate"])
    p = np.array([[number(x) for x in row] for row in recovery["lyapunov_matrix"]])
    fall = 1 - 2 * number(recovery["decay_rate"]) * number(recovery["sample_time"])
    for turn in recovery["reversals"]:
        flip = np.diag([-1.0 if k in turn["flips"] else 1.0 for k in range(len(p))])
        assert number(turn["growth"]) == pytest.approx(largest(flip @ p @ flip, p), rel=1e-5)
        assert number(turn["growth"]) * fall ** turn["dwell_samples"] <= 1
    limit, sliding = content(name, "sliding_limit.json"), content(name, "sliding.json")
    ratio = number(limit["decay_rate"]) / number(sliding["decay_rate"])
    assert 1 < ratio < 1.01
    machine, at = Machine(name), box_of(limit)
    if len(machine.levels) == 1:
        machine.levels = np.array([next(r[0] for v, r in at.items() if v.startswith("a_"))])
        f, u, rate = (np.array([next(r[0] for v, r in at.items() if v.startswith(s) and ("dot" in v) == d)])
                      for s, d in (("f_", False), ("slip_", False), ("slip_", True)))  # fmt: skip
        step, _ = machine.transition(u, f, float(machine.levels[0] * f[0] + rate[0]))
        radius = np.abs(np.linalg.eigvals(step)).max()
        h = machine.h
        assert (1 - radius**2) / (2 * h) == pytest.approx(number(limit["decay_rate"]), rel=5e-3)


@pytest.mark.parametrize("name", SHIPPED)
def test_the_whole_envelope_is_covered_through_zero(name: str) -> None:
    analysis = analysis_of(name)
    system = analysis.dynamics.observer.system
    largest_of = {str(s): float(high) for s, (_, high) in analysis.points.ranges.items()}
    for claim in ("weak.json", "passing.json"):
        box = box_of(content(name, claim))
        for contact, slip in zip(system.contacts, system.slip_velocity, strict=True):
            reach = sum(largest_of[str(v)] for v in slip.free_symbols)  # U is of ones
            assert box[f"f_{contact.name}_along"] == (0.0, largest_of[f"f_{contact.name}"])
            assert box[f"slip_{contact.name}_along"] == (-reach, reach)


def along(analysis: Analysis) -> AlongFriction:
    found = along_friction.along_friction(analysis)
    assert found is not None
    return found


def test_no_regions_where_the_signs_matter() -> None:
    """An offset in the law's rate makes both directions of slip differ: no claim for both, rather than a wrong one."""
    found = along(analysis_of("rig_dfoa"))
    uneven = {s: e + 1 if str(s).startswith("xi_plates") else e for s, e in found.dynamics.slopes.items()}
    assert along_friction._symmetric(found.dynamics, found.axes)
    assert not along_friction._symmetric(replace(found.dynamics, slopes=uneven), found.axes)


def test_an_error_is_what_it_is_of_by_any_name() -> None:
    """A velocity that is called a_v has the error e_a_v, which is no error of a level."""
    renamed = analysis_of("one_mass_dfo", {"velocity: v,": "velocity: a_v,", "  v: [-10, 10]": "  a_v: [-10, 10]"})
    assert [e.symbol.name for e in renamed.dynamics.observer.errors] == ["e_a_v", "e_f_rail", "e_a_rail"]
    found, usual = along(renamed), along(analysis_of("one_mass_dfo"))
    assert found.dynamics.sampled.shape == usual.dynamics.sampled.shape


def test_no_regions_where_another_fault_refuses() -> None:
    path = ROOT / "specs/thesis/one_mass_dfo.yaml"
    spec = read_spec(path)
    wrong = analysis_of("one_mass_dfo", {"K_a: -10": "K_a: 10"})
    assert wrong.spectral_abscissa > 1 and find_regions(wrong, partial(frame, spec, {}, "none")) is None


def test_false_mutants_of_regions_are_refused() -> None:
    """Wider regions, faster rates, less growth: each false one is refused."""
    sliding, weak = content("one_mass_dfo", "sliding.json"), content("one_mass_dfo", "weak.json")
    check(json.dumps(sliding))
    wide = sliding | {"variables": sliding["variables"] | {"f_rail_along": ["1/10", "101/100"]}, "splits": {}}
    slower = weak | {"decay_rate": "-1/10"}
    faster = sliding | {"decay_rate": content("one_mass_dfo", "sliding_limit.json")["decay_rate"]}
    reversal = content("one_mass_dfo", "recovery.json")
    cheap = reversal | {"reversals": [reversal["reversals"][0] | {"growth": "19/10"}]}
    for false in (wide, slower, faster, cheap):
        with pytest.raises(Exception, match=r"may not fall|may grow"):
            check(json.dumps(false))


def test_one_p_for_rates_of_both_signs() -> None:
    """Closed form: for x' = -x and x' = x/10 on scalars P = 1 shows 1 - h/2 and -1/10 - h/200, and no P more."""
    h = 0.01
    falling, rising = [np.array([[-1.0]])], [np.array([[0.1]])]
    assert common_lyapunov_at([(falling, 0.99), (rising, -0.101)], h) is not None
    assert common_lyapunov_at([(falling, 0.999), (rising, -0.101)], h) is None
    assert common_lyapunov_at([(falling, 0.99), (rising, -0.1)], h) is None
    many = [np.diag([-1.0 - k / 100, -2.0]) for k in range(100)]
    assert common_lyapunov_at([(many, 0.95)], h) is not None and common_lyapunov_at([(many, 1.0)], h) is None


def test_symbols_of_the_kinks() -> None:
    """Within its dead zone the reset integrator is linear, beyond it the slope is -c D1."""
    found = along(analysis_of("one_mass_dfo"))
    axis = found.axes[0]
    for state, slope in ((sympy.Rational(1, 2), "-0.01"), (sympy.Rational(1005, 1000), "-100000")):
        family = found.family({axis.state: (state, state), axis.slip: (-1, 1), axis.slip_rate: (0, 0)})
        assert family.parameters[sympy.Symbol("xi_f_rail", real=True)] == sympy.Rational(slope)


@pytest.mark.slow
def test_largest_sample_times_while_sliding() -> None:
    """The friction state follows the law at c D1 = 1e5 1/s, so that an explicit step is stable below 2e-5 s."""
    spec = read_spec(ROOT / "specs/thesis/one_mass_dfo.yaml")
    analysis = analysis_of("one_mass_dfo")
    assert largest_sample_times(spec, analysis) == dict.fromkeys(
        ("euler", "semi_implicit", "exponential", "implicit"), 0
    )
    found = largest_sample_times(spec, analysis, certify(spec, analysis, {}, "none"))
    assert set(found) == {"euler", "semi_implicit", "exponential"}
    assert all(0.98 * 2e-5 < h < 2e-5 for h in found.values())


def test_largest_sample_times_while_sliding_with_measured_velocity() -> None:
    """No entry of the error matrix has the slip then, and certify ended in a KeyError of its range; 2e-5 s as above."""
    path = ROOT / "specs/thesis/one_mass_dfo.yaml"
    text = path.read_text("utf-8").replace("velocity: estimated", "velocity: measured").replace(", K_v: 100", "")
    spec = parse_spec(text, path)
    analysis = analyse(spec, build_observer(spec, build_system(spec)))
    outcome = certify(spec, analysis, {}, "none")
    assert isinstance(outcome, Refusal) and outcome.regions is not None
    assert "slip_rail_along" not in outcome.regions.proofs["sliding.json"]["variables"]
    found = largest_sample_times(spec, analysis, outcome)
    assert found and all(0.98 * 2e-5 < h < 2e-5 for h in found.values())


@pytest.mark.slow
def test_largest_sample_times_of_a_varying_mass_matrix() -> None:
    """Below the spectral limit at points of the envelope, by numpy; one P for all of it costs a fifth at most."""
    spec = read_spec(ROOT / "specs/two_link_arm.yaml")
    analysis = analyse(spec, build_observer(spec, build_system(spec)), conditions=False)
    found = largest_sample_times(spec, analysis)
    assert set(found) == {"euler", "semi_implicit", "implicit"} and found["implicit"] == np.inf
    matrix = analysis.dynamics.in_force(analysis.dynamics.sampled)

    def radius(h: float) -> float:
        values = np.linalg.eigvals(evaluate(analysis.dynamics, matrix, analysis.points, h))
        return float(np.abs(1 + h * values).max())

    assert radius(found["euler"]) < 1 < radius(1.25 * found["euler"])


def test_no_sample_time_is_tried_for_a_matrix_that_certify_refuses_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    """An arm of three links with 18 expressions took a minute for it, and nothing could be said."""
    monkeypatch.setattr(enclosure, "MOST_PARAMETERS", 0)
    monkeypatch.setattr(sample_times, "_Proofs", lambda *_, **__: pytest.fail("a sample time was tried"))
    spec = read_spec(ROOT / "specs/two_link_arm.yaml")
    analysis = analyse(spec, build_observer(spec, build_system(spec)), conditions=False)
    outcome = certify(spec, analysis, {}, "none")
    assert isinstance(outcome, Refusal) and "at most 0 can be covered" in outcome.reason
    assert largest_sample_times(spec, analysis, outcome) == {}


def test_an_expression_that_cannot_be_enclosed_is_a_sample_time_of_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """The checker's refusal of an expression is no error of the command: no sample time is certified with it."""
    monkeypatch.setattr(sample_times, "Enclosure", Mock(side_effect=Refused("a power")))
    monkeypatch.setattr(sample_times._Proofs, "largest", lambda *_: 0.0)
    spec = read_spec(ROOT / "specs/two_link_arm.yaml")
    analysis = analyse(spec, build_observer(spec, build_system(spec)), conditions=False)
    assert set(largest_sample_times(spec, analysis).values()) == {0.0}


LENS = """
name: lens
coordinates: {{x: {{velocity: v, unit: m}}}}
inputs: {{w: {{unit: N}}}}
parameters: {{m: {{value: 0.35, unit: kg}}}}
mass_matrix: [[m]]
force: [w]
friction: {{distribution: [[1]], contacts: [{{name: rail, law: dahl, a: 2, c: 4000, unit: N}}]}}
observer: {{kind: dfo, velocity: estimated, sample_time: 0.0005, gains: {{K_a: -10, K_f1: -0.01, K_f2: 0, K_v: 100}}}}
envelope: {{v: {v}, v_dot: [-4, 4], f_rail: {f}}}
"""


def lens(v: str, f: str) -> tuple[Spec, Analysis]:
    spec = parse_spec(LENS.format(v=v, f=f), Path("lens.yaml"))
    return spec, analyse(spec, build_observer(spec, build_system(spec)))


@pytest.mark.slow
def test_an_envelope_inside_a_proved_region_gets_no_less_than_the_whole() -> None:
    """Ten parameters: what is not decided over the envelope itself is, over the region that holds it."""
    spec, analysis = lens("[0.006, 0.4]", "[0.99, 1]")
    found = certify(spec, analysis, {}, "none")
    assert isinstance(found, Refusal)
    assert found.regions is not None
    assert found.regions.whole == ("sliding.json",)
    assert found.regions.missing == ()
    named = "For every constant true friction level a_rail in [1.6, 2.4] N: "
    for name, proof in found.regions.proofs.items():
        if name == "sliding_limit.json":
            assert proof["claim"].startswith("No certificate can show a rate above ")
            assert "a_rail = 2.4, " in proof["claim"]
            continue
        assert proof["claim"].startswith(named), name
        assert any(
            "true friction level is constant and within a_rail in [1.6, 2.4] N" in a for a in proof["assumptions"]
        )
    check(json.dumps(found.regions.proofs["sliding.json"]))
    assert json.loads(found.proofs["sliding.json"]) == found.regions.proofs["sliding.json"]
    box = box_of(dict(found.regions.proofs["sliding.json"]))
    for name, (low, high) in {"f_rail": (0.99, 1), "slip_rail": (0.006, 0.4), "slip_rail_dot": (-4, 4)}.items():
        assert box[f"{name}_along"][0] <= low < high <= box[f"{name}_along"][1]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("v", "f", "whole"),
    [
        ("[-0.4, -0.006]", "[-1, -0.99]", ("sliding.json",)),
        ("[-0.4, -0.006]", "[0.99, 1]", ()),
        ("[0.002, 0.4]", "[0.99, 1]", ()),
        ("[0.02, 0.4]", "[0.9, 1]", ()),
        ("[0.02, 0.4]", "[-1, 1]", ()),
    ],
)
def test_which_region_holds_the_whole_envelope(v: str, f: str, whole: tuple[str, ...]) -> None:
    """Sliding is proved from |f| = 0.9874 and |v| = 0.005054 on, for a slip along the friction state."""
    spec, analysis = lens(v, f)
    found = find_regions(analysis, partial(frame, spec, {}, "none"))
    assert found is not None
    assert found.whole == whole


def test_too_many_expressions_are_told_in_the_quantities_of_the_spec() -> None:
    v = sympy.Symbol("v_rail", real=True)
    thetas = {sympy.Symbol(f"theta{k}"): v**k for k in range(1, 14)}
    family = Family({v: (0, 1)}, thetas, sympy.Matrix([sum(thetas)]))
    with pytest.raises(NotEnclosable, match="depend on v_rail through 13 expressions"):
        Enclosure(family)
