"""Specs with damage that knows what a spec is made of: all through ``check``, few that it takes through other verbs.

``check`` reads a spec, derives the observer, and lowers its code; five mutants of six end there with an error. Of those
that are specs still, and of less than 1200 characters, DEEPER says how many go on to which verb, 6 of 100 in all: one
``certify`` takes as long as hundreds of mutants. The campaign's summary counts how many came how far.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from functools import cache
from pathlib import Path

from codegen.app import verbs
from codegen.effects import CATALOGUE
from codegen.friction import LAWS
from codegen.observers import OBSERVERS
from codegen.observers.velocity import INTEGRATIONS

from .case import Case, Stage
from .hostile import EXPRESSIONS, NAMES, NUMBERS, TEXTS, UNITS
from .tree import Mapping, Node, Raw, at, copied, parse, places, put, written
from .verdict import through_main

SPECS = Path(__file__).parents[2] / "specs"
FILE = "s.yaml"
SMALL = {
    "one_mass": 24,
    "two_mass": 6,
    "emps": 6,
    "rig": 8,
    "belt_axis": 6,
    "one_mass_domain": 10,
    "plants/belt_axis": 6,
    "two_link_arm": 1,
    "thesis/rig_dfoa": 6,
    "thesis/rig_to": 6,
    "thesis/one_mass_dfo": 8,
    "thesis/two_mass_gto": 4,
    "thesis/two_mass_cancellation": 2,
    "thesis/two_mass_gdfo": 2,
    "thesis/one_mass_dfo_implicit": 2,
    "chain": 1,
}
"""Shipped spec → how often it is the one that is damaged, beside the others."""

TWO_BODIES = """\
name: two_bodies
coordinates: {x1: {velocity: v1, unit: m}, x2: {velocity: v2, unit: m}}
inputs: {w: {unit: N}}
parameters: {m1: {value: 10, unit: kg}, m2: {value: 50, unit: kg, tolerance: 1%}, k: {value: 20, unit: N/m}}
topology: {bodies: {top: {mass: m1, x: x1}, bottom: {mass: m2, x: x2}}}
force: ["-k*x1 + k*x2", "k*x1 - k*x2 + w"]
friction:
  contacts:
    - {name: between, bodies: [top, bottom], law: coulomb, a: 10, unit: N}
    - {name: ground, bodies: [bottom, ground], law: coulomb, a: 20, unit: N}
effects: [{kind: viscous, on: ground, parameters: {b: 2}}]
observer: {kind: gcfo, velocity: estimated, gains: {K_F: [500, {free: [1, 100]}], K_v: 10}, sample_time: 0.001}
code: {precision: single, fault: none}
log: {columns: {x1: q1}, scale: {x1: 0.001}, cutoff_hz: 40}
"""
BAR = """\
name: bar
coordinates: {theta: {velocity: om, unit: rad}}
inputs: {w: {unit: N*m}}
parameters:
  m: {value: 2, unit: lb}
  J: {value: 1, unit: kg*m^2}
  l: {value: 3, unit: inch}
  grav: {value: 9.8, unit: m/s^2}
constraints:
  bodies: {rod: {mass: m, inertia: J, x: l*cos(theta), y: l*sin(theta), angle: theta}}
  force: {rod: {y: -m*grav}}
force: [w]
friction: {contacts: [{name: pin, bodies: rod, along: angle, law: coulomb, a: 1, unit: N*m}]}
observer: {kind: cfo, velocity: estimated, gains: {K_F: 10, K_v: 99}, sample_time: 0.001, integration: semi_implicit}
envelope: {theta: [-1, 1], om: [-2, 2]}
"""
SHORT = """\
name: brief
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 1, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction: {distribution: [[1]], contacts: [{name: rail, law: coulomb, a: 50, unit: N}]}
"""
SHORT_CFO = SHORT + "observer: {kind: cfo, velocity: estimated, gains: {K_F: 10, K_v: 100}, sample_time: 1 ms}\n"
SHORT_TO = SHORT + "observer: {kind: to, velocity: measured, gains: {K_1: 10, K_2: -5}, sample_time: 0.001}\n"
SHORT_DFO = SHORT.replace("law: coulomb, a: 50", "law: dahl, a: 50, c: 100") + (
    "observer: {kind: dfo, velocity: measured, gains: {K_a: 10, K_f1: 10, K_f2: 10}, sample_time: 0.001}\n"
)
SHORT_LAGRANGIAN = """\
name: brief
coordinates: {q: {velocity: p, unit: rad}}
inputs: {w: {unit: N*m}}
parameters: {J: {value: 2, unit: kg*m^2}, c: {value: 9, unit: N*m}}
lagrangian: {kinetic: J*p**2/2, potential: -c*cos(q)}
force: [w]
friction: {distribution: [[1]], contacts: [{name: pin, law: coulomb, a: 1, unit: N*m}]}
effects: [{kind: viscous, on: pin, parameters: {b: 2}}]
envelope: {q: [-1, 1], p: [-2, 2]}
"""
OWN = {
    "two bodies": (TWO_BODIES, 8),
    "bar": (BAR, 8),
    "cfo": (SHORT_CFO, 40),
    "to": (SHORT_TO, 20),
    "dfo": (SHORT_DFO, 20),
    "lagrangian": (SHORT_LAGRANGIAN, 20),
}
"""Most are short, since reading YAML takes longer than anything else that becomes of a mutant."""


@cache
def seeds() -> tuple[tuple[Node, str, int], ...]:
    """Tree, text and weight of every spec that is damaged."""
    texts = [((SPECS / f"{name}.yaml").read_text("utf-8"), weight) for name, weight in SMALL.items()]
    return tuple((parse(text), text, weight) for text, weight in (*texts, *OWN.values()))


@cache
def sections() -> dict[str, list[Node]]:
    """Key → what specs hold under it, wherever it stands; of the shipped ones, of figures too."""
    found: dict[str, list[Node]] = {}
    trees = [
        parse(path.read_text("utf-8")) for path in sorted(SPECS.rglob("*.yaml")) if SPECS / "data" not in path.parents
    ]
    for tree in (*trees, *(tree for tree, _, _ in seeds())):
        for path in places(tree):
            node = at(tree, path)
            for key, value in node.pairs if isinstance(node, Mapping) else []:
                found.setdefault(key, []).append(value)
    return found


def spec(seed: int) -> Case:
    """The damaged spec of that number, and the stages that it goes through."""
    dice = random.Random(f"spec {seed}")
    trees = seeds()
    tree, text, _ = dice.choices(trees, [weight for _, _, weight in trees])[0]
    if dice.random() < 0.2:
        return staged(damaged_text(text, dice), dice)
    tree = copied(tree)
    for _ in range(dice.choice([1, 1, 1, 1, 2, 2, 3])):
        tree = dice.choices(list(EDITS), list(EDITS.values()))[0](tree, dice)
    text = written(tree, dice)
    if dice.random() < 0.05:
        text = damaged_text(text, dice)
    return staged(text, dice)


DEEPER = {
    ("derive",): 20,
    ("cancel",): 12,
    ("gains",): 4,
    ("certify",): 4,
    ("generate", "-o", "out", "--uncertified"): 12,
    ("simulate", "-o", "log.csv"): 8,
}
"""The other verbs with their options → how often of a thousand specs that ``check`` takes, and that are small."""


def staged(text: str, dice: random.Random) -> Case:
    """``check`` for all, and another verb for a share of those that it takes."""
    stages = [check_stage(whole=dice.random() < 0.1)]
    left = 1000 - sum(DEEPER.values())
    verb = dice.choices([(), *DEEPER], [left, *DEEPER.values()])[0]
    if verb and len(text) < 1200:
        stages.append(verb_stage(verb))
    return Case({FILE: text.encode("utf-8", "surrogatepass")}, tuple(stages))


def verb_stage(verb: tuple[str, ...]) -> Stage:
    """A verb with its options."""
    return Stage(verb[0], through_main(verb[0], FILE, *verb[1:]), None, 300)


def check_stage(whole: bool = False, file: str = FILE) -> Stage:
    """``check`` as a function, as ``whole`` through the command's frame, which takes 30 ms more."""
    border = through_main("check", file)
    return Stage("check", border if whole else lambda: verbs.check(Path(file)), border)


# ---- edits of the tree: each gives the tree back, or another -------------------------------------------------------


def mappings(tree: Node) -> list[tuple[int, ...]]:
    return [path for path in places(tree) if isinstance(at(tree, path), Mapping) and at(tree, path).pairs]


def scalars(tree: Node) -> list[tuple[int, ...]]:
    return [path for path in places(tree) if isinstance(at(tree, path), str)]


def under(tree: Node, *keys: str) -> list[tuple[int, ...]]:
    """Paths of scalars below one of these keys."""
    found = []
    for path in scalars(tree):
        holders = [at(tree, path[:k]) for k in range(len(path))]
        names = {h.pairs[k][0] for h, k in zip(holders, path, strict=True) if isinstance(h, Mapping)}
        if names & set(keys):
            found.append(path)
    return found


def _any(paths: list[tuple[int, ...]], dice: random.Random) -> tuple[int, ...]:
    return dice.choice(paths) if paths else ()


def drop(tree: Node, dice: random.Random) -> Node:
    path = dice.choice(places(tree))
    if path:
        holder = at(tree, path[:-1])
        del (holder.pairs if isinstance(holder, Mapping) else holder)[path[-1]]
    return tree


def double(tree: Node, dice: random.Random) -> Node:
    path = dice.choice(places(tree))
    if path:
        holder = at(tree, path[:-1])
        items = holder.pairs if isinstance(holder, Mapping) else holder
        items.insert(dice.randrange(len(items) + 1), copied_pair(items[path[-1]]))
    return tree


def copied_pair(item: object) -> object:
    return (item[0], copied(item[1])) if isinstance(item, tuple) else copied(item)


def swap(tree: Node, dice: random.Random) -> Node:
    one, other = dice.choice(places(tree)), dice.choice(places(tree))
    if one and other and one[: len(other)] != other and other[: len(one)] != one:
        first, second = copied(at(tree, one)), copied(at(tree, other))
        put(tree, one, second)
        put(tree, other, first)
    return tree


def retype(tree: Node, dice: random.Random) -> Node:
    path = dice.choice(places(tree))
    old = copied(at(tree, path))
    texts = [
        *("null", "true", "~", "[]", "{}", "0", "''", "[[]]", "[null]", "{null: null}", "!!str 1", "!!int x"),
        *("!!binary aGk=",),
    ]
    texts += [
        "!!python/object/apply:os.system [id]",
        "!x y",
        "!!set {a, b}",
        "!!omap [a: 1]",
        "!!timestamp 2001-01-01",
        "!!float '1'",
    ]
    texts += [
        *("!!null ''", "!!bool x", "!!merge x", "!!pairs [a: 1, a: 2]", "2001-12-14t21:59:43.10-05:00"),
        *("? a", "- a", "|", ">", "&a"),
    ]
    new = dice.choice([[old], Mapping([("a", old)]), Mapping([("free", old)]), [old, old], *map(Raw, texts)])
    return put(tree, path, new)


def number(tree: Node, dice: random.Random) -> Node:
    chosen = [path for path in scalars(tree) if at(tree, path)[:1] in "-+.0123456789"]
    path = _any(chosen, dice)
    return put(tree, path, Raw(dice.choice(NUMBERS))) if path else tree


def scaled(tree: Node, dice: random.Random) -> Node:
    """A number times a power of ten: the kind of damage that stays a spec."""
    chosen = [path for path in scalars(tree) if at(tree, path)[:1] in "-.0123456789"]
    path = _any(chosen, dice)
    try:
        factor = 10.0 ** dice.choice([-300, -30, -9, -3, -1, 1, 3, 9, 30, 300])
        value = float(at(tree, path)) * factor * dice.choice([1, 1, -1])
    except (TypeError, ValueError, OverflowError):
        return tree
    return put(tree, path, repr(value))


def expression(tree: Node, dice: random.Random) -> Node:
    keys = ("force", "mass_matrix", "kinetic", "potential", "reference", "inputs", "distribution", "h", "bodies")
    path = _any(under(tree, *keys, "equations", "transform", "along"), dice)
    if not path:
        return tree
    old, new = at(tree, path), dice.choice(EXPRESSIONS)
    return put(tree, path, dice.choice([new, f"{old} + {new}", f"({old})*({new})", f"({new})/({old})"]))


def formula(tree: Node, dice: random.Random) -> Node:
    """A well-formed expression over names of the spec, or one that is there with a part of it changed."""
    path = _any(under(tree, "force", "mass_matrix", "kinetic", "potential", "reference", "inputs"), dice)
    if not path:
        return tree
    names = [key for where in mappings(tree) for key, _ in at(tree, where).pairs if key.isidentifier() and len(key) < 5]

    def made(depth: int) -> str:
        if depth == 0 or dice.random() < 0.25:
            return dice.choice([*names, "v", "x", "1", "2", "0.5", "1e-3", "1e9", "pi"])
        kind = dice.randrange(4)
        if kind == 0:
            return (
                f"{dice.choice(['sin', 'cos', 'exp', 'tanh', 'sqrt', 'abs', 'sgn', 'log', 'tan'])}({made(depth - 1)})"
            )
        if kind == 1:
            return f"({made(depth - 1)})**{dice.choice(['2', '3', '-1', '0.5', '-2', '7', '1/3'])}"
        return f"({made(depth - 1)} {dice.choice('+-*/')} {made(depth - 1)})"

    return put(tree, path, f"{at(tree, path)} + {made(dice.randint(1, 3))}")


ALIKE = (
    *(("kg", "g", "lb", "t", "oz", "u", "slug"), ("m", "mm", "inch", "ft", "km", "nm", "lightyear")),
    *(("N", "kN", "lbf", "kgf", "mN", "dyn"), ("N*m", "mN*m", "oz*in*g_0", "kgf*cm", "lbf*ft", "lbf*inch")),
    *(("N/m", "N/mm", "lbf/inch", "kN/m", "kgf/mm"), ("kg*m^2", "g*cm^2", "lb*ft^2", "kg*mm^2")),
    *(("rad", "deg", "arcmin", "turn", "mrad"), ("s", "ms", "min", "h", "us")),
    *(("N*s/m", "N*s/mm", "lbf*s/inch"), ("m/s^2", "ft/s^2", "mm/s^2", "g_0")),
)


def other_unit(tree: Node, dice: random.Random) -> Node:
    """Another unit of the same dimension."""
    found = [(path, group) for path in under(tree, "unit") for group in ALIKE if at(tree, path) in group]
    if found:
        path, group = dice.choice(found)
        put(tree, path, dice.choice(group))
    return tree


def name(tree: Node, dice: random.Random) -> Node:
    """A key or a name anew, at one place or at all of them."""
    path = _any(mappings(tree), dice)
    holder, new = at(tree, path), dice.choice(NAMES)
    k = dice.randrange(len(holder.pairs)) if isinstance(holder, Mapping) and holder.pairs else -1
    if k < 0:
        return tree
    old = holder.pairs[k][0]
    holder.pairs[k] = (new, holder.pairs[k][1])
    if dice.random() < 0.5:
        for place in scalars(tree):
            put(tree, place, at(tree, place).replace(old, new))
    return tree


def word(tree: Node, dice: random.Random) -> Node:
    path = _any(scalars(tree), dice)
    return put(tree, path, dice.choice([*NAMES, *TEXTS])) if path else tree


def unit(tree: Node, dice: random.Random) -> Node:
    path = _any(under(tree, "unit"), dice)
    return put(tree, path, dice.choice(UNITS)) if path else tree


def effect(tree: Node, dice: random.Random) -> Node:
    kind = dice.choice(list(CATALOGUE))
    parameters = Mapping([(p.name, dice.choice(["1", "0.1", *NUMBERS])) for p in CATALOGUE[kind].parameters])
    where = dice.choice(["x", "x1", "rail", "ground", "w", "guide", "theta", "[x1, x2]", "v", "u"])
    entry = Mapping([("kind", kind), ("on", Raw(where)), ("parameters", parameters)])
    return _set(tree, "effects", [entry] * dice.choice([1, 1, 2, 3]))


def law(tree: Node, dice: random.Random) -> Node:
    found = [path for path in mappings(tree) if "law" in dict(at(tree, path).pairs)]
    path = _any(found, dice)
    if path:
        chosen = LAWS[dice.choice(list(LAWS))]
        kept = [(k, v) for k, v in at(tree, path).pairs if k in ("name", "unit", "bodies", "along")]
        numbers = [(p.name, dice.choice(["1", "0.1", "10", dice.choice(NUMBERS)])) for p in chosen.parameters]
        put(tree, path, Mapping([*kept, ("law", chosen.name), *numbers]))
    return tree


def transplant(tree: Node, dice: random.Random) -> Node:
    """What another spec has under a key of this one, or a section that this one lacks."""
    known = sections()
    if dice.random() < 0.4:
        top = dice.choice(
            ["simulation", "cancellation", "envelope", "observer", "friction", "effects", "lagrangian", "urdf", "log"]
        )
        return _set(tree, top, copied(dice.choice(known.get(top, ["null"]))))
    path = _any(mappings(tree), dice)
    holder = at(tree, path)
    if isinstance(holder, Mapping) and holder.pairs:
        k = dice.randrange(len(holder.pairs))
        key = holder.pairs[k][0]
        holder.pairs[k] = (key, copied(dice.choice(known.get(key, ["null"]))))
    return tree


DOMAINS = ("{slip_speed: 1, settle: 0.3}", "{slip_speed: 0, settle: -1}", "{}", "{innovation: 1e-9}")


def observer(tree: Node, dice: random.Random) -> Node:
    """Another kind of observer with its gains."""
    kind = dice.choice(list(OBSERVERS))
    texts = [
        *("1", "-1", "10", "-100", "1e-300", "1e300", "[1, 2]", "[[1, 0], [0, 1]]", "{free: [1, 100]}", "[]"),
        *(".nan", "0", "x"),
    ]
    texts += [
        "{free: [-5, -1]}",
        "{free: []}",
        "{free: [1, .inf]}",
        "{free: [5, 1]}",
        "[[1, 2], [3]]",
        "[{free: [1, 2]}, 3]",
        "1e-9",
    ]
    gains = Mapping([(gain, Raw(dice.choice(texts))) for gain in OBSERVERS[kind].gains if dice.random() < 0.95])
    choices = [
        ("kind", kind),
        ("velocity", dice.choice(["measured", "estimated"])),
        ("gains", gains),
        ("sample_time", Raw(dice.choice(["0.001", "0.01", "1", *NUMBERS]))),
        ("integration", dice.choice(list(INTEGRATIONS))),
        ("exponent", dice.choice(["0", "1", "0.5", "2", "-1", "1e9"])),
        ("h", dice.choice(["s", "s + 0.1*s**2", "-s", "1", "s**0.5", "log(s)", "1/s", *EXPRESSIONS])),
        ("domain", Raw(dice.choice(DOMAINS))),
    ]
    return _set(tree, "observer", Mapping([c for k, c in enumerate(choices) if k < 4 or dice.random() < 0.15]))


def odd_yaml(tree: Node, dice: random.Random) -> Node:
    """What YAML can do beside what a spec needs."""
    depth = dice.choice([3, 12, 60, 300])
    aliases = "[" + ", ".join(["*a"] * depth) + "]"
    bomb = "".join(f", &b{k} [{', '.join([f'*b{k - 1}'] * 9)}]" for k in range(1, 1 + min(depth, 12)))
    keys = "".join(f"{{&k{k} x{k}: *k{k - 1}}}, " for k in range(1, 9))
    choices = [
        "[" * depth + "]" * depth,
        "{a: " * depth + "1" + "}" * depth,
        "{" * depth + "a" + "}" * depth,
        "? " * depth + "a",
        "[? [a] : b]",
        "{? {a: b} : c, ? [d] : e}",
        "{[a, b]: c}",
        "&a [1, 2]",
        "&a [*a]",
        "&a {x: *a}",
        "{a: &a 1, b: " + aliases + "}",
        "[&b0 [1, 1]" + bomb + "]",
        f"[&k0 1, {keys} *k8]",
        *("{&a a: 1, *a : 2}", "{<<: {a: 1}, a: 2}", "{<<: [{a: 1}, {a: 2}]}", "{<<: 1}", "*undefined"),
        *("|\n  text\n  more", ">-\n  folded", "'it''s'", '"\\u0000"', '"\\x07"', '"\\ud800"'),
        *('"\\U0001F980"', "!<tag:yaml.org,2002:str> x", "!!python/name:os.system", "%YAML 1.1", "--- a"),
        *("...", "@a", "`a", "a: b: c", "- - - a", "[a, b", "{a: 1, a: 1}"),
        *("{1: 2, 1.0: 3, true: 4, null: 5}", "{.nan: 1, .nan: 2}", "{? |\n  long\n : 1}", "x1..9999999"),
        *("x1..99999", "{x1..3: a1..4}", "{x3..1: 1}", "[x1..1, 1..2]"),
    ]
    if dice.random() < 0.3 and isinstance(tree, Mapping):
        pair = (dice.choice(["extra", "<<", "name"]), Raw(dice.choice(choices)))
        tree.pairs.insert(dice.randrange(len(tree.pairs) + 1), pair)
        return tree
    return put(tree, dice.choice(places(tree)), Raw(dice.choice(choices)))


def _set(tree: Node, key: str, value: Node) -> Node:
    if isinstance(tree, Mapping):
        tree.pairs = [pair for pair in tree.pairs if pair[0] != key] + [(key, value)]
    return tree


EDITS: dict[Callable[[Node, random.Random], Node], int] = {
    drop: 2,
    double: 1,
    swap: 2,
    retype: 2,
    number: 4,
    scaled: 14,
    expression: 4,
    formula: 8,
    name: 3,
    word: 1,
    unit: 2,
    other_unit: 4,
    effect: 4,
    law: 5,
    transplant: 4,
    observer: 5,
    odd_yaml: 2,
}

# ---- damage to the text -------------------------------------------------------------------------------------------

PIECES = (
    *"{}[],:-*/+()'\"\n #&!%@0123456789.eE\t\x00é",
    *(
        *("null", "true", "1e999", "-1", "0", "sin(", "x1", "v2", "**", "1/0", ": ", "- ", "[[", "]]", "&a"),
        *("*a", "viscous", "cfo"),
    ),
    *(
        *("!!python/object:os.x {}", "mgto", "measured", "kg", "m", "\ufeff", "\r", "\x85", "\u2028", "? "),
        *("<<: ", "---\n", "..", "%"),
    ),
)


def damaged_text(text: str, dice: random.Random) -> str:
    """One to three characters or lines deleted, replaced, doubled or put in."""
    for _ in range(dice.randint(1, 3)):
        lines = text.splitlines(keepends=True)
        if not lines:
            return text
        spot, line, piece = dice.randrange(len(text)), dice.randrange(len(lines)), dice.choice(PIECES)
        match dice.randrange(7):
            case 0:
                text = text[:spot] + text[spot + dice.randint(1, 8) :]
            case 1:
                text = text[:spot] + piece + text[spot:]
            case 2:
                text = text[:spot] + piece + text[spot + 1 :]
            case 3:
                text = "".join(lines[:line] + lines[line + 1 :])
            case 4:
                text = "".join(lines[:line] + [lines[line]] * 2 + lines[line + 1 :])
            case 5:
                other = dice.randrange(len(lines))
                lines[line], lines[other] = lines[other], lines[line]
                text = "".join(lines)
            case _:
                text = text[:spot]
    return text
