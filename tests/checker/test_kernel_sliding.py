"""The kernel's proofs of a sliding DFO: those shipped, the twin beside them, and forgeries."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.checker import errors, kernel, verify
from tests.certify.test_regions import DELTA, Machine, content
from tests.checker.test_kernel import mutant

GENERATED = Path(__file__).parents[2] / "generated"
SLIDING = ["one_mass_dfo", "rig_dfoa", "rig_dfob", "two_mass_gdfo"]


def files(name: str) -> dict[str, str]:
    return {path.name: path.read_text("utf-8") for path in (GENERATED / name).glob(f"{name}.[ch]")}


def proof(name: str) -> dict[str, Any]:
    found: dict[str, Any] = content(name, "proof.json")
    return found


def number(text: str, at: dict[str, float]) -> float:
    """An expression of a proof in floats, read by Python: names with dots become keys."""
    names = {name.replace(".", "_"): value for name, value in at.items()}
    for name in sorted(at, key=len, reverse=True):
        text = text.replace(name, name.replace(".", "_"))
    return float(eval(text, {"__builtins__": {}}, names))


@pytest.mark.parametrize("name", SLIDING)
def test_the_sliding_of_a_dfo_is_proved_of_the_c(name: str) -> None:
    found = errors.prove(proof(name), files(name))
    assert found["first order"] and not found["whole"]
    sliding = content(name, "sliding.json")
    assert proof(name)["lyapunov_matrix"] == sliding["lyapunov_matrix"]
    share = kernel.Fraction(proof(name)["decay_rate"]) / kernel.Fraction(sliding["decay_rate"])
    assert 0.9 <= share <= 1
    for level in (v for v in sliding["variables"] if v.startswith("a_")):
        assert proof(name)["box"][f"true.{level}"] == [str(kernel.Fraction(e)) for e in sliding["variables"][level]]


def moves_as_said(name: str, said: dict[str, Any], points: int = 20) -> bool:
    """Whether the committed twin moves by matrix and rest at random points of the box, and V falls there."""
    machine, dice = Machine(name), np.random.default_rng(4)
    truths, n = [e["truth"] for e in said["errors"]], len(machine.levels)
    shown = errors.prove(said, files(name))
    values = {p: float(x) for p, x in shown["c"].values.items()}
    P = np.array([[number(x, {}) for x in row] for row in said["lyapunov_matrix"]])
    root = np.linalg.inv(np.linalg.cholesky(P))
    for _ in range(points):
        at = {x: dice.uniform(*sorted(number(e, values) for e in ends)) for x, ends in said["box"].items()}
        at |= {"": 1.0} | {sign: dice.choice([-1.0, 1.0]) for sign in said["signs"]}
        at |= {x: at[s] * at[x] for x, s in said["along"].items()} | dict.fromkeys(said["positions"], 0.0)
        truth, turn = np.array([at[x] for x in truths]), np.diag([at[e["sign"]] for e in said["errors"]])
        del at[""]
        machine.levels = truth[2 * n :]
        step, _ = machine.transition(truth[:n], truth[n : 2 * n], at["inputs.w"])
        matrix = np.array([[number(x, at | values) for x in row] for row in said["matrix"]])
        added = max(np.abs(truth).max(), np.abs(machine.gain * (machine.onto.T @ truth[:n])).max())
        rounding = 4e-16 * added / (DELTA * machine.sizes)  # of a difference, by column
        close = 1e-4 * np.abs(matrix).max(axis=1).min() + rounding
        moved = np.allclose(turn @ step @ turn, matrix, rtol=1e-4, atol=close)
        off = turn[2 * n :, 2 * n :] @ (truth - machine.after(truth, truth[:n], at["inputs.w"]))[2 * n :]
        left = np.abs(off - [number(rest, at | values) for rest in said["rest"][2 * n :]])
        fall = np.linalg.eigvalsh(root @ matrix.T @ P @ matrix @ root.T).max()
        if not moved or (left > 1e-6 * np.abs(truth[2 * n :])).any() or fall > float(shown["fall"]) * (1 + 1e-9):
            return False
    return True


@pytest.mark.parametrize("name", SLIDING)
def test_the_twin_moves_as_the_proof_says_for_either_sign(name: str) -> None:
    """Matrix and rest at random points of the box, against differences of the committed twin's steps."""
    assert moves_as_said(name, proof(name))


def judged(name: str, count: int) -> tuple[int, int]:
    """How many of so many mutants of a proof are proved, and how many of these move otherwise."""
    dice, text = random.Random(name), json.dumps(proof(name), indent=1)
    proved = false = 0
    for _ in range(count):
        try:
            with verify.theorem.or_refused("a mutant"):
                said = json.loads(mutant(text, dice))
                errors.prove(said, files(name))
        except verify.Refused:
            continue
        proved += 1
        false += not moves_as_said(name, said, 6)
    return proved, false


def test_mutants_of_a_sliding_that_are_proved_are_true() -> None:
    proved, false = judged("rig_dfoa", 20)
    assert proved >= 1 and false == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", SLIDING)
def test_mutants_of_every_sliding_that_are_proved_are_true(name: str) -> None:
    proved, false = judged(name, 300)
    assert proved >= 20 and false == 0


FORGERIES: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "a smaller friction state than that of sliding": (
        lambda p: p["box"].update({"true.f_rail": ["1/10", "1"]}),
        "V may not fall",
    ),
    "any acceleration": (lambda p: p["box"].update({"inputs.w": ["-100000000", "100000000"]}), "V may not fall"),
    "no range of the level": (lambda p: p["box"].pop("true.a_rail"), "without a range"),
    "a faster fall": (lambda p: p.update({"decay_rate": "12"}), "V may not fall"),
    "nothing besides": (lambda p: p.update({"rest": ["0", "0", "0"]}), "does not move the errors"),
    "no word of it": (lambda p: p.pop("rest"), "does not move the errors"),
    "the other sign of it": (lambda p: p["rest"].__setitem__(2, f"-({p['rest'][2]})"), "does not move the errors"),
    "a rest that is an error": (
        lambda p: p["rest"].__setitem__(0, "true.v - outputs.v_hat"),
        "outputs.v_hat is nothing that is known",
    ),
    "a rest for two errors": (lambda p: p.update({"rest": p["rest"][:2]}), "argument 2 is shorter"),
    "no domain": (lambda p: p.update({"domain": []}), "does not move the errors"),
    "the law on the other side of its kink": (
        lambda p: p.update({"domain": ["sign.rail*(1 - outputs.f_hat_rail)", p["domain"][0]]}),
        "does not move the errors",
    ),
    "a level without the sign": (lambda p: p["errors"][2].update({"sign": ""}), "does not move the errors"),
    "a friction state whose range does not": (lambda p: p["along"].update({"true.f_rail": ""}), "V may not fall"),
    "a range along what is no sign": (lambda p: p["along"].update({"true.v": "true.v"}), "not so named"),
    "a range along a sign of nothing": (lambda p: p["along"].update({"true.v": "sign.own"}), "not so named"),
    "a range of another truth": (lambda p: p["along"].update({"true.x": "sign.rail"}), "not so named"),
    "a machine whose level drifts": (lambda p: p["acceleration"].update({"true.a_rail": "0"}), "sizes do not fit"),
}


@pytest.mark.parametrize("kind", FORGERIES)
def test_a_forged_proof_of_sliding_is_refused(kind: str) -> None:
    change, why = FORGERIES[kind]
    forged = proof("one_mass_dfo")
    change(forged)
    with pytest.raises(verify.Refused, match=why):
        verify.by_kernel_alone(forged, {name: text.encode() for name, text in files("one_mass_dfo").items()})


@pytest.mark.parametrize("kind", FORGERIES)
def test_a_certificate_beside_a_proof_with_a_rest_is_not_bound_to_the_code(kind: str) -> None:
    """Whether the kernel would accept that proof is not asked; where the rest is gone, it is, and the proof refused."""
    forged = proof("one_mass_dfo")
    FORGERIES[kind][0](forged)
    sources = {name: text.encode() for name, text in files("one_mass_dfo").items()}
    sources["proof.json"] = json.dumps(forged).encode()
    text = (GENERATED / "one_mass_dfo/sliding.json").read_text("utf-8")
    if {*forged.get("rest", [])} <= {"0"}:
        with pytest.raises(verify.Refused, match=FORGERIES[kind][1]):
            verify.check(text, GENERATED / "one_mass_dfo", None, sources)
    else:
        report = verify.check(text, GENERATED / "one_mass_dfo", None, sources)
        assert verify.status(report) == verify.NO_CODE and not report.proved


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("v_hat - parameters->rail_D2 * f_hat_rail", "v_hat - 2.0 * parameters->rail_D2 * f_hat_rail"),
        ("0.5 * fabs(f_hat_rail - 1.0)", "0.5 * fabs(f_hat_rail - 1.5)"),
        ("0.5 * fabs(f_hat_rail - 1.0)", "0.6 * fabs(f_hat_rail - 1.0)"),
        ("(f_hat_rail * v_dot_hat + v_hat", "(f_hat_rail * v_dot_hat - v_hat"),
        ("parameters->h_K_a * (f_hat", "0.5 * parameters->h_K_a * (f_hat"),
        ("+ parameters->K_a * v_hat * f_hat_rail", "- parameters->K_a * v_hat * f_hat_rail"),
        ("inputs->w - F_hat_rail", "inputs->w + F_hat_rail"),
        ("outputs->a_hat_rail = a_hat_rail;", "outputs->a_hat_rail = a_hat_rail + 1.0;"),
    ],
)
def test_other_code_of_a_dfo_is_refused(old: str, new: str) -> None:
    sources = files("one_mass_dfo")
    assert sources["one_mass_dfo.c"].count(old) == 1
    with pytest.raises(ValueError, match=r"does not move the errors|do not show the estimates"):
        errors.prove(proof("one_mass_dfo"), sources | {"one_mass_dfo.c": sources["one_mass_dfo.c"].replace(old, new)})


def test_what_is_printed_of_a_sliding_dfo(capsys: pytest.CaptureFixture[str]) -> None:
    """A rest beside the matrix, ranges along the friction, and a status that says: in its domain."""
    assert verify.main([str(GENERATED / "one_mass_dfo/proof.json")]) == verify.DOMAIN
    told = capsys.readouterr().out
    for line in (
        "only where sign(rail)*f_rail is in [1.0002, 1.0099999]",
        "only where a_rail is in [40, 60]",
        "only where sign(rail)*(f_hat_rail - 1) > 0",
        "whatever the errors; what this does to V is not bounded",
        "verified for the C, under the conditions above (exit status 4)",
    ):
        assert line in told
