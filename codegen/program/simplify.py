"""Algebraic simplification: constants folded, divisions by constants replaced, like terms collected, sums factored.

A node that has a name or is used more than once is *closed*: it is computed once, and stays as it is. Any other node is
*open*: it may be merged into the node that uses it. Every rule saves operations of a step or moves them into derived
constants. The result determines the order of operations in every output language.
"""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction

from codegen.program.arrays import Element
from codegen.program.graph import Graph, Node, reachable

Term = tuple[int, Node]
"""Sign and node of a sum's term."""


def normalise(
    roots: Sequence[Node],
    named: Iterable[Node],
    graph: Graph,
    factoring: bool,
    places: Mapping[str, Element] | None = None,
) -> dict[Node, Node]:
    """Node → its simplified form, for the roots and every node below them.

    Args:
        roots: nodes to be computed.
        named: nodes with a name, which are not merged into others.
        factoring: whether a x + b x becomes (a + b) x for variable a and b.
        places: symbol → array element; terms of sums are then ordered by the first array element on which they depend,
            so that equal computations on different elements have the same form.
    """
    nodes = reachable(roots)
    uses = Counter(a for node in nodes for a in node.arguments)
    uses.update(roots)
    divided = Counter(node.arguments[1] for node in nodes if node.kind == "quotient")
    named = set(named)
    # Angles whose sine and cosine are computed anyway, so that those of their sums and differences need no call.
    angles = {n.arguments[0] for n in nodes if n.name in ("sin", "cos") and n.arguments and n.arguments[0].leaf}
    rules = _Rules(graph, factoring, angles, places or {})
    simplified: dict[Node, Node] = {}
    for node in nodes:
        result = rules.rebuilt(node, [simplified[a] for a in node.arguments], divided)
        if node in named:
            rules.closed.add(result)
        elif uses[node] > 1:
            rules.closed.add(result.arguments[0] if result.kind == "negative" else result)
        simplified[node] = result
    return simplified


class _Rules:
    """Rules that rebuild a node over its simplified arguments.

    Attributes:
        closed: simplified nodes that are not merged into others.
        angles: nodes whose sine or cosine is computed anyway.
    """

    def __init__(self, graph: Graph, factoring: bool, angles: set[Node], places: Mapping[str, Element]) -> None:
        self.graph, self.factoring, self.angles, self.places = graph, factoring, angles, places
        self.closed: set[Node] = set()
        self.first: dict[Node, tuple[str, int]] = {}

    def first_place(self, node: Node) -> tuple[str, int]:
        """(array, index) of the first array element on which an expression depends; one that sorts last if none."""
        if node not in self.first:
            place = self.places.get(node.name) if node.kind == "symbol" and not node.constant else None
            own = ("~", 0) if place is None else (place.array, place.at)
            self.first[node] = min((self.first_place(a) for a in node.arguments), default=own)
        return self.first[node]

    def rebuilt(self, node: Node, arguments: list[Node], divided: Counter[Node]) -> Node:
        """The simplified form of a node over its simplified arguments; ``divided``: divisor → number of quotients."""
        match node.kind:
            case "sum":
                return self.sum(list(zip(node.signs, arguments, strict=True)))
            case "product":
                return self.product(arguments)
            case "negative":
                return self.sum([(-1, arguments[0])])
            case "quotient":
                return self.quotient(arguments[0], arguments[1], divided[node.arguments[1]] > 1)
            case "call" if node.name in ("sin", "cos") and arguments[0].kind == "sum":
                return self.sine_of_sum(node.name, arguments[0])
            case "call":
                return self.graph.call(node.name, arguments)
        return node

    def sine_of_sum(self, name: str, angle: Node) -> Node:
        """Sine or cosine of α ± β by the addition theorem, if those of α and β are computed anyway."""
        if len(angle.arguments) != 2 or not self.angles.issuperset(angle.arguments):
            return self.graph.call(name, [angle])
        (sin_a, cos_a), (sin_b, cos_b) = (
            (self.graph.call("sin", [a]), self.graph.call("cos", [a])) for a in angle.arguments
        )
        self.closed |= {sin_a, cos_a, sin_b, cos_b}
        sign = angle.signs[1]
        pairs = [(sin_a, cos_b), (cos_a, sin_b)] if name == "sin" else [(cos_a, cos_b), (sin_a, sin_b)]
        first, second = (self.product(pair) for pair in pairs)
        return self.sum([(1, first), (sign if name == "sin" else -sign, second)])

    def is_open(self, node: Node) -> bool:
        """Whether a node may be merged into the node that uses it; constants are computed once, outside the step."""
        return node.constant or node not in self.closed

    def coefficient(self, node: Node) -> tuple[Node | None, Node | None]:
        """(constant factor, variable factor) of a term; None for a factor that it does not have."""
        if node.constant:
            return node, None
        if node.kind == "product" and node.arguments[0].constant and self.is_open(node):
            variable = node.arguments[1:]
            return node.arguments[0], variable[0] if len(variable) == 1 else self.graph.product(variable)
        return None, node

    def sum(self, terms: Sequence[Term]) -> Node:
        """The sum of terms, in which like terms, such as a x + b x with constants a and b, are one term (a + b) x."""
        groups: dict[Node | None, list[tuple[int, Node | None]]] = {}  # variable factor → signs and constant factors
        whole: dict[Node | None, Node] = {}
        for sign, node in self.flattened(terms):
            factor, variable = self.coefficient(node)
            groups.setdefault(variable, []).append((sign, factor))
            whole[variable] = node
        result: list[Term] = []
        for variable, factors in groups.items():
            if len(factors) == 1:
                result.append((factors[0][0], whole[variable]))
                continue
            one = self.graph.number(1.0)
            total = constant_sum([(sign, one if f is None else f) for sign, f in factors], self.graph)
            result += self.flattened([(1, total if variable is None else self.product([total, variable]))])
        if self.factoring:
            result = self.factored(result)
        if self.places:
            result.sort(key=lambda term: self.first_place(term[1]))
        return self.assembled(result)

    def flattened(self, terms: Sequence[Term]) -> list[Term]:
        """The terms with open sums and negatives expanded, signs of numbers extracted, and zeros removed."""
        result: list[Term] = []
        for sign, node in terms:
            if node.kind == "sum" and self.is_open(node) and not node.constant:
                result += [(sign * s, t) for s, t in zip(node.signs, node.arguments, strict=True)]
            elif node.kind == "negative" and self.is_open(node):
                result += self.flattened([(-sign, node.arguments[0])])
            elif node.is_number():
                if node.value:
                    result.append((sign if node.value > 0 else -sign, self.graph.number(abs(node.value))))
            else:
                result.append((sign, node))
        return result

    def factored(self, terms: list[Term]) -> list[Term]:
        """The terms with the common factors of open products extracted, the most frequent first."""
        counts: Counter[Node] = Counter()
        for _, node in terms:
            counts.update({f for f in self.factors(node) if not f.constant})
        most = max(counts.items(), key=lambda item: (item[1], -item[0].index), default=None)
        if most is None or most[1] < 2:
            return terms
        common = most[0]
        inside: list[Term] = []  # terms with the common factor, without it
        outside: list[Term] = []
        for sign, node in terms:
            factors = list(self.factors(node))
            if common in factors:
                factors.remove(common)
                inside.append((sign, self.product(factors)))
            else:
                outside.append((sign, node))
        return self.factored([*outside, *self.flattened([(1, self.product([self.sum(inside), common]))])])

    def factors(self, node: Node) -> tuple[Node, ...]:
        """The factors of an open product; any other node is its only factor."""
        return node.arguments if node.kind == "product" and self.is_open(node) else (node,)

    def assembled(self, terms: list[Term]) -> Node:
        """The sum of the terms: the first positive one, then the others in order."""
        if not terms:
            return self.graph.number(0.0)
        if len(terms) > 1 and all(node.constant for _, node in terms):
            return constant_sum(terms, self.graph)
        first = next((k for k, (sign, _) in enumerate(terms) if sign > 0), None)
        if first is None:
            total = self.assembled([(1, node) for _, node in terms])
            return self.graph.number(-total.value) if total.is_number() else self.graph.negative(total)
        if len(terms) == 1:
            return terms[0][1]
        return self.graph.sum([terms[first], *terms[:first], *terms[first + 1 :]])

    def product(self, nodes: Sequence[Node]) -> Node:
        """The product: its sign outside, then one constant factor, then the variable ones in order of creation.

        The constant is multiplied into the terms of a sum if that costs nothing (``absorbs``).
        """
        sign, constants, varying = 1, [], []
        for node in self.all_factors(nodes):
            if node.kind == "negative" and self.is_open(node):
                sign, node = -sign, node.arguments[0]
                more = self.all_factors([node])
            else:
                more = [node]
            constants += [f for f in more if f.constant]
            varying += [f for f in more if not f.constant]
        factor = constant_product(constants, self.graph)
        if factor.kind == "negative":
            sign, factor = -sign, factor.arguments[0]
        if factor.is_number() and factor.value < 0:
            sign, factor = -sign, self.graph.number(-factor.value)
        if factor.is_number(0.0):
            return factor
        if len(varying) == 1 and not factor.is_number(1.0) and self.absorbs(varying[0]):
            inner = varying[0]
            terms = [(sign * s, self.product([factor, t])) for s, t in zip(inner.signs, inner.arguments, strict=True)]
            return self.sum(terms)
        varying.sort(key=lambda f: f.index)
        factors = varying if factor.is_number(1.0) and varying else [factor, *varying]
        result = factors[0] if len(factors) == 1 else self.graph.product(factors)
        return self.assembled([(sign, result)])

    def all_factors(self, nodes: Sequence[Node]) -> list[Node]:
        """The nodes, open products replaced by their factors; constant products stay."""
        return [f for node in nodes for f in ((node,) if node.constant else self.factors(node))]

    def absorbs(self, node: Node) -> bool:
        """Whether a constant factor of this sum costs nothing, because each of its terms has one already."""
        if node.kind != "sum" or not self.is_open(node):
            return False
        return all(self.coefficient(t)[0] is not None for t in node.arguments)

    def quotient(self, above: Node, below: Node, shared: bool) -> Node:
        """above/below, with a constant factor of the divisor as a product with its reciprocal.

        ``shared``: whether several quotients have this divisor; its reciprocal is then computed once.
        """
        factor, divisor = self.coefficient(below)
        if factor is not None:
            above = self.product([above, constant_reciprocal(factor, self.graph)])
        if divisor is None or above.is_number(0.0):
            return above
        if shared and not above.is_number(1.0):
            return self.product([above, self.graph.quotient(self.graph.number(1.0), divisor)])
        if above.kind == "negative" and self.is_open(above):
            return self.graph.negative(self.graph.quotient(above.arguments[0], divisor))
        return self.graph.quotient(above, divisor)


# Constants: numbers are evaluated; parameters become a product divided by a product. A quotient of numbers such as 1/3,
# which no decimal of a double's digits equals, stays a quotient: a proof of the C needs its exact value.

LARGEST_INTEGER = 2**53
"""Largest integer up to which a double holds every integer."""


def constant_product(factors: Sequence[Node], graph: Graph) -> Node:
    """The product of constants as number · factors / divisors, factors and divisors in the order of their creation."""
    number, divisor = 1.0, 1.0
    above: list[Node] = []
    below: list[Node] = []
    waiting = list(factors)
    while waiting:
        node = waiting.pop(0)
        if node.is_number():
            number *= node.value
        elif node.kind == "product":
            waiting += node.arguments
        elif node.kind == "negative":
            number, waiting = -number, [*waiting, node.arguments[0]]
        elif node.kind == "quotient":
            waiting.append(node.arguments[0])
            for factor in node.arguments[1].arguments if node.arguments[1].kind == "product" else [node.arguments[1]]:
                if factor.is_number():
                    divisor *= factor.value
                else:
                    below.append(factor)
        else:
            above.append(node)
    for node in list(below):
        if node in above:
            above.remove(node)
            below.remove(node)
    if number == 0:
        return graph.number(0.0)
    if divisor != 1:
        number, divisor = _in_lowest_terms(_decimal(number) / _decimal(divisor)) or (number, divisor)
    negative = number < 0 and bool(above or below or divisor != 1)
    result = _product(abs(number) if negative else number, above, graph)
    if below or divisor != 1:
        result = graph.quotient(result, _product(divisor, below, graph))
    return graph.negative(result) if negative else result


def constant_sum(terms: Sequence[tuple[int, Node]], graph: Graph) -> Node:
    """The sum of constants: the terms with parameters, then one number or quotient of numbers."""
    number, ratio = 0.0, Fraction(0)  # of the numbers, and of the quotients of numbers
    named: list[tuple[int, Node]] = []
    for sign, node in terms:
        if node.kind == "negative":
            sign, node = -sign, node.arguments[0]
        inside = zip(node.signs, node.arguments, strict=True) if node.kind == "sum" else [(1, node)]
        for s, t in ((sign * s, t) for s, t in inside):
            if t.is_number():
                number += s * t.value
            elif t.kind == "quotient" and all(a.is_number() for a in t.arguments):
                above, below = (_decimal(a.value) for a in t.arguments)
                ratio += s * above / below
            elif node.kind != "sum" and (-s, t) in named:
                named.remove((-s, t))
            else:
                named.append((s, t))
    divisor = 1.0
    if ratio:
        exact = _decimal(number) + ratio
        number, divisor = _in_lowest_terms(exact) or (float(exact), 1.0)
    if number or not named:
        size = graph.number(abs(number) if named else number)
        total = size if divisor == 1 else graph.quotient(size, graph.number(divisor))
        named.append((-1 if number < 0 and named else 1, total))
    named.sort(key=lambda term: -term[0])
    if named[0][0] < 0:
        return graph.negative(constant_sum([(1, node) for _, node in named], graph))
    return named[0][1] if len(named) == 1 else graph.sum(named)


def constant_reciprocal(node: Node, graph: Graph) -> Node:
    """1 / node."""
    if node.is_number() and node.value:
        above, below = _in_lowest_terms(1 / _decimal(node.value)) or (1.0, node.value)
        return graph.number(above) if below == 1 else graph.quotient(graph.number(above), graph.number(below))
    if node.kind == "negative":
        return graph.negative(constant_reciprocal(node.arguments[0], graph))
    if node.kind == "quotient":
        return constant_product([node.arguments[1], constant_reciprocal(node.arguments[0], graph)], graph)
    return graph.quotient(graph.number(1.0), node)


def _in_lowest_terms(value: Fraction) -> tuple[float, float] | None:
    """Numerator and denominator of an exact number, as doubles; the number and 1 if its decimal fits into a double.

    None if the numerator or the denominator exceeds ``LARGEST_INTEGER``.
    """
    if _decimal(float(value)) == value:
        return float(value), 1.0
    if max(abs(value.numerator), value.denominator) > LARGEST_INTEGER:
        return None
    return float(value.numerator), float(value.denominator)


def _decimal(value: float) -> Fraction:
    """The exact value of the decimal that the generated code has for a double. Raises OverflowError for infinity."""
    if not math.isfinite(value):
        raise OverflowError("a constant beyond the range of a double")
    return Fraction(repr(value))


def _product(number: float, factors: list[Node], graph: Graph) -> Node:
    """number · factors, without the number if it is 1."""
    nodes = sorted(factors, key=lambda f: f.index)
    if number != 1.0 or not nodes:
        nodes = [graph.number(number), *nodes]
    return nodes[0] if len(nodes) == 1 else graph.product(nodes)
