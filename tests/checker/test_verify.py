"""The certificate checker: what it accepts is true (judged by floating-point eigenvalues), what is false it refuses.

The judge `margin` shares no code with the checker: it has its own evaluator, samples the envelope densely instead of
enclosing it, and takes eigenvalues instead of pivots.
"""

from __future__ import annotations

import ast
import copy
import fcntl
import functools
import hashlib
import itertools
import json
import math
import os
import pty
import random
import re
import shutil
import signal
import struct
import subprocess
import sys
import termios
import time
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from codegen.app import verify as of_library
from codegen.base.errors import BadInput
from codegen.checker import enclosure, frame, kernel, verify
from codegen.checker.verify import Refused, check
from tests.slow_cases import drawn, examples, slow_except

Cert = dict[str, Any]
SOURCE = Path(verify.__file__)


# ---- certificates written by hand ------------------------------------------------------------------------------------


def certificate(n: int, **fields: Any) -> Cert:
    base: Cert = {
        "format": "stiction-certificate/1",
        "tool": {"name": "by hand", "version": "0", "command": "none"},
        "subject": {"name": "example", "spec_sha256": "0" * 64, "files": {}},
        "observer": {"kind": "cfo", "velocity": "estimated", "integration": "euler"},
        "claim": "The error decays at the rate α.",
        "error": [{"name": f"e_a_{i}", "meaning": "truth less estimate", "unit": "m/s"} for i in range(n)],
        "variables": {},
        "splits": {},
        "parameters": [],
        "cover": [],
        "reversals": [],
        "along": [],
        "assumptions": ["The friction level is constant between reversals."],
    }
    return base | fields


def scalar() -> Cert:
    """Φ = 1/2, so V falls to a quarter; 1 - 2αh = 0.26."""
    reversal = {"contact": "0", "flips": [0], "growth": "1", "dwell_samples": 0}
    return certificate(
        1, sample_time="1/100", decay_rate="37", matrix=[["-50"]], lyapunov_matrix=[["1"]], reversals=[reversal]
    )


def cfo() -> Cert:
    """A = [[-kv, -1/m], [kF kv, 0]]; with this P the best rate is 7.736, the least growth 4.5473 and dwell 101."""
    kv, kF, m = 100, 10, 1
    return certificate(
        2,
        sample_time="1/1000",
        decay_rate="15/2",
        matrix=[[f"-{kv}", ["neg", ["/", "1", f"{m}"]]], [["*", f"{kF}", f"{kv}"], "0"]],
        lyapunov_matrix=[["1", "487/10000"], ["487/10000", "58/10000"]],
        reversals=[{"contact": "1", "flips": [1], "growth": "91/20", "dwell_samples": 101}],
    )


def turning() -> Cert:
    """An angle and a mass in the matrix, through cos and 1/m; the best rate for this P is about 3.8."""
    return certificate(
        2,
        sample_time="1/1000",
        decay_rate="37/10",
        variables={"q": ["-1", "1"], "m": ["9/10", "11/10"]},
        splits={"q": ["-1", "-2/5", "0", "1/3", "1"]},
        parameters=[{"name": "c", "expression": ["cos", "q"]}, {"name": "w", "expression": ["/", "1", "m"]}],
        matrix=[[["+", "-100", ["*", "-20", "c"]], ["neg", ["*", "w", "c"]]], ["1000", "0"]],
        lyapunov_matrix=[["1", "382/10000"], ["382/10000", "47/10000"]],
        reversals=[{"contact": "1", "flips": [1], "growth": "36/10", "dwell_samples": 175}],
    )


def covered() -> Cert:
    """Φ = 1 - w (2 + cos q)/(2(3 + sin q)): the slowest and the fastest angle are none of a cell's ends."""
    return scalar() | {
        "decay_rate": "13",
        "variables": {"q": ["-4", "4"], "w": ["1", "6/5"]},
        "parameters": [{"name": "c", "expression": ["/", ["+", "2", ["cos", "q"]], ["+", "3", ["sin", "q"]]]},
            {"name": "p", "expression": "w"}],
        "matrix": [[["*", "-50", "c", "p"]]],
        "cover": [["q t", "1/2", ["w", "11/10", "", ""], ["q t", "3/4", "", ""]]],
    }  # fmt: skip


EXAMPLES = {"scalar": scalar, "cfo": cfo, "turning": turning, "covered": covered}


def text(cert: Cert) -> str:
    return json.dumps(cert)


# ---- the independent judge -------------------------------------------------------------------------------------------


def number(raw: str) -> float:
    top, _, bottom = raw.partition("/")
    return int(top) / int(bottom or 1)


def value(raw: Any, names: dict[str, float]) -> float:
    if isinstance(raw, str):
        return names[raw] if raw in names else number(raw)
    op, *rest = raw
    args = [value(item, names) for item in rest]
    functions: dict[str, Callable[..., float]] = {
        "+": lambda *x: sum(x),
        "*": lambda *x: math.prod(x),
        "neg": lambda x: -x,
        "/": lambda x, y: x / y,
        "^": lambda x, n: x**n,
        "abs": abs,
        "sin": math.sin,
        "cos": math.cos,
        "exp": math.exp,
        "sqrt": math.sqrt,
    }
    return functions[op](*args)


def largest(inner: np.ndarray, P: np.ndarray) -> float:
    """The largest λ with det(inner - λP) = 0."""
    root = np.linalg.inv(np.linalg.cholesky(P))
    return float(np.linalg.eigvalsh(root @ inner @ root.T).max())


def margin(cert: Cert) -> float:
    """How far the claim is from false: negative if any sample of the envelope contradicts it."""
    h, alpha = number(cert["sample_time"]), number(cert["decay_rate"])
    fall = 1 - 2 * alpha * h
    margins = [h, fall]
    ranges = [np.linspace(*map(number, ends), 7) for ends in cert["variables"].values()]
    points = [dict(zip(cert["variables"], point, strict=True)) for point in itertools.product(*ranges)]
    P = lyapunov(cert)
    if not np.array_equal(P, P.T) or np.diag(P).min() <= 0:
        return -1.0
    scale = np.sqrt(np.diag(P))
    margins.append(float(np.linalg.eigvalsh(P / np.outer(scale, scale)).min()))
    if min(margins) <= 0:
        return min(margins)
    for at in points:
        try:
            theta = {entry["name"]: value(entry["expression"], at) for entry in cert["parameters"]}
            A = np.array([[value(x, theta) for x in row] for row in cert["matrix"]])
        except ZeroDivisionError:
            return -1.0
        phi = np.eye(len(A)) + h * A
        margins.append(fall - largest(phi.T @ P @ phi, P))
    for entry in cert["reversals"]:
        growth = number(entry["growth"])
        if [cert["error"][i]["name"] for i in entry["flips"]] != [f"e_a_{entry['contact']}"]:
            return -1.0  # a contact turns its own error
        J = np.diag([-1.0 if i in entry["flips"] else 1.0 for i in range(len(P))])
        margins += [growth - max(largest(J @ P @ J, P), 1)]
        margins += [1 - growth * fall ** entry["dwell_samples"]]
    return min(margins)


def lyapunov(cert: Cert) -> np.ndarray:
    return np.array([[number(x) for x in line] for line in cert["lyapunov_matrix"]])


def accepted(cert: Cert) -> bool:
    try:
        check(text(cert))
    except Refused as fault:
        assert str(fault)
        return False
    return True


# ---- accepted --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", EXAMPLES)
def test_true_certificates_are_verified(name: str) -> None:
    cert = EXAMPLES[name]()
    assert margin(cert) >= 0
    report = check(text(cert))
    assert report.name == "example"
    assert report.facts[0].startswith(f"P is positive definite: {len(cert['error'])} positive pivots")
    assert "V is multiplied by at most 1 - 2*alpha*h" in report.facts[1]
    assert report.facts[-1].startswith("reversal of ")
    assert report.unbound == ()


def counted(fact: str) -> tuple[int, int]:
    """The numbers of vertices and of cells that a fact tells."""
    vertices, cells = re.findall(r"\d+", fact.partition(":")[0])
    return int(vertices), int(cells)


def test_cells_and_vertices_are_counted() -> None:
    assert counted(check(text(scalar())).facts[1]) == (1, 1)
    assert counted(check(text(turning())).facts[1]) == (16, 4)
    cert = turning()
    cert["variables"]["m"] = ["1", "1"]  # w is then a single number: one vertex along it
    assert counted(check(text(cert)).facts[1]) == (8, 4)


def test_limits_of_the_examples_are_where_the_judge_sees_them() -> None:
    """A little less is refused: the rate, growth, dwell and envelope of these examples are nearly the best."""
    for field, edits in {
        "rate": ("decay_rate", "78/10"),
        "matrix": ("matrix", [["-100", "-1"], ["1040", "0"]]),
    }.items():
        cert = cfo() | dict([edits])
        assert margin(cert) < 0, field
        with pytest.raises(Refused, match="V may not fall"):
            check(text(cert))
    for key, worse, reason in (
        ("growth", "454/100", "grow by more than 4.54"),
        ("dwell_samples", 100, "1.0"),
    ):
        cert = cfo()
        cert["reversals"][0][key] = worse
        assert margin(cert) < 0
        with pytest.raises(Refused, match=reason):
            check(text(cert))
    cert = turning()
    cert["variables"]["q"], cert["splits"] = ["-3/2", "3/2"], {}
    assert margin(cert) < 0
    with pytest.raises(Refused, match=r"fall, q in \[-1.5, 1.5\], m in \[0.9, 1.1\]: V may not fall"):
        check(text(cert))


def test_a_matrix_of_sines_and_cosines_falls_just_as_fast_as_the_judge_says() -> None:
    """By a dense sample of the circle."""
    q = np.linspace(-np.pi, np.pi, 100_001)
    slow, fast = ((2 + np.cos(q)) / (3 + np.sin(q))).min(), ((2 + np.cos(q)) / (3 + np.sin(q))).max()
    worst = max((1 - 0.5 * slow) ** 2, (1 - 0.6 * fast) ** 2)
    best = (1 - worst) / 2 * 100
    assert 14.5 < best < 14.6
    assert accepted(covered())
    fine: Any = ""
    for k in range(31, 0, -1):
        fine = ["q t", f"{k}/32", "", fine]
    within = covered() | {"cover": [fine], "decay_rate": str(Fraction(f"{best * 0.999:.6f}"))}
    beyond = covered() | {"cover": [fine], "decay_rate": str(Fraction(f"{best * 1.0001:.6f}"))}
    assert accepted(within) and not accepted(beyond)
    assert check(text(covered())).facts[1].startswith("every coefficient of 4 cells: V is multiplied by at most")


def test_the_interior_of_the_envelope_counts_and_not_its_corners() -> None:
    """Both ends of q are harmless, its middle is not: only an enclosure with its extremum sees that."""
    cert = scalar()
    cert |= {"variables": {"q": ["0", "355/113"]}, "parameters": [{"name": "s", "expression": ["sin", "q"]}]}
    cert["matrix"] = [[["+", "-50", ["*", "30", "s"]]]]
    assert margin(cert) < 0
    assert (
        margin(cert | {"variables": {"q": ["0", "0"]}}) >= 0
        and margin(cert | {"variables": {"q": ["355/113", "355/113"]}}) >= 0
    )
    assert not accepted(cert)
    assert not accepted(cert | {"splits": {"q": ["0", "1/2", "1", "2", "355/113"]}})


@pytest.mark.parametrize("bad", range(6))
def test_every_cell_counts(bad: int) -> None:
    """The pole -50 + 30 exp(-1000 (q - centre)^2) is too slow in one of six cells only."""
    centre = f"{2 * bad + 1}/2"
    away = ["^", ["+", "q", ["neg", centre]], "2"]
    cert = scalar() | {"variables": {"q": ["0", "6"]}, "splits": {"q": [str(k) for k in range(7)]}}
    cert["parameters"] = [{"name": "bump", "expression": ["exp", ["*", "-1000", away]]}]
    cert["matrix"] = [[["+", "-50", ["*", "30", "bump"]]]]
    with pytest.raises(Refused, match=rf"fall, q in \[{bad}, {bad + 1}\]: V may not fall"):
        check(text(cert))
    for ends in ([f"{bad}", f"{10 * bad + 4}/10"], [f"{10 * bad + 6}/10", f"{bad + 1}"]):  # on either side of the bump
        assert accepted(cert | {"variables": {"q": ends}, "splits": {}})


@pytest.mark.parametrize("bad", list(itertools.product((-1, 1), repeat=3)))
def test_every_corner_counts(bad: tuple[int, ...]) -> None:
    """-50 + 30 (1 + s1 t1)(1 + s2 t2)(1 + s3 t3)/8, with signs s and t in [-1, 1], is too slow in one corner only."""
    cert = scalar()
    cert["variables"] = {f"x{i}": ["-1", "1"] for i in range(3)}
    cert["parameters"] = [{"name": f"t{i}", "expression": f"x{i}"} for i in range(3)]
    cert["matrix"] = [[["+", "-50", ["*", "30/8", *(["+", "1", ["*", str(s), f"t{i}"]] for i, s in enumerate(bad))]]]]
    with pytest.raises(Refused, match="V may not fall"):
        check(text(cert))
    for i, s in enumerate(bad):
        assert accepted(cert | {"variables": cert["variables"] | {f"x{i}": [str(-s)] * 2}})


def test_a_refutation_holds_for_all_that_its_enclosure_holds() -> None:
    """Φ = 1 − h√q, h = 1/100: 1 − 2αh = Φ² for α = 1.404214 at q = 2."""
    root = scalar() | {"matrix": [[["neg", "c"]]], "reversals": [], "along": ["1"], "lyapunov_matrix": [["-1"]]}
    root |= {"variables": {"q": ["2", "2"]}, "parameters": [{"name": "c", "expression": ["sqrt", "q"]}]}
    assert accepted(root | {"decay_rate": "1404215/1000000"}) and not accepted(root | {"decay_rate": "1404213/1000000"})
    root["variables"] = {"q": ["199/100", "2"]}  # no V falls so fast at any of them: from 1.40072 on at q = 1.99
    assert accepted(root | {"decay_rate": "142/100"}) and not accepted(root | {"decay_rate": "1404213/1000000"})
    assert not accepted(root | {"decay_rate": "2", "splits": {"q": ["199/100", "1995/1000", "2"]}})


def test_a_rate_below_zero_bounds_growth() -> None:
    growing = scalar() | {"matrix": [["50"]], "decay_rate": "-125/2", "reversals": []}  # 1 - 2αh = 9/4 = Φ², Φ = 3/2
    assert any("V is multiplied by at most 1 - 2*alpha*h = 2.25" in fact for fact in check(text(growing)).facts)
    assert not accepted(growing | {"decay_rate": "-62499999/1000000"})
    held = scalar() | {"matrix": [["0"]], "decay_rate": "0", "reversals": []}
    assert accepted(held) and not accepted(held | {"decay_rate": "1/1000000"})
    along = {"along": ["1"], "lyapunov_matrix": [["-1"]]}
    assert accepted(growing | along | {"decay_rate": "-62"})  # no V grows by at most 1 - 2αh = 2.24
    assert not accepted(growing | along | {"decay_rate": "-63"})


def test_semidefinite_is_enough_and_a_zero_pivot_needs_a_zero_column() -> None:
    exact = scalar() | {"decay_rate": "75/2"}  # 1 - 2αh = 1/4 = Φ²
    assert accepted(exact)
    assert not accepted(exact | {"decay_rate": "37500001/1000000"})
    pair = certificate(2, sample_time="1/100", decay_rate="75/2", matrix=[["-50", "0"], ["0", "-50"]])
    assert accepted(pair | {"lyapunov_matrix": [["1", "0"], ["0", "1"]]})
    skew = pair | {"lyapunov_matrix": [["1", "0"], ["0", "1"]], "matrix": [["-50", "1/1000"], ["0", "-60"]]}
    assert not accepted(skew) and margin(skew) < 0  # its gap is [[0, -x], [-x, y]]


# ---- mutation --------------------------------------------------------------------------------------------------------


def places(node: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    yield path
    children = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, child in children:
        yield from places(child, (*path, key))


def at(cert: Cert, path: tuple[Any, ...]) -> Any:
    node: Any = cert
    for key in path:
        node = node[key]
    return node


def replaced(cert: Cert, path: tuple[Any, ...], new: Any) -> Any:
    if not path:
        return new
    cert = copy.deepcopy(cert)
    at(cert, path[:-1])[path[-1]] = new
    return cert


def is_rational(raw: Any) -> bool:
    return isinstance(raw, str) and raw.lstrip("-").replace("/", "").isdigit() and len(raw) < 60


OPERATORS = (("cos", "sin", "exp", "abs", "neg"), ("+", "*"), ("c", "w"), ("q", "m"))


def mutants(cert: Cert, dice: random.Random, count: int, numbers_only: bool) -> Iterator[Cert]:
    """One to three numbers (or operators or names) of the claim's mathematics changed; still in the format."""
    claim = (
        "sample_time",
        "decay_rate",
        "variables",
        "splits",
        "parameters",
        "matrix",
        "lyapunov_matrix",
        "cover",
        "reversals",
    )
    spots = [path for path in places(cert) if path and path[0] in claim and path[-1] not in ("name", "contact")]
    leaves = [path for path in spots if is_rational(at(cert, path)) or type(at(cert, path)) is int]
    for path in spots:
        leaves += [path for group in OPERATORS if not numbers_only and at(cert, path) in group]
    for _ in range(count):
        mutant = cert
        for path in dice.sample(leaves, dice.choice([1, 1, 1, 2, 3])):
            old = at(cert, path)
            if type(old) is int:
                limit = len(cert["error"]) - 1 if "flips" in path else 10**8
                new: Any = dice.choice([x for x in (old + 1, old - 1, 0, 2 * old, 10**8) if 0 <= x <= limit])
            elif not is_rational(old):
                new = dice.choice(next(group for group in OPERATORS if old in group))
            else:
                x, size = Fraction(old), Fraction(1, 10 ** dice.randrange(7))
                nudge = dice.choice([1, -1]) * size
                new = str(dice.choice([-x, Fraction(0), 2 * x, x / 2, x + nudge, *[x * (1 + nudge)] * 6]))
            mutant = replaced(mutant, path, new)
            if {"lyapunov_matrix", "matrices"} & {*path} and dice.random() < 0.9:  # mostly keep it symmetric
                mutant = replaced(mutant, (*path[:-2], path[-1], path[-2]), new)
        yield mutant


@pytest.mark.parametrize("name", EXAMPLES)
@drawn(150, 400)
def test_accepted_mutants_are_true(name: str, draws: int) -> None:
    """And for matrices of plain numbers refused ones are false, so that the checker is not merely strict."""
    dice, cert = random.Random(name), EXAMPLES[name]()
    verdicts = {True: 0, False: 0}
    for mutant in mutants(cert, dice, draws, numbers_only=name not in ("turning", "covered")):
        verdict = accepted(mutant)
        verdicts[verdict] += 1
        if verdict:
            assert margin(mutant) >= -1e-9, mutant
        elif name not in ("turning", "covered"):
            growths = [Fraction(entry["growth"]) for entry in mutant["reversals"]]
            assert min(growths) < 1 or margin(mutant) <= 1e-9, mutant
    assert min(verdicts.values()) >= 0.15 * draws, verdicts


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_accepted_mutants_are_true_at_length(seed: int) -> None:
    dice = random.Random(seed)
    for cert in (build() for build in EXAMPLES.values()):
        for mutant in mutants(cert, dice, 1500, numbers_only=False):
            assert not accepted(mutant) or margin(mutant) >= -1e-9, mutant


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_object_has_exactly_its_fields(name: str) -> None:
    cert = EXAMPLES[name]()
    for path in places(cert):
        node = at(cert, path)
        free = ("variables",), ("splits",), ("subject", "files")
        if isinstance(node, dict) and path not in free:
            with pytest.raises(Refused, match=r"missing or extra.*'more'"):
                check(text(replaced(cert, path, node | {"more": "1"})))
            for key in node:
                said = "expected is a certificate: an object" if key == "format" else rf"missing or extra.*'{key}'"
                with pytest.raises(Refused, match=said):
                    check(text(replaced(cert, path, {k: v for k, v in node.items() if k != key})))


WRONG = (None, True, False, 1.5, -1, 10**30, math.nan, math.inf, [], {}, [[]])
NO_RATIONALS = "", " 1", "1 ", "+1", "1.0", "1e2", "1/0", "1/-2", "1_0", "١", "--1", "1/", "/2", "nan", "\n1", "0x1"


@pytest.mark.parametrize("name", slow_except([*EXAMPLES], ["scalar", "turning"]))  # these have every field
def test_every_value_has_its_type(name: str) -> None:
    cert = EXAMPLES[name]()
    for path in places(cert):
        old = at(cert, path)
        for new in (*WRONG, "", "\n", "é\u202e", *NO_RATIONALS):
            if type(new) is type(old) and (old == new or isinstance(new, (str, dict, list))):
                continue  # text for text, and lists and objects that may be empty, are tested by name below
            if path[:1] == ("cover",) and new == "":
                continue  # a cell that is not cut
            with pytest.raises(Refused):
                check(text(replaced(cert, path, new)))
                raise AssertionError(f"{path}: {old!r} became {new!r}")
        if is_rational(old) and path[0] != "tool":
            for new in NO_RATIONALS:
                with pytest.raises(Refused):
                    check(text(replaced(cert, path, new)))


def test_garbled_text_is_refused_or_no_json_and_never_a_crash() -> None:
    dice = random.Random(7)
    for _ in range(1500):
        letters = list(text(dice.choice([cfo, turning])()))
        for _ in range(dice.choice([1, 2, 5])):
            spot = dice.randrange(len(letters))
            letters[spot : spot + dice.choice([0, 1, 1, 8])] = dice.choice('[]{},:"\\-/019.eE+tnN \0é') * dice.choice(
                [1, 1, 0]
            )
        garbled = "".join(letters)
        try:
            check(garbled)
        except (Refused, json.JSONDecodeError):
            continue
        assert margin(json.loads(garbled)) >= -1e-9, garbled


def dig(path: str, new: Any, build: Callable[[], Cert] = turning) -> Cert:
    keys = [int(key) if key.isdigit() else key for key in path.split(".")]
    return replaced(build(), tuple(keys), new)


def free_turn(flips: list[int]) -> Cert:
    """A reversal that costs V nothing, since nothing turns beside what does not."""
    return dig("reversals.0", {"contact": "1", "flips": flips, "growth": "1", "dwell_samples": 0})


def parameter(expression: Any) -> Cert:
    """The angle's example with another c."""
    return dig("parameters.0.expression", expression)


def big(n: int) -> Cert:
    diagonal = [["-50" if i == j else "0" for j in range(n)] for i in range(n)]
    unit = [["1" if i == j else "0" for j in range(n)] for i in range(n)]
    return certificate(n, sample_time="1/100", decay_rate="1", matrix=diagonal, lyapunov_matrix=unit)


def many_parameters(count: int, splits: int = 1) -> Cert:
    cert = scalar()
    cert["variables"] = {f"x{i}": ["0", "1"] for i in range(count)}
    cert["splits"] = {name: [f"{k}/{splits}" for k in range(splits + 1)] for name in cert["variables"]}
    cert["parameters"] = [{"name": f"t{i}", "expression": f"x{i}"} for i in range(count)]
    cert["matrix"] = [[["+", "-50", *(["/", f"t{i}", "1000"] for i in range(count))]]]
    return cert


def nested(depth: int, op: str = "neg") -> str:
    head, tail = f'["{op}",' * depth, "]" * depth
    return text(parameter(["cos", "HERE"])).replace('"HERE"', head + '"q"' + tail)


REFUSALS: dict[str, tuple[Cert | str, str]] = {
    "other format": (dig("format", "stiction-certificate/2"), 'an object of the format "stiction-certificate/2"'),
    "no JSON object": ("[]", "found a list"),
    "a list for a text": (dig("claim", ["x"]), r"claim: \['x'\] is no 'LINE'"),
    "a text for a list": (dig("assumptions", "x"), "assumptions: expected is a list, found a text"),
    "a list for an object": (dig("subject", []), "subject: expected is an object, found a list"),
    "key twice": (text(scalar()).replace('"claim"', '"claim": "x", "claim"'), "a key appears twice"),
    "key twice within": (text(cfo()).replace('"contact"', '"contact": "x", "contact"'), "a key appears twice"),
    "key of variables twice": (
        text(turning()).replace('"m": [', '"q": ["0", "0"], "m": ['),
        r"a key appears twice in an object: \['q', 'q', 'm'",
    ),
    "nan": (text(scalar()).replace('"37"', "NaN"), "decay_rate: b'NaN' is no 'RATIONAL'"),
    "infinity": (text(scalar()).replace('"37"', "-Infinity"), "decay_rate: b'-Infinity'"),
    "a bare number": (text(scalar()).replace('"37"', "37"), "decay_rate: b'37' is no 'RATIONAL'"),
    "a long bare number": (text(scalar()).replace('"37"', "3" * 100_000), "decay_rate: b'333"),
    "a long number": (dig("decay_rate", "1" * 4001), "at most 4000 characters"),
    "a bool among the flips": (dig("reversals.0.flips", [True]), r"flips\[0\]: True is no 'WHOLE'"),
    "a bool for the dwell": (dig("reversals.0.dwell_samples", True), "dwell_samples: True is no 'WHOLE'"),
    "a fractional dwell": (dig("reversals.0.dwell_samples", 100.0), "dwell_samples: b'100.0'"),
    "a long dwell": (dig("reversals.0.dwell_samples", 10**9), "dwell_samples: b'1000000000'"),
    "nested JSON": ("[" * 200_000, "nested too deeply"),
    "nested objects": ('{"a":' * 200_000, "nested too deeply"),
    "nested expression": (nested(900), "nested too deeply"),
    "a line end in the claim": (dig("claim", "false\nverified: true"), "certificate.claim.*printable"),
    "an escape in the name": (dig("subject.name", "\x1b[2K"), "subject.name.*printable"),
    "half a character": (dig("claim", "\ud800"), "claim.*printable"),
    "an empty claim": (dig("claim", " "), "claim"),
    "a path up": (dig("subject.files", {"../x.c": "0" * 64}), "subject.files: '../x.c' is no 'FILE'"),
    "a path down": (dig("subject.files", {"a/x.c": "0" * 64}), "is no 'FILE'"),
    "an absolute path": (dig("subject.files", {"/x.c": "0" * 64}), "is no 'FILE'"),
    "a Windows path": (dig("subject.files", {"C:\\x.c": "0" * 64}), "is no 'FILE'"),
    "dots for a file": (dig("subject.files", {"..": "0" * 64}), "is no 'FILE'"),
    "a short hash": (dig("subject.files", {"x.c": "0" * 63}), "is no 'HASH'"),
    "a hash in capitals": (dig("subject.spec_sha256", "A" * 64), "spec_sha256.*'HASH'"),
    "no error component": (dig("error", []), "0 error components"),
    "33 components": (big(33), "33 error components, not 1 to 32"),
    "an error twice": (dig("error.1.name", "e_a_0"), "error: a name appears twice"),
    "matrix with a short row": (dig("matrix.1", ["1"]), "matrix is not 2 by 2"),
    "matrix with a row less": (dig("matrix", [["1", "2"]]), "matrix is not 2 by 2"),
    "P with a row more": (dig("lyapunov_matrix", [["1", "0"]] * 3), "lyapunov_matrix is not 2 by 2"),
    "P not symmetric": (dig("lyapunov_matrix.0.1", "0"), "not symmetric"),
    "P singular": (dig("lyapunov_matrix", [["1", "1"], ["1", "1"]]), "P is not positive definite"),
    "P indefinite": (dig("lyapunov_matrix", [["1", "2"], ["2", "1"]]), "P is not positive definite"),
    "P negative": (dig("lyapunov_matrix", [["-1", "0"], ["0", "-1"]]), "P is not positive definite"),
    "P zero": (dig("lyapunov_matrix", [["0", "0"], ["0", "0"]]), "P is not positive definite"),
    "no time": (dig("sample_time", "0"), "not all positive"),
    "time and rate negative": (dig("sample_time", "-1/1000") | {"decay_rate": "-37/10"}, "not all positive"),
    "no rate, implicit": (dig("observer.integration", "implicit") | {"decay_rate": "0"}, "not all positive"),
    "a rate below zero, implicit": (dig("observer.integration", "implicit") | {"decay_rate": "-1"}, "not all positive"),
    "rate too high": (dig("decay_rate", "500"), "not all positive"),
    "range upside down": (dig("variables.q", ["1", "-1"]) | {"splits": {}}, "q: no"),
    "range of one": (dig("variables.q", ["1"]) | {"splits": {}}, "q: no"),
    "range of three": (dig("variables.q", ["-1", "0", "1"]) | {"splits": {}}, "q: no"),
    "empty range": (dig("variables.q", []) | {"splits": {}}, "q: no"),
    "splits without low": (dig("splits.q", ["0", "1"]), "q: no"),
    "splits without high": (dig("splits.q", ["-1", "0"]), "q: no"),
    "splits with a gap in order": (dig("splits.q", ["-1", "1/2", "0", "1"]), "q: no"),
    "splits with a repetition": (dig("splits.q", ["-1", "0", "0", "1"]), "q: no"),
    "splits without cells": (dig("variables.q", ["0", "0"]) | {"splits": {"q": ["0"]}}, "q: no"),
    "splits of nothing": (dig("splits.q", []), "q: no"),
    "splits of an unknown": (dig("splits", {"z": ["0", "1"]}), "splits: a name is no variable"),
    "parameter named as a variable": (dig("parameters.0.name", "q"), "parameters: a name is a variable's"),
    "parameter twice": (dig("parameters.1.name", "c"), "parameters: a name appears twice"),
    "parameter named by a number": (dig("parameters.0.name", "1"), "'NAME'"),
    "variable named by an operator": (dig("variables", {"+": ["0", "1"]}) | {"splits": {}}, "'NAME'"),
    "two covers": (dig("cover", covered()["cover"] * 2, covered), "cover: two of them"),
    "a cover of an implicit step": (dig("observer.integration", "implicit", covered), "beside an implicit step"),
    "a cover of a refutation": (dig("along", ["1"], covered), "a refutation"),
    "a cover beside splits": (dig("splits", {"w": ["1", "6/5"]}, covered), "or splits"),
    "a cover with a gap": (dig("cover.0", ["q t", "1/2", ""], covered), "not enough values"),
    "a cut beyond its ends": (dig("cover.0.1", "1", covered), "q t is not cut between its ends"),
    "a cut at no number": (dig("cover.0.1", "1/0", covered), "q t is cut at no number"),
    "a cut at a huge number": (dig("cover.0.1", "1e999999999", covered), "q t is cut at no number"),
    "a cut of nothing": (dig("cover.0.0", "q", covered) | {"variables": {"w": ["1", "6/5"]}}, "known names"),
    "a cut of an angle itself": (dig("cover.0.1", "9", covered) | {}, "q t is not cut between its ends"),
    "a cover that is a word": (dig("cover.0", "everywhere", covered), "V is not shown to fall"),
    "a cover that is an object": (dig("cover.0", {"q t": "1/2"}, covered), "V is not shown to fall"),
    "too coarse a cover": (dig("decay_rate", "729/50", covered) | {"cover": [""]}, "V may not fall"),
    "a divisor that is zero somewhere": (
        dig("parameters.0.expression", ["/", "1", ["+", "1", ["sin", "q"]]], covered),
        "not positive semidefinite",
    ),
    "a divisor that is negative": (
        dig("parameters.0.expression", ["/", "1", ["+", "-3", ["sin", "q"]]], covered),
        "not positive semidefinite",
    ),
    "a divisor without a range": (
        dig("parameters.0.expression", ["/", "1", ["+", "3", ["sin", "z"]]], covered),
        "known names",
    ),
    "another function": (dig("parameters.0.expression", ["sqrt", ["cos", "q"]], covered), "c: no sqrt of polynomials"),
    "an exponential that may rise": (
        dig("parameters.0.expression", ["exp", ["cos", "q"]], covered),
        "not shown to fall",
    ),
    "a huge number in a parameter": (dig("parameters.0.expression", "1e999999999", covered), "no 'RATIONAL'"),
    "a power without end": (
        dig("parameters.0.expression", ["^", ["^", ["+", "2", ["cos", "q"]], "64"], "64"], covered),
        "a power is too high",
    ),
    "contact twice": (dig("reversals", turning()["reversals"] * 2), "reversals: a contact appears twice"),
    "flip beyond": (dig("reversals.0.flips", [2]), r"flips \[2\] twice or not below 2"),
    "no flip": (free_turn([]), "flips are not the error e_a_CONTACT"),
    "flips of all": (free_turn([0, 1]), "flips are not the error e_a_CONTACT"),
    "flips of another": (dig("reversals.0.contact", "0"), "flips are not the error e_a_CONTACT"),
    "flip twice": (dig("reversals.0.flips", [1, 1]), "twice"),
    "growth below 1": (dig("reversals.0.growth", "999/1000"), "below 1"),
    "growth negative": (dig("reversals.0.growth", "-5"), "below 1"),
    "a variable in the matrix": (dig("matrix.0.0", "q"), r"matrix\[0\]\[0\] \(known names: \['c', 'w'\]\): 'q'"),
    "a parameter in a parameter": (parameter("w"), r"known names: \['m', 'q'\]"),
    "an unknown name": (parameter(["+", "q", "nothing"]), "'nothing' is no 'RATIONAL'"),
    "cos in the matrix": (dig("matrix.0.0", ["cos", "c"]), "is no expression here"),
    "a power in the matrix": (dig("matrix.0.0", ["^", "c", "2"]), "is no expression here"),
    "a square in the matrix": (dig("matrix.0.0", ["*", "c", "c"]), "occurs in two factors"),
    "a hidden square": (dig("matrix.0.0", ["*", ["+", "c", "w"], ["neg", ["/", "c", "2"]]]), "occurs in two factors"),
    "a square of three": (dig("matrix.0.0", ["*", "c", "w", "c"]), "occurs in two factors"),
    "a parameter divides": (dig("matrix.0.0", ["/", "1", "w"]), "'w' is no 'RATIONAL'"),
    "a sum divides": (dig("matrix.0.0", ["/", "c", ["+", "1", "1"]]), "is no 'RATIONAL'"),
    "0 divides in the matrix": (dig("matrix.0.0", ["/", "c", "0"]), "divisor from 0 to 0"),
    "0 divides": (parameter(["/", "1", "q"]), "c: divisor from -0.4 to 0"),
    "0 divides at an end": (parameter(["/", "1", ["+", "q", "1"]]), "c: divisor from 0 to 0.6"),
    "0 divides in the midst": (parameter(["/", "1", ["+", "q", "1/5"]]), "c: divisor from -0.2 to 0.2"),
    "long denominators": (
        dig("lyapunov_matrix", [["1/" + "3" * 3998, "0"], ["0", "1/1" + "0" * 3996 + "1"]]),
        "a common denominator is too large",
    ),
    "root of negative": (parameter(["sqrt", "q"]), "c: sqrt of a number down to -1"),
    "exp of much": (parameter(["exp", ["*", "101", ["abs", "q"]]]), "beyond 100"),
    "power of a name": (parameter(["^", "q", "m"]), "'m' is no 'RATIONAL'"),
    "power of a fraction": (parameter(["^", "q", "1/2"]), "exponent 0.5"),
    "power below 0": (parameter(["^", "q", "-1"]), "exponent -1"),
    "power too high": (parameter(["^", "q", "65"]), "exponent 65"),
    "power upon power": (parameter(["^", ["^", ["^", ["^", "7/3", "64"], "64"], "64"], "64"]), "too long"),
    "sum of one": (parameter(["+", "q"]), "is no expression here"),
    "sine of two": (parameter(["sin", "q", "m"]), "is no expression here"),
    "quotient of three": (parameter(["/", "q", "m", "m"]), "is no expression here"),
    "unknown operator": (parameter(["tan", "q"]), "is no expression here"),
    "operator is a list": (parameter([["+"], "q"]), "is no expression here"),
    "operator is null": (parameter([None, "q"]), "is no expression here"),
    "empty expression": (parameter([]), "is no expression here"),
    "expression is an object": (parameter({"+": ["q", "m"]}), "is no 'RATIONAL'"),
    "expression is a bool": (parameter(["+", True, "q"]), "True is no 'RATIONAL'"),
    "expression is a bare number": (parameter(["+", 1, "q"]), "b'1' is no 'RATIONAL'"),
    "8192 vertices": (many_parameters(13), "8192 vertices in a cell"),
    "262144 vertices": (many_parameters(9, 2), "262144 in all, more"),
    "a billion cells": (many_parameters(9, 10), "1000000000 cells of 9 names, more than 200000 in all"),
    "a long text": (" " * 5_000_001, "5000001 characters"),
}


@pytest.mark.parametrize("case", REFUSALS)
def test_refused_for_the_reason(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    cert, reason = REFUSALS[case]
    monkeypatch.setattr(frame, "SECONDS", 2)
    with pytest.raises(Refused, match=reason) as caught:
        check(cert if isinstance(cert, str) else text(cert))
    assert str(caught.value).isprintable() and len(str(caught.value)) < 1000


@pytest.mark.parametrize("case", ["many parameters", "many variables", "a long expression"])
def test_many_cells_take_neither_time_nor_memory(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of all cells, each with all its names, gigabytes were filled before a limit was asked."""
    monkeypatch.setattr(frame, "OF_ALGEBRA", 0.5)
    count, cells = (1, 150_000) if case == "a long expression" else (100, 20_000)
    cert = scalar()
    cert["variables"] = {"x": ["0", "1"]}
    cert["splits"] = {"x": [f"{k}/{cells}" for k in range(cells + 1)]}
    if case == "many variables":
        cert["variables"] |= {f"y{k}": ["0", "1"] for k in range(count)}
    long = functools.reduce(lambda of, _: ["neg", of], range(250), "x")
    expressions = ["x"] * count if case == "many parameters" else [long]
    cert["parameters"] = [{"name": f"t{k}", "expression": of} for k, of in enumerate(expressions)]
    cert["matrix"] = [[["+", "-50", *(f"t{k}" for k in range(len(expressions)))]]]
    stated, begun = text(cert), time.thread_time()
    with pytest.raises(Refused, match="more work than the limit" if case == "a long expression" else "20000 cells"):
        check(stated)
    assert time.thread_time() - begun < 6


def test_what_is_nearly_refused_is_verified() -> None:
    for cert in (
        big(32),
        many_parameters(12),
        nested(60),
        parameter(["+", ["cos", "q"], ["*", "0", ["^", "q", "64"]]]),
    ):
        check(cert if isinstance(cert, str) else text(cert))
    assert accepted(dig("reversals.0.dwell_samples", 999_999_999))
    assert accepted(dig("subject.files", {"two_mass-1.0.c": "0" * 64}))


# ---- enclosures ------------------------------------------------------------------------------------------------------


def rational(x: Any) -> Fraction:
    """The exact value of an mpf."""
    sign, mantissa, exponent, _ = x._mpf_
    return (-1) ** sign * Fraction(int(mantissa)) * Fraction(2) ** exponent


mpmath.mp.dps = 60
TRUE: dict[str, Callable[[Any], Any]] = {
    "sin": mpmath.sin,
    "cos": mpmath.cos,
    "exp": mpmath.exp,
    "sqrt": mpmath.sqrt,
    "abs": abs,
    "neg": lambda x: -x,
}
ERROR = Fraction(1, 10**50)  # of mpmath with 60 digits, where values are below 10^9


def true_value(op: str, x: Fraction) -> Fraction:
    return rational(TRUE[op](mpmath.mpf(x.numerator) / x.denominator))


def fractions(low: int, high: int) -> st.SearchStrategy[Fraction]:
    return st.fractions(low, high, max_denominator=10**6) | st.integers(low, high).map(Fraction)


def test_pi() -> None:
    low, high = enclosure.PI
    assert low < rational(+mpmath.pi) < high
    assert high - low < Fraction(1, 10**25)


@pytest.mark.parametrize(
    ("op", "low", "high"),
    [("sin", -98, 98), ("cos", -98, 98), ("exp", -120, 20), ("sqrt", 0, 10**6), ("abs", -9, 9), ("neg", -9, 9)],
)
@settings(deadline=None)
@given(data=st.data())
def test_enclosures_hold_and_are_tight(op: str, low: int, high: int, data: st.DataObject) -> None:
    a = data.draw(fractions(low, high))
    width = data.draw(st.sampled_from([Fraction(0), Fraction(1, 10**12), Fraction(1, 1000)]) | fractions(0, 8))
    b = min(a + width, Fraction(high))
    bottom, top = enclosure.apply(op, [(a, b)], "here")
    steps = 60
    samples = [true_value(op, a + (b - a) * Fraction(k, steps)) for k in range(steps + 1)]
    assert bottom - ERROR <= min(samples) and max(samples) <= top + ERROR
    excess = (top - bottom) - (max(samples) - min(samples))
    if b == a:
        assert excess <= Fraction(1, 10**18) * max(1, abs(samples[0]))
    elif b - a <= Fraction(1, 10**12):
        assert excess <= Fraction(1, 10**9)
    elif op in ("sin", "cos"):
        assert excess <= ((b - a) / steps) ** 2 + Fraction(1, 10**15)  # an extremum within half a step of a sample


def test_sine_at_its_extrema() -> None:
    """None: the value at an end of the interval, within -1 and 1."""
    cases: dict[tuple[str, str], tuple[int | None, int | None]] = {
        ("-1/2", "1/2"): (None, None),
        ("1", "2"): (None, 1),
        ("4", "5"): (-1, None),
        ("-2", "1"): (-1, None),
        ("7", "8"): (None, 1),
        ("-5", "-4"): (None, 1),
        ("10", "12"): (-1, None),
        ("1", "5"): (-1, 1),
        ("0", "7"): (-1, 1),
        ("99", "101"): (-1, 1),
        ("-1000", "-999"): (-1, 1),
        ("-1000", "50"): (-1, 1),
    }
    for (low, high), wanted in cases.items():
        for got, want in zip(enclosure.apply("sin", [(Fraction(low), Fraction(high))], "here"), wanted, strict=True):
            assert got == want if want is not None else abs(got) < 1, (low, high)


def test_sine_at_an_end_next_to_an_extremum() -> None:
    """The end lies so near pi/2 that pi's own enclosure cannot tell: then 1 must be in the result."""
    for shift in (-1, 0, 1):
        end = enclosure.PI[0] / 2 + shift * Fraction(1, 2**100)
        assert enclosure.apply("sin", [(Fraction(1), end)], "here")[1] >= true_value("sin", end)
    assert enclosure.apply("sin", [(Fraction(1), enclosure.PI[1] / 2)], "here")[1] == 1


def test_sine_next_to_an_extremum_far_out() -> None:
    for k in range(1, 15):
        place = rational((2 * k + mpmath.mpf(1) / 2) * mpmath.pi)
        for digits in range(86, 94):
            end = Fraction(math.ceil(place * 2**digits), 2**digits)
            assert enclosure.apply("sin", [(end - Fraction(1, 8), end)], "here")[1] == 1


def test_a_short_series_is_as_far_off_as_it_says() -> None:
    e, sine = rational(mpmath.e), rational(mpmath.sin(2)) / 2
    for terms in range(2, 20):
        low, high = enclosure.series(Fraction(1), list(range(1, terms)))
        assert low < e < high and high - low >= Fraction(2, math.factorial(terms - 1))
        low, high = enclosure.series(Fraction(-4), [k * k + k for k in range(2, 2 * terms, 2)])
        assert low < sine < high
    low, high = enclosure.series(Fraction(-4), [6, 20])
    assert (low, high) == (1 - Fraction(4, 6) + 0, 1 - Fraction(4, 6) + Fraction(32, 120))


def test_numbers_that_are_rational_stay_exact() -> None:
    third = Fraction(1, 3)
    assert verify.widen(third, third) == (third, third)
    for op, args, low, high in (
        ("sqrt", [(4, 9)], 2, 3),
        ("exp", [(0, 0)], 1, 1),
        ("sin", [(0, 0)], 0, 0),
        ("abs", [(-2, 1)], 0, 2),
        ("^", [(-2, 1), (2, 2)], 0, 4),
        ("^", [(-2, 1), (3, 3)], -8, 1),
        ("^", [(-2, 1), (0, 0)], 1, 1),
        ("*", [(-2, 1), (-3, 5)], -10, 6),
        ("/", [(-2, 1), (-4, -2)], Fraction(-1, 2), 1),
        ("+", [(-2, 1), (-3, 5), (7, 7)], 2, 13),
    ):
        assert enclosure.apply(op, [(Fraction(a), Fraction(b)) for a, b in args], "here") == (low, high), op


@settings(deadline=None)
@given(st.fractions(), st.fractions(), st.integers(-2000, 2000))
def test_rounding_is_outwards_and_short(x: Fraction, y: Fraction, exponent: int) -> None:
    low, high = sorted((x**3 * Fraction(2) ** exponent, y**5 * Fraction(2) ** exponent))
    bottom, top = verify.widen(low, high)
    assert bottom <= low <= high <= top
    for end, rounded in ((low, bottom), (high, top)):
        assert abs(end - rounded) <= max(abs(end) / 2**90, Fraction(1, 2**512))
        assert rounded == end or rounded.denominator <= 2**512


EXPRESSIONS = st.recursive(
    st.sampled_from(["x", "y"]) | st.fractions(-3, 3, max_denominator=99).map(str),
    lambda inner: (
        st.tuples(st.sampled_from(["+", "*", "/"]), inner, inner).map(list)
        | st.tuples(st.sampled_from(["neg", "sin", "cos", "exp", "abs", "sqrt"]), inner).map(list)
        | st.tuples(st.just("^"), inner, st.integers(0, 5).map(str)).map(list)
    ),
    max_leaves=8,
)


@settings(max_examples=examples(300), deadline=None)
@given(EXPRESSIONS, fractions(-2, 2), fractions(-2, 2), fractions(0, 2), fractions(0, 2))
@example(["cos", ["*", "x", "y"]], Fraction(-1), Fraction(-1), Fraction(2), Fraction(2))
def test_expressions_are_enclosed(raw: Any, x: Fraction, y: Fraction, across: Fraction, up: Fraction) -> None:
    box = {"x": (x, x + across), "y": (y, y + up)}
    try:
        low, high = verify.parse(raw, box, "here")[1](box)
    except Refused:
        assume(False)
    for i, j in itertools.product(range(5), repeat=2):
        point = {"x": float(x + across * Fraction(i, 4)), "y": float(y + up * Fraction(j, 4))}
        slack = 1e-7 * (1 + max(abs(float(low)), abs(float(high)))) if max(abs(low), abs(high)) < 10**200 else math.inf
        try:
            got = value(raw, point)
        except (ValueError, ArithmeticError):  # at the end of a domain a float may already be beyond it
            continue
        assert float(low) - slack <= got <= float(high) + slack, point


# ---- exact matrices --------------------------------------------------------------------------------------------------


def determinant(rows: list[list[int]]) -> int:
    """By Leibniz: n! products."""
    n = len(rows)
    total = 0
    for order in itertools.permutations(range(n)):
        inversions = sum(order[i] > order[j] for i in range(n) for j in range(i + 1, n))
        total += (-1) ** inversions * math.prod(rows[i][order[i]] for i in range(n))
    return total


@settings(max_examples=examples(300), deadline=None)
@given(st.data())
def test_semidefinite_as_all_principal_minors_say(data: st.DataObject) -> None:
    n = data.draw(st.integers(1, 4))
    small = st.integers(-3, 3)
    rank = data.draw(st.integers(0, n))
    factor = [[data.draw(small) for _ in range(n)] for _ in range(rank)]
    M = [[sum(row[i] * row[j] for row in factor) for j in range(n)] for i in range(n)]  # semidefinite, often singular
    if data.draw(st.booleans()):
        i, j = data.draw(st.integers(0, n - 1)), data.draw(st.integers(0, n - 1))
        M[i][j] = M[j][i] = data.draw(small)
    minors = [
        determinant([[M[i][j] for j in chosen] for i in chosen])
        for size in range(1, n + 1)
        for chosen in itertools.combinations(range(n), size)
    ]
    rows = tuple(map(tuple, M))
    assert kernel.positive(rows) == (min(minors) >= 0)
    assert kernel.positive(rows, definite=True) == (min(minors) >= 0 and minors[-1] > 0)


@settings(deadline=None)
@given(
    st.fractions(Fraction(1, 100), Fraction(99, 100)),
    st.integers(0, 300),
    st.integers(-3, 3),
    st.sampled_from([12, 24, 40]),
)
@example(Fraction(1, 3), 1, 0, 12)
@example(Fraction(1, 2), 80, 0, 12)
@example(Fraction(97, 99), 300, 1, 40)
def test_the_dwell_is_long_enough_just_when_the_power_says_so(
    fall: Fraction, dwell: int, shift: int, digits: int
) -> None:
    growth = 1 / fall**dwell * (1 + Fraction(shift, 10**digits))
    assume(1 <= growth < 10**100)
    entry = {"contact": "x", "flips": [], "growth": growth, "dwell_samples": dwell}
    true = growth * fall**dwell <= 1
    try:
        verify.reversal(entry, ((1,),), fall)
    except Refused as fault:
        assert not true or shift == 0 or digits == 40, fault  # so close to equality rounding may refuse
    else:
        assert true


# ---- files and the command line --------------------------------------------------------------------------------------


def sha(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "spec.yaml").write_text("name: example\n")
    (tmp_path / "observer.c").write_text("/* generated */\n")
    cert = cfo()
    cert["subject"]["files"] = {"observer.c": sha(tmp_path / "observer.c"), "observer.h": "1" * 64}
    cert["subject"]["spec_sha256"] = sha(tmp_path / "spec.yaml")
    (tmp_path / "certificate.json").write_text(text(cert))
    return tmp_path


def test_files_are_bound(folder: Path) -> None:
    content = (folder / "certificate.json").read_text()
    report = check(content, folder, folder / "spec.yaml")
    assert report.unbound == ("observer.h",)
    assert report.facts[-2:] == ("observer.c has the SHA-256 stated", "spec.yaml has the SHA-256 stated")
    assert check(content).unbound == ("observer.c", "observer.h")
    (folder / "spec.yaml").write_text("name: another\n")
    check(content, folder)
    with pytest.raises(
        Refused,
        match=r"spec\.yaml differs from the one that the certificate names .*its SHA-256 is \w{64}, not \w{64}$",
    ):
        check(content, folder, folder / "spec.yaml")
    (folder / "observer.c").write_text("/* generated  */\n")
    with pytest.raises(Refused, match=r"observer\.c differs from the one that the certificate names \(edited since"):
        check(content, folder)


def run(*arguments: object, environment: dict[str, str] | None = None) -> tuple[int, str, str]:
    """As on a machine with nothing but Python: no site-packages, no environment."""
    command = [sys.executable, "-I", "-S", str(SOURCE), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, env=environment or {}, timeout=60, check=False, cwd="/")
    assert b"Traceback" not in done.stderr
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def test_command_line_verifies(folder: Path) -> None:
    status, out, err = run(folder / "certificate.json", "--spec", folder / "spec.yaml")
    assert (status, err) == (5, "")  # the algebra holds; there is no proof to bind it by
    lines = out.splitlines()
    assert lines[0] == "example: the algebra holds; it was not bound to code (exit status 5)"
    assert lines[2] == "the algebra holds:" and "  spec.yaml has the SHA-256 stated" in lines
    why = lines.index("it was not bound to code:")
    assert lines[why + 1] == "  no proof.json; `stiction generate SPEC` writes it, where it can be made"
    words = lines.index("claim as written by the tool, not checked:")
    assert lines[words + 1 :] == [
        "  The error decays at the rate α.",
        "assumptions of this claim, not checked:",
        "  The friction level is constant between reversals.",
        "the algebra holds; it was not bound to code (exit status 5)",
    ]
    gaps = lines[lines.index("not checked:") + 1 : words]
    assert gaps == [
        "  observer.h, which is not here",
        "  reversals: nothing is claimed about one of e_a_0",
        *(f"  {gap}" for gap in verify.ALWAYS),
    ]


def test_a_bound_of_an_earlier_version_is_no_certificate(tmp_path: Path) -> None:
    (tmp_path / "bound.json").write_text('{"format": "stiction-bound/1"}')
    status, out, err = run(tmp_path / "bound.json")
    assert (status, err) == (3, "") and 'found an object of the format "stiction-bound/1"; expected is a' in out


@pytest.mark.parametrize("asked", ["certificate.json", "proof.json"])
@pytest.mark.parametrize("name", ["proof.json", "ellipsoid.json"])
@pytest.mark.parametrize("left", [b"", b'{"name": "one_mass", "st', b'"\xff"'])
def test_a_claim_in_the_folder_that_is_no_json_cannot_be_read(
    asked: str, name: str, left: bytes, tmp_path: Path
) -> None:
    folder = shutil.copytree(SOURCE.parents[2] / "generated/one_mass", tmp_path / "one_mass")
    (folder / name).write_bytes(left)
    status, out, err = run(folder / asked)
    found = "not a certificate" if name == asked else "no JSON"
    assert (status, out) == (2, "") and err.startswith(f"error: {folder / name}: {found}: ")
    assert name == asked or "; expected " in err
    with pytest.raises(BadInput, match=name):
        of_library.verify(folder / asked)


@pytest.mark.parametrize("name", ["proof.json", "ellipsoid.json"])
@pytest.mark.parametrize("left", ["1" * 5000, '{"name": ' + "7" * 5000 + "}", '{"name": 1, "name": 2}', "[" * 100_000])
def test_a_claim_in_the_folder_that_is_json_of_another_form_is_no_claim(name: str, left: str, tmp_path: Path) -> None:
    """A number of 5000 digits, which Python's int does not take, was said to be no JSON."""
    folder = shutil.copytree(SOURCE.parents[2] / "generated/one_mass", tmp_path / "one_mass")
    (folder / name).write_text(left)
    status, out, err = run(folder / "certificate.json")
    assert (status, err) == (5, "") if name == "proof.json" else (status, err) == (3, "") and name in out


@pytest.mark.parametrize("kernel", [True, False])
def test_what_is_never_compared_is_always_said(kernel: bool, tmp_path: Path) -> None:
    """Whatever is there: nobody is to think that a hash of the C, or of the spec, says what stands in it."""
    folder = shutil.copytree(SOURCE.parents[2] / "generated/one_mass", tmp_path / "one_mass")
    if not kernel:
        (folder / "proof.json").unlink()
    status, out, _ = run(folder / "certificate.json", "--spec", SOURCE.parents[2] / "specs/one_mass.yaml")
    gaps = out[out.index("not checked:") : out.index("claim as written")]
    assert status == (0 if kernel else 5)
    for words in (
        "what __init__.py, the Python version, computes",
        "that the model (M, g, input gain)",
        "that the units of forces, levels and inputs in NAME.h fit the machine's",
    ):
        assert f"\n  {words}" in gaps


def test_command_line_prints_greek_on_an_ascii_screen(folder: Path) -> None:
    script = (
        "import sys, runpy; sys.stdout.reconfigure(encoding='ascii'); "
        f"sys.argv[1:] = [{str(folder / 'certificate.json')!r}]; runpy.run_path({str(SOURCE)!r}, run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-I", "-S", "-c", script], capture_output=True, timeout=60, check=False)
    assert done.returncode == 5 and rb"rate \u03b1" in done.stdout, done.stderr


def test_a_reader_that_goes_away_sees_no_traceback(folder: Path) -> None:
    """``verify.py … | head -1``: the pipe is closed before anything is printed."""
    command = [sys.executable, "-I", "-S", str(SOURCE), str(folder / "certificate.json")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    said = process.stderr.read()
    assert process.wait(60) == -signal.SIGPIPE and said == b""


def test_an_edited_c_is_told_with_what_checks_it_as_it_is(tmp_path: Path) -> None:
    """Its proof names no hashes: it is about the text beside it, edited or not."""
    folder = shutil.copytree(SOURCE.parents[2] / "generated/one_mass", tmp_path / "one_mass")
    code = folder / "one_mass.c"
    code.write_text(code.read_text().replace("K_F", "K_F ", 1))
    status, out, _ = run(folder / "certificate.json")
    assert status == 3 and "one_mass.c differs from the one that the certificate names (edited since" in out
    assert "`verify proof.json` checks the text as it is now" in out
    shutil.copy(SOURCE.parents[2] / "generated/one_mass/one_mass.c", code)
    (folder / "__init__.py").write_text("")
    status, out, _ = run(folder / "certificate.json")
    assert status == 3 and "__init__.py differs" in out and "proof.json" not in out


def test_command_line_refuses(folder: Path) -> None:
    (folder / "observer.c").write_text("")
    status, out, err = run(folder / "certificate.json")
    assert status == 3 and out.startswith(
        f"refused: {folder / 'certificate.json'}: observer.c differs from the one that the certificate names"
    )
    assert err == "" and "its SHA-256 is e3b0c442" in out and "proof.json" not in out
    for name, (cert, _) in REFUSALS.items():
        if name in ("nested JSON", "nested expression", "half a character", "nan", "no JSON object", "key twice"):
            (folder / "bad.json").write_text(cert if isinstance(cert, str) else text(cert))
            status, out, _ = run(folder / "bad.json")
            assert status == 3 and out.startswith(f"refused: {folder / 'bad.json'}: ") and "verified" not in out, name


def test_a_certificate_that_is_too_large_is_bad_input(folder: Path) -> None:
    """As any other file that cannot be read, and at the limit that the documentation states."""
    (folder / "big.json").write_text(" " * (verify.MAX_TEXT + 1))
    status, out, err = run(folder / "big.json")
    assert (status, out, err) == (2, "", f"error: {folder / 'big.json'}: more than {verify.MAX_TEXT} bytes\n")
    (folder / "full.json").write_text((folder / "certificate.json").read_text().ljust(verify.MAX_TEXT))
    assert run(folder / "full.json")[0] == 5


def test_command_line_cannot_read(folder: Path) -> None:
    for content in (b"", b"{", b"verified", b"\xff\xfe{}", b"\xef\xbb\xbf{}", b'{"a": 1', b"[1,]"):
        (folder / "bad.json").write_bytes(content)
        status, out, err = run(folder / "bad.json")
        assert (status, out) == (2, "") and err.startswith("error: ") and "[Errno" not in err, content
    for arguments in (
        ["/nowhere.json"],
        [folder.parent],
        [folder / "certificate.json", "--spec", "/nowhere"],
        [],
        ["a", "b"],
    ):
        status, out, err = run(*arguments)
        assert (status, out) == (2, "") and err


# ---- the file itself -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted(SOURCE.parent.glob("*.py")), ids=lambda path: path.stem)
def test_the_standard_library_alone(path: Path) -> None:
    source, own = path.read_text(), {"codegen.checker", *(p.stem for p in path.parent.glob("*.py"))}
    own |= {f"codegen.checker.{name}" for name in own}
    for node in ast.walk(ast.parse(source)):
        modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0
            modules = [node.module or ""]
        for module in modules:
            assert module in own or module.partition(".")[0] in sys.stdlib_module_names
        called = node.func if isinstance(node, ast.Call) else None
        assert not (isinstance(called, ast.Name) and called.id in ("eval", "exec", "__import__", "compile"))


def test_sixty_four_vertices_of_four_components_are_checked() -> None:
    cert = big(4)
    cert["variables"] = {f"x{i}": ["1/10", "3/7"] for i in range(6)}
    functions = ["sin", "cos", "exp", "sqrt", "abs", "neg"]
    cert["parameters"] = [{"name": f"t{i}", "expression": [f, f"x{i}"]} for i, f in enumerate(functions)]
    for (i, j), k in zip(itertools.combinations(range(4), 2), range(6), strict=True):
        cert["matrix"][i][j] = ["*", "1/3", f"t{k}", f"t{(k + 1) % 6}"]
    assert counted(check(text(cert)).facts[1]) == (64, 1)


NO_CERTIFICATE = {
    "[]": "found a list;",
    "3": "found a number;",
    '"x"': "found a text;",
    "null": "found null;",
    "{}": "found an object without fields;",
    '{"a": 1, "b": {"format": "stiction-certificate/1"}}': 'found an object with the fields "a", "b";',
    '{"format": "stiction-fleet/1"}': 'found an object of the format "stiction-fleet/1";',
    '{"format": {"a": 1}}': 'found an object with the fields "format";',
    json.dumps({f"field{k}": k for k in range(99)}): '"field2", "field3", and 95 more;',
    json.dumps({"\x1b[2J" + "x" * 9999: 1}): "found an object with the fields ",
}


@pytest.mark.parametrize("text", NO_CERTIFICATE, ids=lambda text: text[:30])
def test_json_that_is_no_certificate_is_said_in_plain_words(text: str) -> None:
    """What stands there and what was expected, on one line; no schema."""
    with pytest.raises(Refused) as refused:
        verify.check(text)
    said = str(refused.value)
    assert NO_CERTIFICATE[text] in said and len(said) < 300 and said.isprintable()
    assert said.endswith(
        'expected is a certificate: an object with "format": "stiction-certificate/1", or a proof.json'
    )
    assert "RATIONAL" not in said and "[" not in said.replace("u001b[2J", "")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("manifest.json", 'an object with the fields "tool", "spec", "files", "sha256"; expected is a certificate'),
        ("ellipsoid.json", "it is verified with the proof.json beside it"),
    ],
)
def test_the_other_files_of_a_folder_are_told_apart(name: str, words: str) -> None:
    text = (Path(__file__).parents[2] / "generated" / "rig" / name).read_text("utf-8")
    with pytest.raises(Refused, match=words):
        verify.check(text)


def test_a_proof_without_a_field_is_said_to_be_one() -> None:
    content = json.loads((Path(__file__).parents[2] / "generated/rig/proof.json").read_text("utf-8"))
    del content["domain"]
    with pytest.raises(Refused, match='a proof of the C, but for the fields "domain", "note"'):
        verify.check(json.dumps(content | {"note": ""}))


def test_a_folder_stands_for_its_certificate_and_one_without_is_told() -> None:
    generated = SOURCE.parents[2] / "generated"
    certificate = generated / "one_mass/certificate.json"
    alone, whole = (
        subprocess.run([sys.executable, "-I", "-S", str(SOURCE), str(path)], capture_output=True, check=False)
        for path in (certificate, certificate.parent)
    )
    assert alone.returncode == whole.returncode == 0 and alone.stdout == whole.stdout
    refused = subprocess.run(
        [sys.executable, "-I", "-S", str(SOURCE), str(generated / "one_mass_dfo")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert refused.returncode == 2 and refused.stderr.startswith(f"error: {generated / 'one_mass_dfo'}")
    assert refused.stderr.count("\n") == 1


def on_screen(path: Path, columns: int) -> list[str]:
    """The lines that the checker prints on a screen of so many columns."""
    command = [sys.executable, "-I", "-S", str(SOURCE), str(path)]
    screen, child = pty.openpty()
    fcntl.ioctl(child, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
    process = subprocess.Popen(command, stdout=child, env=environment)
    os.close(child)
    said = b""
    with suppress(OSError):  # the end of a terminal
        while part := os.read(screen, 10000):
            said += part
    os.close(screen)
    assert process.wait(60) == 5
    return said.decode().replace("\r\n", "\n").splitlines()


@pytest.mark.parametrize("columns", slow_except([60, 120], [60]))
def test_lines_are_broken_at_the_width_of_a_screen_and_nowhere_else(columns: int) -> None:
    """The verdict begins a line, and what a file says does not: it goes on indented."""
    path = SOURCE.parents[2] / "generated/one_mass_dfo/sliding.json"
    command = [sys.executable, "-I", "-S", str(SOURCE), str(path)]
    plain = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    lines = on_screen(path, columns)
    assert "".join("".join(lines).split()) == "".join(plain.split()) and max(map(len, plain.splitlines())) > 300
    whole = [word for word in plain.split() if len(word) < columns - 6]
    assert {*whole} <= {*" ".join(lines).split()} and max(map(len, lines)) <= columns
    flush = [line for line in plain.splitlines() if not line.startswith(" ")]
    begun = [line for line in lines if not line.startswith(" ")]
    assert all(line.startswith(part) for line, part in zip(flush, begun, strict=True))


@pytest.mark.parametrize("before", [78 * "\u2800", 39 * "\u4e00", 39 * "\uff01"], ids=["blank", "wide", "full"])
def test_no_word_of_a_file_begins_at_the_left_edge_of_a_screen(before: str, tmp_path: Path) -> None:
    """The screen broke these words at its width: "verified for the C" stood in a line of its own."""
    content = json.loads((SOURCE.parents[2] / "generated/one_mass_dfo/sliding.json").read_text("utf-8"))
    content["claim"] = f"{before}one_mass_dfo:\u2800verified\u2800for\u2800the\u2800C\u2800(exit\u2800status\u28000)"
    content["subject"]["files"] = {}
    (tmp_path / "sliding.json").write_text(json.dumps(content), "utf-8")
    for line in on_screen(tmp_path / "sliding.json", 80):
        wide = sum(1 + (unicodedata.east_asian_width(c) in "FW") for c in line)
        assert wide <= 80 and ("verified\u2800" not in line or line.startswith("    "))
