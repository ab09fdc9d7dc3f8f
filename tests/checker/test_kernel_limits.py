"""Proofs and C made to keep the kernel busy: each is refused in time; honest proofs stay far below the limit."""

from __future__ import annotations

import gc
import json
import math
import random
import time
import tracemalloc
from collections.abc import Callable
from contextlib import nullcontext
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from codegen.checker import errors, forms, frame, kernel, verify
from tests.checker.forged import replace_once

GENERATED = Path(__file__).parents[2] / "generated"
HERE = GENERATED / "one_mass"

Files = dict[str, Any]


def files() -> Files:
    """The shipped proof, and the C that it is one of, as they may be changed."""
    found: Files = {path.name: path.read_text("utf-8") for path in HERE.glob("one_mass.[ch]")}
    return {**found, "proof": json.loads((HERE / "proof.json").read_text("utf-8"))}


def many_variables(f: Files) -> None:
    """A product of sums in sixty sign variables: three powers of each for every other."""
    f["proof"]["signs"] |= {f"sign.s{k}": "outputs.v_hat" for k in range(60)}
    f["proof"]["matrix"][0][0] = "*".join(f"(1 + sign.s{k})" for k in range(60))


def many_cells(f: Files) -> None:
    """Corners of a box of sixty variables."""
    names = [f"in_{k}" for k in range(60)]
    struct = "".join(f"    double {name}; /* 1: input */\n" for name in names)
    f["one_mass.h"] = f["one_mass.h"].replace("    double w; /* N", f"{struct}    double w; /* N")
    f["proof"]["box"] = {f"inputs.{name}": ["0", "1"] for name in names}
    f["proof"]["matrix"] = [["9/10", " + ".join(f"inputs.{name}" for name in names)], ["1", "1"]]


def many_monomials(f: Files) -> None:
    f["proof"]["force"][0] += "*(" + ")*(".join(f"inputs.x + inputs.w + true.v + {k}" for k in range(99)) + ")"


def a_power_that_doubles(f: Files) -> None:
    squares = "".join(f"    const double b{k + 1} = b{k} * b{k};\n" for k in range(60))
    into_step(f, f"    const double b0 = inputs->x;\n{squares}")


def a_number_that_doubles(f: Files) -> None:
    squares = "".join(f"    const double b{k + 1} = b{k} * b{k};\n" for k in range(60))
    into_step(f, f"    const double b0 = 1.000000001;\n{squares}")


def loops_in_loops(f: Files) -> None:
    loop = "const double a = 1.0;"
    for _ in range(5):
        loop = f"for (int i = 0; i < 9999; i++) {{ {loop} }} "
    into_step(f, loop)


def long_arrays(f: Files) -> None:
    into_step(f, "".join(f"    double a{k}[9999];\n" for k in range(2000)))


def a_field_of_a_billion(f: Files) -> None:
    f["one_mass.h"] = f["one_mass.h"].replace("double w;", "double w[999999999];")


def comments_that_do_not_end(f: Files) -> None:
    f["one_mass.c"] += "/*" * 10**6


def long_words(f: Files) -> None:
    into_step(f, ("a" * 199 + " ") * 5000)


def longer_words(f: Files) -> None:
    into_step(f, ("a" * 199 + " ") * 24_000)


def steps_that_do_not_match(f: Files) -> None:
    f["one_mass.c"] += f["one_mass.c"][f["one_mass.c"].index("void one_mass_step") :] * 4000


def a_large_matrix(f: Files) -> None:
    size = 400
    for field in ("matrix", "lyapunov_matrix"):
        f["proof"][field] = [["1" if i == j else "0" for j in range(size)] for i in range(size)]


def denominators(f: Files) -> None:
    size = 90
    rows = [[f"1/{10**9 + 2 * (i * j) + 1}" for j in range(size)] for i in range(size)]
    f["proof"]["mass_matrix"], f["proof"]["force"] = rows, ["0"] * size
    f["proof"]["acceleration"] = {f"true.v{k}": "0" for k in range(size)}


def many_cuts(f: Files) -> None:
    tree: Any = ""
    for k in range(12):
        tree = ["sign.rail", f"{k + 1}/20", tree, tree]
    f["proof"]["cover"] = tree


def a_long_dwell(f: Files) -> None:
    f["proof"]["reversals"] = [f["proof"]["reversals"][0] | {"dwell": "99999"}]
    f["proof"]["decay_rate"] = f"1/{'9' * 90}"


def a_huge_exponent(f: Files) -> None:
    f["proof"]["decay_rate"] = "*".join(["1e999"] * 3000)


def long_texts(f: Files) -> None:
    f["proof"]["domain"] = ["inputs.x" + " + inputs.x" * 1800] * 900


def into_step(f: Files, text: str) -> None:
    """Put statements at the beginning of the step."""
    before, after = f["one_mass.c"].split("    /* velocity estimate, (4.25) */\n", 1)
    f["one_mass.c"] = f"{before}{text}{after}"


def high_powers(f: Files) -> None:
    """Powers of long numbers: each of a thousand digits and more."""
    f["proof"]["box"] = {"inputs.w": [f"-1/{'7' * 90}", f"{'9' * 90}/{'7' * 89}"]}
    f["proof"]["matrix"] = [["9/10", "*".join(["inputs.w"] * 200)], ["1", "1"]]


BUSY: tuple[Callable[[Files], None], ...] = (
    *(many_variables, many_cells, many_monomials, a_power_that_doubles, a_number_that_doubles, loops_in_loops),
    *(long_arrays, a_field_of_a_billion, comments_that_do_not_end, steps_that_do_not_match, a_large_matrix),
    *(long_words, longer_words, denominators, many_cuts, a_long_dwell, high_powers, a_huge_exponent, long_texts),
)


@pytest.mark.parametrize("change", BUSY, ids=lambda change: change.__name__)
def test_a_busy_proof_is_refused(change: Callable[[Files], None], monkeypatch: pytest.MonkeyPatch) -> None:
    """Within the limit, and not long behind it: a single product of long numbers is not interrupted."""
    monkeypatch.setattr(frame, "SECONDS", 0.3)
    changed = files()
    change(changed)
    proof, begun = changed.pop("proof"), time.thread_time()
    with pytest.raises((verify.Refused, RecursionError)):
        verify.by_kernel_alone(proof, {name: text.encode() for name, text in changed.items()})
    assert time.thread_time() - begun < 4


@pytest.mark.parametrize(("count", "why"), [(528, "common denominator is too large"), (30, "more work than")])
def test_numbers_of_many_denominators_are_refused_in_time(
    count: int, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A common denominator of as many digits as all of them have: a minute, once, for 32 errors.

    The matrix is singular, so that no short numbers decide it.
    """
    monkeypatch.setattr(frame, "SECONDS", 0.3)
    content = json.loads((GENERATED / "chain" / "proof.json").read_text("utf-8"))
    scales = [random.Random(k).randrange(10**89, 10**90) for k in range(count)]
    P = [[Fraction(x) for x in row] for row in content["lyapunov_matrix"]]
    for i, row in enumerate(P):
        for j in range(i + 1):
            scale = scales[(i * (i + 1) // 2 + j) % count]
            row[j] = P[j][i] = Fraction(int(row[j] * scale), scale)
    P[1] = [*P[0]]
    for row in P:
        row[1] = row[0]
    begun = time.thread_time()
    with frame.limited(), pytest.raises(ValueError, match=why):
        kernel.semidefinite([[kernel.term(x) for x in row] for row in P], {}, "", {})
    assert time.thread_time() - begun < 4


@pytest.mark.parametrize(
    "names",
    [lambda _: [tuple(f"x{k}" for k in range(11))], lambda at: [(f"x{5 * at + k}",) for k in range(20)]],
    ids=["eleven variables in every entry", "thousands of variables"],
)
def test_a_large_matrix_of_many_variables_is_refused_in_time(
    names: Callable[[int], list[tuple[str, ...]]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As many errors as a certificate may have: a gigabyte of coefficients; minutes to count each entry's variables.

    Neither looked at the time limit.
    """
    monkeypatch.setattr(frame, "SECONDS", 1)
    F = [[kernel.Poly({tuple(sorted(m)): 1 for m in names(32 * i + j)}) for j in range(32)] for i in range(32)]
    P = [[kernel.term(int(i == j)) for j in range(32)] for i in range(32)]
    box = {x: [Fraction(0), Fraction(1)] for row in F for p in row for x in p.names()}
    begun = time.thread_time()
    with frame.limited(), pytest.raises(ValueError, match="more terms than the limit"):
        kernel.contracts(F, P, Fraction(1), box, "", {})
    assert time.thread_time() - begun < 4


@pytest.mark.parametrize(("digits", "why"), [(40, ""), (1900, "too high a power of a range")])
def test_a_high_power_of_a_range_with_long_ends_is_decided_in_time(
    digits: int, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bernstein coefficients of x^64, the highest power in a certificate; as sums of fractions they took minutes."""
    monkeypatch.setattr(frame, "SECONDS", 1)
    ends = [Fraction(odd(digits, k), odd(digits, k + 1)) for k in (0, 2)]
    one, most, x = [[kernel.term(1)]], max(ends) ** 128, [[kernel.term(1, *["x"] * 64)]]
    begun = time.thread_time()
    for factor, refused in ((most, why), (most * (1 - Fraction(1, 10**20)), why or "V may not fall")):
        with frame.limited(), pytest.raises(ValueError, match=refused) if refused else nullcontext():
            kernel.contracts(x, one, factor, {"x": sorted(ends)}, "", {})
    assert time.thread_time() - begun < 4


def test_an_entry_of_a_product_keeps_its_sum_in_memory_and_not_every_part() -> None:
    """Products of polynomials that a proof may name have 300 000 terms each, and are the same powers."""
    row = [kernel.Poly({("x",) * k: i + 1 for k in range(100)}) for i in range(30)]
    one = kernel.Poly({("y",) * k: 1 for k in range(30)})
    tracemalloc.start()
    try:
        ((found,),) = forms.product([row], [[one]] * len(row), kernel.Poly())
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert len(found) == 3000 and most < 5_000_000


@pytest.mark.parametrize("collects", [True, False])
def test_cycles_of_objects_are_sought_as_before_once_a_check_ends(collects: bool) -> None:
    """However it ends."""
    was = gc.isenabled()
    (gc.enable if collects else gc.disable)()
    try:
        for seconds in (1.0, 0.0):
            why = "no" if seconds else "more work than the limit"
            with pytest.raises(ValueError, match=why), frame.limited(), frame.limited(seconds):
                frame.demand(not seconds, "no")
                sum(range(100_000))
                frame.demand(True, "")
        assert gc.isenabled() == collects
        with frame.limited(), frame.limited():
            assert not gc.isenabled()
        assert gc.isenabled() == collects
    finally:
        (gc.enable if was else gc.disable)()


def test_a_certificate_of_long_numbers_is_refused_in_time() -> None:
    """For 32 errors it took 26 s, and of longer numbers minutes."""
    content, scale = json.loads((GENERATED / "chain" / "certificate.json").read_text("utf-8")), 10**299 + 7
    P = content["lyapunov_matrix"]
    content["lyapunov_matrix"] = [[f"{int(Fraction(x) * scale)}/{scale}" for x in row] for row in P]
    begun = time.thread_time()
    with pytest.raises(verify.Refused, match="the numbers are too long for so many errors"):
        verify.check(json.dumps(content), sources={})
    assert time.thread_time() - begun < 4


@pytest.mark.parametrize("where", ["matrix", "parameters"])
def test_an_expression_of_many_operands_does_not_fill_the_memory(where: str) -> None:
    """A file of 4.8 MB took 28 s and 916 MB, and was verified."""
    content = json.loads((HERE / "certificate.json").read_text("utf-8"))
    of_zeros: list[Any] = ["+", *["0"] * 1_200_000]
    if where == "matrix":
        content["matrix"][0][0] = [*of_zeros, content["matrix"][0][0]]
    else:
        content["parameters"] = [{"name": "t", "expression": of_zeros}]
    stated, begun = json.dumps(content, separators=(",", ":")), time.thread_time()
    with pytest.raises(verify.Refused, match="operators, names and numbers, more than 50000"):
        verify.check(stated, sources={})
    assert time.thread_time() - begun < 4


def odd(digits: int, seed: int) -> int:
    return random.Random(seed).randrange(10 ** (digits - 1), 10**digits) | 1


def of_many_denominators(content: Any, size: int = 32) -> Any:
    """The certificate with a P of as many fractions as there may be, with nothing in common."""
    P = [[f"-{odd(1900, i * j)}/{odd(1900, i * j + i + j)}" for j in range(size)] for i in range(size)]
    errors = [{"name": f"e{i}", "meaning": "", "unit": "1"} for i in range(size)]
    content |= {"lyapunov_matrix": P, "error": errors, "matrix": [["0"] * size] * size, "reversals": []}
    return content | {"along": [P[i][1][1:] for i in range(size)] if content["along"] else []}


def with_a_long_sum(content: Any) -> Any:
    content["parameters"].append({"name": "z", "expression": ["+", *(f"1/{odd(3900, k)}" for k in range(1200))]})
    content["matrix"][0][0] = ["+", content["matrix"][0][0], "z"]
    return content


@pytest.mark.parametrize(
    ("name", "change", "why"),
    [
        ("certificate.json", of_many_denominators, "a common denominator is too large"),  # 70 s
        ("limit.json", of_many_denominators, "a common denominator is too large"),  # minutes
        ("certificate.json", with_a_long_sum, "a number grew too long"),  # a quarter of it took 40 s
    ],
)
def test_a_certificate_of_many_denominators_is_refused_in_time(name: str, change: Any, why: str) -> None:
    content, begun = change(json.loads((HERE / name).read_text("utf-8"))), time.thread_time()
    with pytest.raises(verify.Refused, match=why):
        verify.check(json.dumps(content), sources={})
    assert time.thread_time() - begun < 4


def test_long_numbers_in_a_sum_of_many_take_no_more_than_the_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """A minute and more, for one value of one parameter."""
    monkeypatch.setattr(frame, "OF_ALGEBRA", 1)
    content = json.loads((HERE / "certificate.json").read_text("utf-8"))
    content["variables"] |= {name: [f"1/{odd(2000, k)}"] * 2 for k, name in enumerate(("x", "y"))}
    content["parameters"].append({"name": "z", "expression": ["+", *["x", "y"] * 24_000]})
    content["matrix"][0][0] = ["+", content["matrix"][0][0], "z"]
    begun = time.thread_time()
    with pytest.raises(verify.Refused, match="more work than the limit"):
        verify.check(json.dumps(content), sources={})
    assert time.thread_time() - begun < 4


def test_a_set_of_many_denominators_does_not_fill_the_memory() -> None:
    """Twenty thousand numbers with a common denominator of all: 16 GB."""
    files = {path.name: path.read_bytes() for path in HERE.iterdir() if path.is_file()}
    claim = json.loads(files["ellipsoid.json"])
    claim["sets"][0]["matrix"] = [[f"1/{odd(99, k)}" for k in range(20_000)]]
    files["ellipsoid.json"], begun = json.dumps(claim).encode(), time.thread_time()
    with pytest.raises(verify.Refused, match="a common denominator is too large"):
        verify.check(files["proof.json"].decode(), sources=files)
    assert time.thread_time() - begun < 4


def test_comments_without_end_in_the_header_are_refused_in_time() -> None:
    """Each was sought an end for where the units are read: half an hour."""
    changed, begun = files(), time.thread_time()
    changed["one_mass.h"] += "/* " * 300_000
    proof = changed.pop("proof")
    with pytest.raises(verify.Refused, match="a comment without an end"):
        verify.by_kernel_alone(proof, {name: text.encode() for name, text in changed.items()})
    assert time.thread_time() - begun < 4


def test_a_loop_of_many_locals_is_read_in_time() -> None:
    """Every name of it was compared with every local: minutes."""
    changed, begun, local = files(), time.thread_time(), "    const double v_hat ="
    body = "".join(f"double a{k} = 0.0; " for k in range(40_000))
    assert changed["one_mass.c"].count(local) == 1
    changed["one_mass.c"] = changed["one_mass.c"].replace(local, f"for (int i = 0; i < 1; i++) {{ {body}}}\n{local}")
    frame.read("one_mass", changed)
    assert time.thread_time() - begun < 4


def test_copies_of_a_large_polynomial_do_not_fill_the_memory() -> None:
    """656 MB within the time limit."""
    changed, begun, local = files(), time.thread_time(), "    const double v_hat ="
    proof, inputs = changed.pop("proof"), [f"q{k}" for k in range(24)]
    sum_ = " + ".join(f"inputs->{q}" for q in inputs)
    more = f"    const double p = {sum_};\n    const double r = p * p * p * p;\n"
    more += "".join(f"    const double s{k} = {k + 2}.3 * r;\n" for k in range(100))
    fields = "".join(f"    double {q}; /* N: more */\n" for q in inputs)
    pairs = {"one_mass.h": [("    double w;", f"{fields}    double w;")], "one_mass.c": [(local, more + local)]}
    replace_once(changed, pairs)
    with pytest.raises(verify.Refused, match="more terms than the limit"):
        verify.by_kernel_alone(proof, {name: text.encode() for name, text in changed.items()})
    assert time.thread_time() - begun < 8


def test_many_matrices_of_many_entries_are_refused() -> None:
    """1024 matrices of 100 by 100 would fill the memory."""
    wide = math.prod((kernel.term(2) + kernel.term(1, f"sign.{k}") for k in range(10)), start=kernel.term(1))
    rows = [[wide if i == j else kernel.Poly() for j in range(100)] for i in range(100)]
    with pytest.raises(ValueError, match="more terms than the limit"):
        kernel.semidefinite(rows, {}, "", {})


def test_a_cell_of_many_variables_has_too_many_corners(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [f"x{k}" for k in range(60)]
    monkeypatch.setattr(frame, "SECONDS", 1)
    with frame.limited(), pytest.raises(ValueError, match=r"more (work|terms) than the limit"):
        kernel.semidefinite([[kernel.term(1, *names)]], dict.fromkeys(names, (Fraction(1), Fraction(2))), "", {})


@pytest.mark.parametrize("folder", sorted(path.parent.name for path in GENERATED.glob("*/proof.json")))
def test_shipped_proofs_are_far_below_the_limit(folder: str) -> None:
    here = GENERATED / folder
    proof = json.loads((here / "proof.json").read_text("utf-8"))
    begun = time.thread_time()
    errors.prove(proof, {path.name: path.read_text("utf-8") for path in here.glob("*.[ch]")})
    assert time.thread_time() - begun < frame.SECONDS / 3


def test_the_time_begins_anew_with_each_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    busy = files()
    many_monomials(busy)
    busy["proof"]["acceleration"] = {"true.v": busy["proof"]["force"][0]}
    monkeypatch.setattr(frame, "SECONDS", 0.3)
    with pytest.raises(ValueError, match="more work than the limit"):
        errors.prove(busy.pop("proof"), busy)
    sound = files()
    errors.prove(sound.pop("proof"), sound)
