"""Interval arithmetic with rational ends, rounded outwards: the range of an expression over ranges of its names.

Standard library only; part of the checker (verify.py), which passes ``frame`` in.
"""

import math
import re
from collections.abc import Callable, Collection, Iterable
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal
from fractions import Fraction
from functools import lru_cache, reduce
from itertools import accumulate
from reprlib import repr as brief
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import files, frame

Refused, demand = files.Refused, files.demand
MAX_STRING, MAX_POWER = 4000, 64
TOO_LONG, DIGITS, FINEST = 1 << 2**14, 96, 512  # rounded numbers have DIGITS binary digits, none below 2^-FINEST
RATIONAL = re.compile("-?[0-9]+(/0*[1-9][0-9]*)?")
MANY = 5_000_000
OPERANDS = {"+": MANY, "*": MANY, "neg": 1, "/": 2, "^": 2, "sin": 1, "cos": 1, "exp": 1, "abs": 1, "sqrt": 1}
Interval = tuple[Fraction, Fraction]
Compiled = tuple[frozenset[str], Callable[..., Any]]  # an expression's names, and its value at those of the names


fraction = lru_cache(4096)(Fraction)  # of a text: a symmetric matrix, which certificate and proof have, repeats them


def rational(raw: Any, where: str, known: Collection[str] = ()) -> Fraction:
    """The number that a text says; Refused if it is none, with the names that may stand in its place."""
    good = isinstance(raw, str) and len(raw) <= MAX_STRING and RATIONAL.fullmatch(raw) is not None
    if not good:
        names = f" (known names: {brief(sorted(known))})" if known else ""
        raise Refused(f"{where}{names}: {brief(raw)} is no 'RATIONAL' of at most {MAX_STRING} characters")
    return fraction(raw)


def show(x: Fraction, rounding: str = ROUND_HALF_EVEN) -> str:
    """The number in nine digits; the next power of two, rounded likewise, if it is beyond the range of a double."""
    size = x.numerator.bit_length() - x.denominator.bit_length()  # 2^(size - 1) < |x| < 2^(size + 1)
    if abs(size) < 1000:
        return f"{float(Context(9, rounding).divide(*map(Decimal, x.as_integer_ratio()))):.9g}"
    further = {ROUND_CEILING: 1, ROUND_FLOOR: -1}.get(rounding, 0)
    return f"{'-' * (x < 0)}2^{size + (-further if x < 0 else further)}{' or so' * (not further)}"


def most(x: Fraction) -> str:
    """An upper bound for printing: nine digits, rounded up."""
    return show(x, ROUND_CEILING)


def least(x: Fraction) -> str:
    """A lower bound for printing: nine digits, rounded down."""
    return show(x, ROUND_FLOOR)


def exact(x: Fraction) -> str:
    """The exact number for printing: a decimal if 17 digits are enough, else a fraction."""
    decimal = Context(17).divide(*map(Decimal, x.as_integer_ratio()))
    return f"{decimal:g}" if Fraction(decimal) == x else str(x)


def as_sum(p: Any) -> str:
    """A polynomial as a sum of products."""
    written = ""
    for m, c in sorted(p.items()):
        size = exact(abs(Fraction(c)))
        product = "*".join([*([size] if size != "1" or not m else []), *m])
        written += (" - " if c < 0 else " + ") + product if written else "-" * (c < 0) + product
    return written


def widen(low: Fraction, high: Fraction, digits: int = DIGITS) -> Interval:
    """The interval rounded outwards, so that its ends are short numbers."""
    ends = []
    for x in (low, -high):
        top, bottom = x.as_integer_ratio()
        shift = min(digits - top.bit_length() + bottom.bit_length(), FINEST)
        if max(abs(top), bottom) >> digits:
            up, down = max(shift, 0), max(-shift, 0)
            x = Fraction((top << up) // (bottom << down) << down, 1 << up)
        ends.append(x)
    return ends[0], -ends[1]


def hull(numbers: Iterable[Fraction]) -> Interval:
    frame.demand(True, "")  # a sum has many operands
    ends = sorted(numbers)
    demand(all(max(abs(x.numerator), x.denominator) < TOO_LONG for x in ends), "a number grew too long to go on")
    return ends[0], ends[-1]


def distinct(x: Interval) -> tuple[Fraction, ...]:
    """The ends of an interval, or just one if it is a single number: a product then needs half the work."""
    return x[:1] if x[0] is x[1] else x


# pi by Machin: the terms (16/5^n - 4/239^n)/n, n = 1, 3, 5, ..., fall and alternate, so successive sums enclose it.
SUMS = list(accumulate((-1) ** (n // 2) * (Fraction(16, 5**n) - Fraction(4, 239**n)) / n for n in range(1, 80, 2)))
PI = widen(*sorted(SUMS[-2:]))


def series(z: Fraction, divisors: list[int]) -> Interval:
    """An interval about 1 + z/d1 + (z/d1)(z/d2) + ..., to each side as wide as the last term. In integers: faster."""
    top, bottom, last = 1, 1, 1
    for divisor in reversed(divisors):
        bottom *= divisor * z.denominator
        top, last = bottom + z.numerator * top, abs(z.numerator) * last
    return widen(Fraction(top - last, bottom), Fraction(top + last, bottom))


@lru_cache(4096)
def sine(low: Fraction, high: Fraction) -> Interval:
    """By Taylor: the terms fall from the |x|-th on, and Lagrange's remainder is at most the next one."""
    one = Fraction(1)
    low, high = widen(low, high) if max(-low, high) < 100 else (-4 * one, 4 * one)  # the latter gives [-1, 1]
    ends = [x * y for x in (low, high) for y in series(-x * x, [k * k + k for k in range(2, 44 + 4 * int(abs(x)), 2)])]
    for extreme in (one, -one):  # at (2k + extreme/2) pi: may a whole k, for all we know of pi, bring that in between?
        first, last = ([(end / pi - extreme / 2) / 2 for pi in PI] for end in (low, high))
        ends += [extreme] if math.ceil(min(first)) <= math.floor(max(last)) else []
    return hull(min(max(end, -one), one) for end in ends)


def exponential(low: Fraction, high: Fraction) -> Interval:
    """By Taylor, so far that each term is below half the one before: the last exceeds all that are left out."""
    demand(high <= 100, f"exp of a number up to {show(high)}, beyond 100")
    points = widen(max(low, Fraction(-100)), max(high, Fraction(-100)))
    ends = [end for x in points for end in series(x, list(range(1, 40 + 5 * math.ceil(abs(x)))))]
    return hull(ends + [Fraction(0)] * (low < -100))


def apply(op: str, operands: list[Any], where: str) -> Interval:
    """The range of an operator over the ranges of its operands; or of "number", a Fraction."""
    if op == "number":
        return operands[0], operands[0]
    frame.demand(True, "")  # there is time left
    args: list[Interval] = operands
    (low, high), zero = args[0], Fraction(0)
    if op == "+":
        return reduce(lambda x, y: hull((x[0] + y[0], x[1] + y[1])), args)
    if op == "*":
        return reduce(lambda x, y: hull(a * b for a in distinct(x) for b in distinct(y)), args)
    if op == "/":
        demand(args[1][0] > 0 or args[1][1] < 0, f"{where}: divisor from {show(args[1][0])} to {show(args[1][1])}")
        return hull(a / b for a in args[0] for b in args[1])
    if op == "abs" or (op == "^" and args[1][0] % 2 == 0):
        low, high = max(low, -high, zero), max(-low, high)
    if op == "sqrt":
        demand(low >= 0, f"{where}: sqrt of a number down to {show(low)}")
        low, high = (x * 4**FINEST for x in widen(low, high))
        below, above = math.isqrt(math.floor(low)), math.isqrt(math.ceil(high))
        return widen(Fraction(below, 2**FINEST), Fraction(above + (above**2 < high), 2**FINEST))
    if op in ("exp", "sin"):
        return exponential(low, high) if op == "exp" else sine(low, high)
    if op == "cos":  # 1 - 2 sin(x/2)^2, which is exactly 1 at 0
        low, high = apply("^", [sine(low / 2, high / 2), (zero + 2, zero + 2)], where)
        return 1 - 2 * high, 1 - 2 * low
    if op == "neg":
        return -high, -low
    return hull(end ** int(args[1][0]) for end in (low, high)) if op == "^" else (low, high)


def decayed(growth: Fraction, factor: Fraction, samples: int) -> Fraction:
    """An upper bound of growth * factor^samples, by squaring, rounded up."""
    while samples:
        growth = widen(growth, growth * factor)[1] if samples % 2 else growth
        factor, samples = widen(factor, factor * factor)[1], samples // 2
    return growth


def parse(raw: Any, known: Collection[str], where: str, affine: bool = False) -> Compiled:
    """An expression (docs/certificate_format.md) over the known names: its names, and its value at theirs.

    Values are ranges, or whatever else a function computes that is given in place of ``apply``.

    Args:
        affine: its form must show it affine in every single name.
    """
    if isinstance(raw, str) and raw in known:
        return frozenset({raw}), lambda at, _=apply: at[raw]
    if not isinstance(raw, list):
        number = rational(raw, where, known)
        return frozenset(), lambda _, operate=apply: operate("number", [number], where)
    op, rest, admitted = (raw or [None])[0], raw[1:], ("+", "*", "neg", "/") if affine else (*OPERANDS,)
    good = op in admitted and min(2, OPERANDS[op]) <= len(rest) <= OPERANDS[op]
    demand(good, f"{where}: {brief(raw)} is no expression here")
    names, values = zip(*(parse(item, known, where, affine) for item in rest), strict=True)
    if op == "^" or (affine and op == "/"):
        power = rational(rest[1], where)
        demand(op == "/" or power in range(MAX_POWER + 1), f"{where}: exponent {show(power)}, not 0 to {MAX_POWER}")
    union = frozenset[str]().union(*names)
    demand(not affine or op != "*" or sum(map(len, names)) == len(union), f"{where}: a name occurs in two factors")
    return union, lambda at, operate=apply: operate(op, [value(at, operate) for value in values], where)
