"""The decay of V = e'Pe for a matrix of quotients of polynomials in sines, cosines and variables (field `cover`).

Standard library only; part of the checker (verify.py), which passes ``enclosure`` and ``kernel`` in. The matrix is the
certificate's own; nothing is said here about code. The decay is shown by Bernstein coefficients (kernel lemmas 4 to 6)
on each cell of a subdivision of the box. A sine and a cosine of one angle are treated as dependent, which the vertices
of a box of both would not do.
"""

from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or __package__:
    from codegen.checker import enclosure, frame, kernel

MOST_FACTORS = 100  # of a product of names: a power of a power of a power would fill the memory
FUNCTIONS = {"sin": "sin", "cos": "cos", "exp": "exp", "abs": "fabs"}
Interval = tuple[Fraction, Fraction]


def polynomial(entry: Any, names: Mapping[str, Any], known: dict[Any, Any], enclosed: bool = False) -> Any:
    """A prefix expression (docs/certificate_format.md) of sums, products, quotients, powers and FUNCTIONS.

    Args:
        known: the reciprocals and angles so far, as of kernel.Text.
        enclosed: whether the exp of a number may be the kernel's decimal: where the claim is verified for all that it
            can be in its enclosure, in which the decimal then has to be.
    """
    if isinstance(entry, str):
        return names[entry] if entry in names else kernel.term(entry)
    word, *parts = entry
    kernel.demand(word in ("+", "*", "neg", "/", "^", *FUNCTIONS), f"matrix: {word}")
    first = polynomial(parts[0], names, known, enclosed)
    number = word == "exp" and first and not first.names()
    kernel.demand(enclosed or not number, "matrix: exp of a number")
    if word in FUNCTIONS:
        done = kernel.function(FUNCTIONS[word], first, known)
        if number:
            low, high = enclosure.exponential(first.constant(), first.constant())
            kernel.demand(low <= done.constant() <= high, "matrix: a decimal beyond the enclosure of its exp")
        return done
    if word == "^":
        power, count = kernel.term(1), int(parts[1])
        kernel.demand(0 <= count <= enclosure.MAX_POWER, f"exponent {count}")
        for _ in range(count):
            power = short(power * first)
        return power
    for part in parts[1:]:
        other = polynomial(part, names, known, enclosed)
        other = kernel.function("1/", other, known) if word == "/" else other
        first = first + other if word == "+" else short(first * other)
    return first * kernel.term(-1) if word == "neg" else first


def short(p: Any) -> Any:
    """The polynomial, if its products are of few names."""
    kernel.demand(all(len(m) < MOST_FACTORS for m in p), "a power is too high")
    return p


def step(
    top: dict[str, Any], names: Mapping[str, Any], known: dict[Any, Any], enclosed: bool = False
) -> list[list[Any]]:
    """I + hA of a certificate (as verify.parsed gives it), over these names for its variables.

    Args:
        enclosed: as of ``polynomial``.
    """
    h = kernel.term(top["sample_time"])
    named = {e["name"]: polynomial(e["expression"], names, known, enclosed) for e in top["parameters"]}
    return [
        [kernel.term(int(i == j)) + h * polynomial(a, {**names, **named}, known, enclosed) for j, a in enumerate(row)]
        for i, row in enumerate(top["matrix"])
    ]


@frame.limited()
def fall(top: dict[str, Any], ends: dict[str, Interval], factor: Fraction) -> str:
    """That V falls by the factor wherever the variables are between their ends: the fact, or enclosure.Refused."""
    known: dict[Any, Any] = {}
    (tree,) = top["cover"]
    thetas = {e["name"]: enclosure.parse(e["expression"], ends, e["name"]) for e in top["parameters"]}
    for i, row in enumerate(top["matrix"]):
        for j, entry in enumerate(row):
            enclosure.parse(entry, thetas, f"matrix[{i}][{j}]", affine=True)
    try:
        F = step(top, {name: kernel.term(1, name) for name in ends}, known)
        for p in divisors(known):
            kernel.semidefinite([[p]], ends, tree, known, kernel.LEAST)
        P = [[kernel.term(x) for x in row] for row in top["lyapunov_matrix"]]
        kernel.contracts(F, P, factor, ends, tree, known)
    except (ArithmeticError, LookupError, TypeError, ValueError) as why:
        raise enclosure.Refused(f"V is not shown to fall: {str(why)[:200]}") from None
    return f"every coefficient of {leaves(tree)} cells"


def divisors(known: dict[Any, Any]) -> list[Any]:
    """What was divided by, each to be shown to be positive."""
    return [p for name, p in [*known] if name == "1/"]


def leaves(tree: Any) -> int:
    return 1 if tree == "" else leaves(tree[2]) + leaves(tree[3])
