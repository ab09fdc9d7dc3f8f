"""Formatting of numbers and units in the report."""

import math
from collections.abc import Iterable, Sequence

from codegen.base.significant import significant_digits

DIGITS = 4
"""Significant digits by default."""
PREFIXES = (("", 1.0, 0.1), ("m", 1e3, 1e-4), ("µ", 1e6, 0.0))
"""(prefix, factor, least value in SI for which it is used)."""
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
"""Digits and the minus sign → superscripts."""
UNCHANGED = 0.05
"""A change of less than this, in %, would be printed as 0.0 %."""


def number(value: float, digits: int = DIGITS, form: str = "") -> str:
    """A number with a typographic minus sign, or a word for NaN and infinity; ``form``: ``#`` keeps trailing zeros."""
    if math.isnan(value):
        return "not measured"
    if math.isinf(value):
        return "diverges"
    text = f"{value:{form}.{digits}g}".removesuffix(".")
    if "e" in text:
        mantissa, exponent = text.split("e")
        mantissa = mantissa.removesuffix(".")
        text = f"{mantissa}·10{str(int(exponent)).translate(RAISED)}"
    return text.replace("-", "−")


def estimated(value: float, interval: Sequence[float]) -> tuple[str, str]:
    """A value and its 95 % interval, with as many digits as the width of the interval justifies."""
    if not all(map(math.isfinite, interval)):
        return number(value), "not bounded"
    if len(interval) != 2 or interval[0] == interval[1]:
        return number(value), " to ".join(map(number, interval))
    return _fixed(value, interval), " to ".join(_fixed(end, interval) for end in interval)


def _fixed(value: float, interval: Sequence[float]) -> str:
    """The value with all digits down to the second digit of its interval's half width, trailing zeros included."""
    digits = significant_digits(value, interval)
    return number(float(f"{value:.{digits}g}"), digits, "#")


def percent(share: float, digits: int = 3) -> str:
    """A share of one in %, to a hundredth of a percent at best."""
    if not math.isfinite(share):
        return number(share)
    shown = round(100 * share, 2)
    return f"{number(shown if shown else 0.0, digits)} %"  # 0.0 in place of -0.0


def count(value: int) -> str:
    """A whole number with a narrow space between thousands."""
    return f"{value:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")


def change(before: float, after: float) -> str:
    """Relative change with its sign; empty where it is undefined."""
    if not (math.isfinite(before) and math.isfinite(after)) or before == 0:
        return ""
    percentage = 100 * (after - before) / abs(before)
    return "unchanged" if abs(percentage) < UNCHANGED else f"{percentage:+.1f} %".replace("-", "−")


def unit_text(unit: str) -> str:
    """A formatted unit: N*s/m → N·s/m, m^2 → m²; empty for the unit 1."""
    text = unit.replace("**", "^").replace("*", "·").replace("^2", "²").replace("^3", "³")
    return "" if text == "1" else text


def with_unit(value: float, unit: str, digits: int = DIGITS) -> str:
    """Number and unit; no unit where there is no number."""
    return joined(number(value, digits), unit) if math.isfinite(value) else number(value, digits)


def joined(shown: str, unit: str) -> str:
    """A formatted number and its unit."""
    words = unit_text(unit)
    return f"{shown} {words}" if words else shown


def prefixed(values: Iterable[float], unit: str) -> tuple[float, str]:
    """(factor, unit): value in SI times the factor is in the prefixed unit that suits the largest finite value.

    Lengths and angles only; 1 and the unit as it is for other units.
    """
    largest = max((abs(v) for v in values if math.isfinite(v)), default=0.0)
    if unit not in ("m", "rad") or largest == 0:
        return 1.0, unit
    prefix, factor = next((prefix, factor) for prefix, factor, least in PREFIXES if largest >= least)
    return factor, prefix + unit
