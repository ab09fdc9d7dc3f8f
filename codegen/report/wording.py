"""Numbers and units as the report shows them."""

from __future__ import annotations

import math
from collections.abc import Iterable

DIGITS = 4
PREFIXES = (("", 1.0, 0.1), ("m", 1e3, 1e-4), ("µ", 1e6, 0.0))
"""(prefix, factor, least value in SI that is shown with it)."""


def number(value: float, digits: int = DIGITS) -> str:
    """A number with a true minus sign; a word where there is none to show."""
    if math.isnan(value):
        return "not measured"
    if math.isinf(value):
        return "diverges"
    text = f"{value:.{digits}g}"
    if "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa}·10{_raised(int(exponent))}"
    return text.replace("-", "−")


def percent(share: float, digits: int = 3) -> str:
    """A share of one in %, to a hundredth of a percent at best."""
    if not math.isfinite(share):
        return number(share)
    shown = round(100 * share, 2)
    return f"{number(shown if shown else 0.0, digits)} %"


def change(before: float, after: float) -> str:
    """Relative change with its sign, or nothing where it has no meaning."""
    if not (math.isfinite(before) and math.isfinite(after)) or before == 0:
        return ""
    share = 100 * (after - before) / abs(before)
    return "unchanged" if abs(share) < 0.05 else f"{share:+.1f} %".replace("-", "−")


def unit_text(unit: str) -> str:
    """A unit in print: N*s/m → N·s/m, m^2 → m²; nothing for the unit 1."""
    text = unit.replace("**", "^").replace("*", "·").replace("^2", "²").replace("^3", "³")
    return "" if text == "1" else text


def with_unit(value: float, unit: str, digits: int = DIGITS) -> str:
    """Number and unit; no unit where there is no number."""
    words = unit_text(unit)
    return f"{number(value, digits)} {words}" if words and math.isfinite(value) else number(value, digits)


def prefixed(values: Iterable[float], unit: str) -> tuple[float, str]:
    """Factor and prefixed unit in which the largest finite value of a length or an angle reads well."""
    largest = max((abs(v) for v in values if math.isfinite(v)), default=0.0)
    if unit not in ("m", "rad") or largest == 0:
        return 1.0, unit
    prefix, factor = next((prefix, factor) for prefix, factor, least in PREFIXES if largest >= least)
    return factor, prefix + unit


def _raised(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
