"""A proved number remains one as it is printed: bounds are rounded up, decreases down, sizes that are assumed down."""

from __future__ import annotations

import json
import random
import re
from decimal import ROUND_CEILING, ROUND_FLOOR
from fractions import Fraction

import pytest

from codegen.app.certify import certify
from codegen.base.significant import float_above, rounded_to
from codegen.checker import enclosure, theorem, verify
from tests.app.command import SPECS
from tests.checker.forged import certificate, check, sources

DICE = random.Random(7)
NUMBERS = [Fraction(DICE.randrange(-(10**9), 10**9), DICE.randrange(1, 10**9) * 4**k) for k in range(60)]
NUMBERS += [1 / x for x in NUMBERS] + [Fraction(1, 3), Fraction(-2, 3), Fraction(0), Fraction(7, 8), Fraction(10**9)]
HUGE = [Fraction(3) ** 1000, -(Fraction(3) ** 1000), Fraction(1, 3**1000), Fraction(-97, 3**1500)]


def read(text: str) -> Fraction:
    power = re.fullmatch(r"(-?)2\^(-?\d+)", text)
    return Fraction(text) if power is None else (-1 if power[1] else 1) * Fraction(2) ** int(power[2])


@pytest.mark.parametrize("digits", [2, 4, 9])
def test_exact_fractions(digits: int) -> None:
    for x in NUMBERS:
        above, below = (Fraction(rounded_to(x, digits, way)) for way in (ROUND_CEILING, ROUND_FLOOR))
        assert below <= x <= above
        assert above - below <= abs(x) * Fraction(10) ** (1 - digits)
        assert (above == below) == (x in (above, below))
        assert Fraction(repr(float_above(x))) >= x


def test_exact_fractions_of_the_checker() -> None:
    for x in [*NUMBERS, *HUGE]:
        assert read(enclosure.least(x)) <= x <= read(enclosure.most(x))
        assert Fraction(enclosure.exact(x)) == x


@pytest.mark.parametrize("name", ["one_mass", "one_mass_domain", "two_mass"])
def test_what_verify_prints_of_the_c(name: str) -> None:
    """Against the exact numbers of proof.json and ellipsoid.json, which have no short decimals here."""
    files, proof, claim = sources(name), certificate(name, "proof.json"), certificate(name, "ellipsoid.json")
    more = 1 + Fraction(1, 3 * 10**6)
    proof["decay_rate"] = str(Fraction(proof["decay_rate"]) / more)
    for turn in proof["reversals"]:
        turn.update(growth=str(Fraction(turn["growth"]) * more), dwell=str(int(turn["dwell"]) + 1))
    for ball in claim["sets"]:
        for bound in (*ball["rows"], *(b for after in ball.get("after", []) for b in after["bounds"])):
            bound[-1] = str(Fraction(bound[-1]) * more)
    files["ellipsoid.json"] = json.dumps(claim).encode()
    said = "\n".join(verify.check(json.dumps(proof), sources=files).proved)
    rate, h = Fraction(proof["decay_rate"]), theorem.proved(proof, files)["c"].values["parameters.sample_time"]
    ((fall, slow),) = re.findall(r"by at most (\S+) \(decay rate (\S+) 1/s\)", said)
    assert Fraction(fall) > 1 - 2 * rate * h and Fraction(slow) < rate
    grown = [Fraction(x) for x in re.findall(r"grows by at most the factor ([^;]+);", said)]
    assert all(x > Fraction(turn["growth"]) for x, turn in zip(grown, proof["reversals"], strict=True))
    bounds = [
        x
        for ball in theorem.ellipsoid_claim(proof, theorem.proved(proof, files), files["ellipsoid.json"])[1]
        for x in ball
    ]
    pairs = re.findall(r"in the long run at most (\S+)|(\S+) from sample \d+ on", said)
    assert all(Fraction(a or b) > x for (a, b), x in zip(pairs, bounds, strict=True))


def test_verify_says_above_which_slip_its_sign_is_known() -> None:
    """For the rows that are a contact's slip, and for no multiple or other sum of velocities."""
    files = sources("two_mass")
    proof, claim = (certificate("two_mass", kind) for kind in ("proof.json", "ellipsoid.json"))

    def said() -> list[tuple[str, ...]]:
        files["ellipsoid.json"] = json.dumps(claim).encode()
        lines = "\n".join(verify.check(json.dumps(proof), sources=files).proved)
        return re.findall(r"so (.+) has the sign of (.+) where \|(.+)\| is above (\S+)", lines)

    (ball,) = claim["sets"]
    assert [row[:2] for row in ball["rows"][:2]] == [["1", "-1"], ["0", "1"]]
    files["ellipsoid.json"] = json.dumps(claim).encode()
    bounds = theorem.ellipsoid_claim(proof, theorem.proved(proof, files), files["ellipsoid.json"])[1]
    proved = bounds[0][:2]
    names = [("v1_hat - v2_hat", "v1 - v2", "v1 - v2"), ("v2_hat", "v2", "v2")]
    assert [tuple(shown[:3]) for shown in said()] == names
    for shown, bound in zip(said(), proved, strict=True):
        assert bound <= Fraction(shown[3]) < bound * Fraction(1000001, 1000000)
    ball["rows"][0] = [str(2 * Fraction(x)) for x in ball["rows"][0]]
    ball["rows"][1] = ["1", "0", "0", "0", "1"]
    assert said() == []


@pytest.mark.parametrize("kind", ["certificate.json", "limit.json"])
def test_what_verify_prints_of_the_matrices(kind: str) -> None:
    """A refutation is of a fall that is no smaller than the one printed."""
    content = certificate("two_mass", kind)
    (fact,) = (fact for fact in check(content, {}).facts if "multiplied" in fact)
    exact = 1 - 2 * Fraction(content["decay_rate"]) * Fraction(content["sample_time"])
    (printed,) = map(Fraction, re.findall(r"= (\S+) in every", fact))
    assert printed >= exact if kind == "certificate.json" else printed <= exact


def test_what_certify_prints() -> None:
    found = certify(SPECS / "one_mass_domain.yaml")
    text = " ".join(found.text().split())
    (bound,), rounding = found.bounds, found.rounding
    assert not isinstance(rounding, str) and not isinstance(bound, str) and bound.proved
    first, again = (float(x) for x in re.findall(r"\|e_a_rail\| <= (\S+) N (?:long|in the long)", text))
    assert first == again >= bound.steady
    (speed,) = map(float, re.findall(r"have the same sign: rail (\S+) m/s \(proved for the C code\)", text))
    (threshold,) = bound.slip_speeds
    assert speed >= threshold.threshold > threshold.more == 1
    steady = text.split("rounding adds at most")[1].split(" to the bound")[0]
    added = [float(x) for x in re.findall(r"(\S+) N in (?:double|single) precision", steady)]
    assert all(a >= r.adds for a, r in zip(added, rounding.values(), strict=True))
    share = [float(x) for x in re.findall(r"[a-z] (\S+) %", text.split("remains valid up to")[1].split(" domain ")[0])]
    assert all(100 * s >= x for s, x in zip(bound.largest_model_error.values(), share, strict=True))
    (rate,) = map(float, re.findall(r"certified rate ([\d.e+-]+)", text))
    assert rate <= found.outcome.decay_rate
