"""What a reversal leaves of the errors (checker/reversal.py): forged claims are refused, true ones are not exceeded."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import pytest

from codegen.checker import ellipsoid, errors, kernel, reversal
from tests.checker.test_ellipsoid import bounds, content
from tests.checker.test_kernel import GENERATED, texts

CFOS = ("belt_axis", "chain", "emps", "one_mass", "one_mass_cfo_semi_implicit", "rig", "two_mass",
        "two_mass_cancellation")  # fmt: skip


def turn(claim: Any) -> Any:
    return claim["reversals"][0]


def scaled(claim: Any, field: str, k: int, factor: str) -> None:
    turn(claim)[field][k] = str(Fraction(turn(claim)[field][k]) * Fraction(factor))


MORE = "a reversal leaves more than its `after`"
FORGERIES: dict[str, tuple[Callable[[Any, Any], Any], str]] = {
    "a velocity that is smaller after it": (lambda c, _: scaled(c, "after", 0, "0.998"), MORE),
    "a level that is smaller after it": (lambda c, _: scaled(c, "after", 1, "0.998"), MORE),
    "a faster velocity before it": (lambda c, _: scaled(c, "before", 0, "1.01"), MORE),
    "a worse level before it": (lambda c, _: scaled(c, "before", 1, "1.01"), MORE),
    "more samples": (lambda c, _: turn(c).update(samples="4"), MORE),
    "more turns": (lambda c, _: turn(c).update(turns="2"), MORE),
    "a slip that changes faster": (lambda c, _: turn(c).update(change="22/100"), MORE),
    "a slip that does not change": (lambda c, _: turn(c).update(change="0"), "does not change"),
    "a slip that changes backwards": (lambda c, _: turn(c).update(change="-1"), "does not change"),
    "more friction": (lambda c, _: c["friction"].update({"true.a_rail": "60"}), MORE),
    "friction below 0": (lambda c, _: c["friction"].update({"true.a_rail": "-50"}), "below 0"),
    "no friction": (lambda c, _: c["friction"].update({"true.a_rail": "0"}), "not act against the slip"),
    "friction of no size": (lambda c, _: c.pop("friction"), "."),
    "friction that pushes": (
        lambda c, _: c["push"][0].__setitem__(2, "1/1000*sign.rail"), "do not act on the errors as claimed"),
    "friction that acts less": (
        lambda c, _: c["push"][0].__setitem__(2, "-1/2000*sign.rail"), "do not act on the errors as claimed"),
    "friction without its sign": (
        lambda c, _: c["push"][0].__setitem__(2, "-1/1000"), "do not act on the errors as claimed"),
    "more noise": (lambda c, _: c["noise"].update({"inputs.x": "1/100000"}), "."),
    "no jump of the level": (lambda c, _: turn(c).update(jump="0"), "other estimates than by `jump`"),
    "a jump the other way": (lambda c, _: turn(c).update(jump="-20"), "other estimates than by `jump`"),
    "half of the jump": (lambda c, _: turn(c).update(jump="10"), "other estimates than by `jump`"),
    "no sign": (lambda c, _: turn(c).update(sign=""), "no sign that one level has"),
    "another sign": (lambda c, _: turn(c).update(sign="sign.ground"), "no sign that one level has"),
    "an error below 0 before it": (lambda c, _: scaled(c, "before", 0, "-1"), "."),
    "one error": (lambda c, _: turn(c).update(after=["1"]), "some of the errors alone"),
    "errors as an object": (lambda c, _: turn(c).update(after={"1": "1 mN", "9": ""}), "after: expected is a list"),
    "a remark": (lambda c, _: turn(c).update(unit="mN"), "fields are not so named"),
    "a field too few": (lambda c, _: turn(c).pop("turns"), "."),
    "an object of entries": (lambda c, _: c.update(reversals={"0": turn(c)}), "reversals: expected is a list"),
    "a text of entries": (lambda c, _: c.update(reversals="reversals"), "reversals: expected is a list"),
    "an entry that is a text": (lambda c, _: c.update(reversals=["before"]), "."),
    "samples below 0": (lambda c, _: turn(c).update(samples="-1"), "no number of samples or turns"),
    "samples in other digits": (lambda c, _: turn(c).update(samples="٣"), "no number of samples or turns"),
    "part of a sample": (lambda c, _: turn(c).update(samples="1/2"), "no number of samples or turns"),
    "more samples than the limit": (lambda c, _: turn(c).update(samples="201"), "no number of samples or turns"),
    "an error that is no number": (lambda c, _: turn(c)["after"].__setitem__(0, "NaN"), "."),
    "a sign in a force besides": (
        lambda _, p: p["acceleration"].update(
            {"true.v": "(-true.a_rail*sign.rail + sign.rail + inputs.w)/parameters.m"}), "."),
    "a set of any friction": (lambda c, _: c["sets"][0].update(friction="any"), "^friction$"),
}  # fmt: skip


@pytest.mark.parametrize("why", FORGERIES)
def test_a_forged_reversal_is_refused(why: str) -> None:
    claim, proof = content("one_mass", "ellipsoid.json"), content("one_mass", "proof.json")
    bounds("one_mass", claim, proof)
    change, words = FORGERIES[why]
    change(claim, proof)
    with pytest.raises(Exception, match=words):
        bounds("one_mass", claim, proof)


def test_a_reversal_where_the_machine_has_the_sign_in_another_force_is_refused() -> None:
    """The machine's other force would follow the code's sign in the claim, and its own in truth."""
    claim, proof = content("one_mass", "ellipsoid.json"), content("one_mass", "proof.json")
    shown = errors.prove(proof, texts("one_mass"))
    for more in ("sign.rail", "2*sign.rail*true.v", "true.a_rail"):
        other = proof | {"acceleration": {"true.v": f"(-true.a_rail*sign.rail + {more} + inputs.w)/parameters.m"}}
        of = reversal.Reversal("sign.rail", 1, 3, 1, Fraction(1), Fraction(20), Fraction(50), [])
        with pytest.raises(ValueError, match="is in more than the friction"):
            reversal.estimated_slip(of, other, shown)
    assert ellipsoid.left_by(turn(claim), proof, claim, shown, ellipsoid.dynamics(proof, claim, shown))


def test_a_claim_about_less_is_accepted() -> None:
    claim = content("one_mass", "ellipsoid.json")
    for less in (
        {"samples": "2"},
        {"turns": "0"},
        {"change": "1/100"},
        {"before": ["1/10", "1"]},
        {"before": ["0", "0"]},
    ):
        bounds("one_mass", claim | {"reversals": [turn(claim) | less]})


@pytest.mark.parametrize("name", CFOS)
def test_every_contact_of_a_cfo_has_a_reversal(name: str) -> None:
    """And what its bounds begin with is what a reversal of their contact leaves."""
    proof, claim = content(name, "proof.json"), content(name, "ellipsoid.json")
    signs = [e["sign"] for e in proof["errors"] if e["sign"]]
    assert [entry["sign"] for entry in claim["reversals"]] == signs
    left = {entry["sign"]: [*map(Fraction, entry["after"])] for entry in claim["reversals"]}
    begun = [after for ball in claim["sets"] for after in ball.get("after", [])]
    assert len(begun) == len(signs)
    for after in begun:
        (sign,) = (e["sign"] for e, c in zip(proof["errors"], after["row"], strict=True) if c != "0")
        assert all(a >= b for a, b in zip(map(Fraction, after["start"]), left[sign], strict=True))


def test_the_assumption_about_the_sample_of_a_reversal_names_the_bounded_contacts() -> None:
    """Of every shipped certificate, and no other contact: the text is made from what ellipsoid.json proves."""
    said = []
    for folder in sorted(path.parent for path in GENERATED.glob("*/certificate.json")):
        claim = json.loads((folder / "ellipsoid.json").read_text()) if (folder / "ellipsoid.json").exists() else {}
        contacts = [entry["sign"].removeprefix("sign.") for entry in claim.get("reversals", [])]
        about = [x for x in content(folder.name, "certificate.json")["assumptions"] if "the sample of a reversal" in x]
        bound = (
            f", but ellipsoid.json bounds the errors after a reversal of {', '.join(contacts)}, this change included."
        )
        for line in about:
            assert line.partition("V is not bounded in that sample")[2] == (bound if contacts else "."), folder.name
            said.append(folder.name)
        assert about or not contacts
    assert {*CFOS, "one_mass_domain", "two_link_arm"} == {*said}


@pytest.mark.parametrize("name", ["one_mass", "rig", "two_mass"])
def test_no_run_of_the_equations_leaves_more(name: str) -> None:
    """By the equations of the errors and the code's own signs, in doubles, with a level, signs and slips at random.

    The slip of the contact is any with which the estimate keeps the code's sign; the friction of a sample is any mean
    that the slip's sign allows. None of this is the checker's: it carries points, and the checker sets.
    """
    proof, claim, dice = content(name, "proof.json"), content(name, "ellipsoid.json"), random.Random(7)
    for entry in claim["reversals"]:
        runs = Runs(proof, claim, entry)
        worst = [0.0] * len(runs.after)
        for _ in range(4000):
            found = runs.run(dice)
            if found:
                worst = [max(w, abs(x) / a) for w, x, a in zip(worst, found, runs.after, strict=True)]
        assert max(worst) <= 1 and worst[runs.level] > 0.5, (name, entry["sign"], worst)


class Runs:
    """Errors of a proof's machine and code through a reversal, from the matrices, of a slip that is one or two
    velocities."""

    def __init__(self, proof: Any, claim: Any, entry: Any) -> None:
        ones = {s: kernel.term(1) for s in proof["signs"]}
        sizes = [x for kind in ("noise", "drift") for x in claim[kind].values()]

        def value(text: str, names: Any = ones) -> float:
            return float(kernel.Text(names, {}).value(text).constant())

        self.phi = [[value(x) for x in row] for row in proof["matrix"]]
        self.push = [[value(x) * float(Fraction(d)) for x, d in zip(row, sizes, strict=False)] for row in claim["push"]]
        self.level = next(i for i, e in enumerate(proof["errors"]) if e["sign"] == entry["sign"])
        at = len(sizes) + [*claim["friction"]].index(proof["errors"][self.level]["truth"])
        self.friction = [value(row[at]) for row in claim["push"]]
        self.most = float(Fraction(claim["friction"][proof["errors"][self.level]["truth"]]))
        zero = {e["estimate"]: kernel.Poly() for e in proof["errors"]}
        of = proof["signs"][entry["sign"]]
        self.slip = [value(of, zero | {e["estimate"]: kernel.term(1)}) for e in proof["errors"]]
        self.before, self.after = ([float(Fraction(x)) for x in entry[part]] for part in ("before", "after"))
        self.change, self.jump = float(Fraction(entry["change"])), float(Fraction(entry["jump"]))
        self.samples, self.turns = int(entry["samples"]), int(entry["turns"])

    def run(self, dice: random.Random) -> list[float] | None:
        """The errors at the end, without noise in what is seen; None where the sign turns too often."""
        level = self.most * dice.choice((1, 1, dice.random()))
        error = [b * dice.choice((-1, 1, dice.uniform(-1, 1))) for b in self.before]  # s (a - a_hat), v - v_hat
        sign, turned = 1.0, 0
        seen = dice.random() ** 4 * self.change  # the estimated slip times the sign
        goes = dice.choice((-1, 1, dice.uniform(-1, 1)))
        for _ in range(self.samples):
            u = sign * seen + sum(p * e for p, e in zip(self.slip, error, strict=True))
            later = u + self.change * goes
            share = opposite(sign * u, sign * later)
            d = 2 * level * (share if dice.random() < 0.8 else share * dice.random())
            w = [dice.choice((-1, 1)) for _ in self.push[0]]
            moved = [
                sum(a * e for a, e in zip(row, error, strict=True)) + sum(b * x for b, x in zip(push, w, strict=True))
                for row, push in zip(self.phi, self.push, strict=True)
            ]
            moved = [x - sign * d * b for x, b in zip(moved, self.friction, strict=True)]
            estimate = later - sum(p * e for p, e in zip(self.slip, moved, strict=True))
            if sign * estimate < 0:
                sign, turned = -sign, turned + 1
                plain = -sign * moved[self.level] + self.jump * abs(estimate)  # a - a_hat
                moved[self.level] = sign * plain
            error, seen = moved, abs(estimate)
        return error if turned <= self.turns else None


def opposite(u: float, later: float) -> float:
    """The share of a sample in which a slip that moves evenly from u to later is below 0."""
    if min(u, later) >= 0:
        return 0.0
    return 1.0 if max(u, later) <= 0 else abs(min(u, later)) / abs(later - u)
