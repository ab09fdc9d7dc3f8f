"""Normalisation of the text of a unit: ASCII factors joined by * and /, powers after ^.

pint misreads some spellings: ``Nm`` as number metric (yarn count), ``Pas`` as several pascals, ``ftlb`` as a femto troy
pound. All other modules use the normalised form, ``N*m``.
"""

import re

_SIGNS = str.maketrans(
    {"·": ".", "⋅": ".", "∙": ".", "×": "*", "−": "-", "–": "-", "‑": "-", "\N{MICRO SIGN}": "u", "μ": "u"}
    | {"\N{OHM SIGN}": "ohm", "Ω": "ohm", "°": "deg", "′": "arcmin", "″": "arcsec"}
)
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")
# Factors that are often written together, and how they are separated.
_JOINED = {"Nm": "N*m", "Nms": "N*m*s", "Ns": "N*s", "Vs": "V*s", "As": "A*s", "Ws": "W*s", "Js": "J*s", "Pas": "Pa*s"}
_JOINED |= {f"{prefix}Nm": f"{prefix}N*m" for prefix in ("m", "u", "c", "da", "k", "M")}
_JOINED |= {f"N{prefix}m": f"N*{prefix}m" for prefix in ("m", "c")} | {"kgm": "kg*m", "gcm": "g*cm", "kgcm": "kg*cm"}
_JOINED |= {"kgfcm": "kgf*cm", "kgfm": "kgf*m", "gfcm": "gf*cm", "ozin": "oz*in", "ozfin": "ozf*in", "lbin": "lb*in"}
_JOINED |= {"lbfin": "lbf*in", "inlb": "in*lb", "inlbf": "in*lbf", "ftlb": "ft*lb", "ftlbf": "ft*lbf", "lbft": "lb*ft"}
_JOINED |= {"lbfft": "lbf*ft", "ftoz": "ft*oz"}
# Names after which a 2 or 3 is a power: m2, kgm2.
_POWERED = ("m", "s", "g", "in", "ft", "cm", "mm", "rad", "kgm", "gcm", "kgcm", "Nm", "ozin", "lbin", "lbft")
# A name, or names joined by hyphens, with its power and with the / before it.
_COMPOUND = re.compile(
    r"(?P<over>/\s*)?(?P<words>[A-Za-z_]\w*+(?:-[A-Za-z_]\w*+)*)(?P<power>\s*(?:\^|\*\*)\s*(?:-?\d+|\([^()]*\)))?"
)
# a/b.c: the dot may multiply the quotient or its denominator.
_AMBIGUOUS = re.compile(r"/\s*[A-Za-z_]\w*+(?:\^-?\d+)?\s*\.\s*[A-Za-z_]")
# A normalised unit: names, 1, powers of at most two digits, and * / ( ).
_POWER = r"(?:\^|\*\*)\s*(?:-?\d{1,2}(?:\.\d{1,4})?|\(\s*-?\d{1,2}\s*(?:/\s*\d{1,2}\s*)?\))(?!\s*(?:\^|\*\*|\d))"
_PLAIN = re.compile(rf"(?:[A-Za-z_]\w*+|(?<!\w)1(?!\w)|{_POWER}|[*/() .])*+")

_WITHOUT_SIGN = re.compile(r"(?<![\w.])([A-Za-z]+)-([1-3])(?!\w)")
"""A negative power whose ^ is missing, as plain text has it: ``min-1``, ``m*s-2``."""
_REVOLUTIONS = re.compile(r"(?<![\w/*.^-])r/min(?!\w)")
"""Revolutions per minute as in Japanese data sheets; a lone r is no other unit."""
_QUOTES = "“”„‟«»‘’‚\"'"
_NUMBER = re.compile(r"(?<![\w.^(-])(?<!\*\*)(?!1(?![\w.^]))\d[\d.]*(?:[eE][+-]?\d+|(?:\^|\*\*)-?\d+)?")
"""A number other than 1 that is no power, such as 1e-3 or 10^-3."""


class Unreadable(ValueError):
    """The text is no unit; ``meant`` is the nearest unit, or empty."""

    def __init__(self, expected: str, meant: str = "") -> None:
        super().__init__(expected)
        self.expected, self.meant = expected, meant


def with_plain_signs(text: str) -> str:
    """The text with typographic signs replaced by ASCII: ``kg–cm²`` as ``kg-cm^2``; ``min-1`` as ``min^-1``."""
    plain = re.sub(r"[⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+", lambda raised: "^" + raised[0].translate(_RAISED), text).translate(_SIGNS)
    return _REVOLUTIONS.sub("rev/min", _WITHOUT_SIGN.sub(r"\1^-\2", plain))


def spelled(text: str) -> str:
    """A unit in normalised form: ``mN·m/A`` as ``mN*m/A``, ``kg·m²`` and ``kgm2`` as ``kg*m^2``.

    A name of several units is one factor: ``rad/Nm`` is ``rad/(N*m)``.

    Raises:
        Unreadable: for characters that no unit has, numbers that are no powers, and a/b·c, which is ambiguous.
    """
    plain = with_plain_signs(text)
    if _AMBIGUOUS.search(plain):
        meant = re.sub(r"/\s*([^/*() ]+)", lambda below: f"/({below[1].replace('.', '*')})", plain)
        raise Unreadable("parentheses around what is below the line", meant)
    plain = _COMPOUND.sub(_compound, re.sub(r"(?<=[A-Za-z_\d])\s*\.\s*(?=[A-Za-z_])", "*", plain))
    if len(plain) > 200 or not plain.isascii() or not _PLAIN.fullmatch(plain):
        factor = _NUMBER.search(plain)
        instead = f", without the number {factor[0]}, which belongs into the value" if factor else ""
        instead = "; 94 % is the value 0.94 in the unit 1" if plain == "%" else instead
        unquoted = plain.strip(_QUOTES)
        raise Unreadable(f"a unit such as N*m, kg*m^2 or 1{instead}", unquoted if _PLAIN.fullmatch(unquoted) else "")
    return plain


def _compound(found: re.Match[str]) -> str:
    """A name, or names joined by hyphens, with * between the factors; in parentheses in a denominator."""
    parts = [_factors(word) for word in found["words"].split("-")]
    product, over = "*".join(parts) + (found["power"] or ""), found["over"] or ""
    return f"{over}({product})" if over and "*" in product.replace("**", "^") else over + product


def _factors(word: str) -> str:
    """One word: ``Nm`` as ``N*m``, ``m2`` as ``m^2``."""
    name, digit = (word[:-1], f"^{word[-1]}") if word[-1] in "23" and word[:-1] in _POWERED else (word, "")
    return _JOINED.get(name, name) + digit
