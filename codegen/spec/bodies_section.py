"""Sections ``topology`` and ``constraints``: bodies, forces on them, constraint equations, contacts between them."""

from collections.abc import Mapping, Sequence

import sympy

from codegen.base.errors import BadInput, Faults, refuse_unknown
from codegen.spec.dimensions import dimension_of
from codegen.spec.expression import NAME, Expression, parse_expression
from codegen.spec.model import symbol
from codegen.spec.motion import DIRECTIONS, GROUND, TRANSLATIONS, Body, Sliding, position_name, rate_name
from codegen.spec.motion_units import Units
from codegen.spec.schema import BodySection, SpecDocument

Symbols = Mapping[str, sympy.Symbol]


def read_bodies(
    key: str, sections: Mapping[str, BodySection], position: Symbols, units: Units, constant: Symbols
) -> tuple[Body, ...]:
    """The bodies of a section: mass and inertia over ``constant``, positions over ``position``."""
    if not sections:
        raise BadInput(units.place(f"{key}.bodies"), "no body", "at least one", code="SPEC003")
    for name in sections:
        if not NAME.match(name) or name == GROUND:
            found = f"the body `{name}`"
            expected = f"letters, digits and _, and not `{GROUND}`"
            raise BadInput(units.place(f"{key}.bodies.{name}"), found, expected, code="SPEC009")
    faults, bodies = Faults(), []
    for name, section in sections.items():
        with faults.noting():
            bodies.append(_body(f"{key}.bodies.{name}", name, section, position, units, constant))
    faults.raise_noted()
    return tuple(bodies)


def _body(key: str, name: str, section: BodySection, position: Symbols, units: Units, constant: Symbols) -> Body:
    positions, faults = {}, Faults()
    for direction in DIRECTIONS:
        text = getattr(section, direction)
        if text is None:
            continue
        of, what = units.of_direction(direction), f"position {direction} of {name}"
        positions[direction] = sympy.S.Zero
        with faults.noting():
            positions[direction] = units.read(text, f"{key}.{direction}", position, of, what)
    if not positions:
        expected = f"one or more of {', '.join(DIRECTIONS)}"
        raise BadInput(units.place(key), f"body {name} without a position", expected, code="SPEC003")
    translates = any(direction in TRANSLATIONS for direction in positions)
    weights = {}
    for quantity, needed, why in (("mass", translates, "x, y or z"), ("inertia", "angle" in positions, "an angle")):
        text = getattr(section, quantity)
        if (text is not None) != needed:
            there, absent = (why, quantity) if needed else (quantity, why)
            found = f"body {name} with {there} but without {absent}"
            expected = f"both {quantity} and {why}, or neither"
            raise BadInput(units.place(f"{key}.{quantity}"), found, expected, code="SPEC003")
        weights[quantity] = sympy.S.Zero
        if text is not None:
            of = units.kilogram * units.metre**2 if quantity == "inertia" else units.kilogram
            with faults.noting():
                weights[quantity] = units.read(text, f"{key}.{quantity}", constant, of, f"{quantity} of {name}")
    faults.raise_noted()
    return Body(name, weights["mass"], weights["inertia"], positions)


def read_body_forces(
    sections: Mapping[str, Mapping[str, str]], bodies: Sequence[Body], names: Symbols, units: Units
) -> dict[tuple[str, str], sympy.Expr]:
    """(body, direction) → force or torque on it, g_x of (A.54)."""
    known = {b.name: b for b in bodies}
    symbols = dict(names) | _body_symbols(bodies, names, units)
    dimensions = units.with_bodies(bodies)
    result, faults = {}, Faults()
    for name, parts in sections.items():
        key = f"constraints.force.{name}"
        _require(name, list(known), "body", key, units)
        for direction, text in parts.items():
            with faults.noting():
                _require(direction, list(known[name].positions), f"direction of {name}", f"{key}.{direction}", units)
                expression = parse_expression(text, units.place(f"{key}.{direction}"))
                result[name, direction] = expression.symbolic(symbols)
                wanted = units.energy / units.of_direction(direction)
                units.check(expression, wanted, f"force on {name}", dimensions)
    faults.raise_noted()
    return result


def read_equations(
    texts: Sequence[str], bodies: Sequence[Body], constant: Symbols, units: Units
) -> tuple[sympy.Expr, ...]:
    """Left sides ψ(x) of the constraint equations (A.47), over the positions of the bodies."""
    symbols = dict(constant) | {
        position_name(b.name, direction): symbol(position_name(b.name, direction))
        for b in bodies
        for direction in b.positions
    }
    dimensions, result = units.with_bodies(bodies), []
    for k, text in enumerate(texts):
        expression = parse_expression(text, units.place(f"constraints.equations[{k}]"))
        value = expression.symbolic(symbols)
        dimension_of(expression, dimensions)  # refuses terms of different dimensions
        if not value.free_symbols - set(constant.values()):
            found = f"`{text}`, which contains no position"
            expected = f"an expression over {', '.join(set(symbols) - set(constant))}"
            raise BadInput(expression.place, found, expected, code="SPEC011")
        result.append(value)
    return tuple(result)


def _body_symbols(bodies: Sequence[Body], names: Symbols, units: Units) -> dict[str, sympy.Symbol]:
    """Name → symbol of the positions and velocities of bodies; BadInput if a name is in use."""
    result = {}
    for body in bodies:
        for direction in body.positions:
            for name in (position_name(body.name, direction), rate_name(body.name, direction)):
                if name in names or name in result:
                    found = f"the name `{name}` is declared, but stands for the motion of body {body.name}"
                    expected = "another name for one of them"
                    raise BadInput(units.place(f"constraints.bodies.{body.name}"), found, expected, code="SPEC009")
                result[name] = symbol(name)
    return result


def read_sliding(
    document: SpecDocument, form: str, bodies: Sequence[Body], index: int, names: Symbols, units: Units
) -> Sliding | None:
    """The bodies and direction of contact ``index``; None if ``distribution`` gives them."""
    section, key = document.friction.contacts[index], f"friction.contacts[{index}]"
    if section.bodies is None:
        if document.friction.distribution is None or section.along is not None:
            expected = f"`bodies:`, one or two of {', '.join(b.name for b in bodies)} and {GROUND}"
            raise BadInput(units.place(key), f"contact {section.name} without `bodies`", expected, code="SPEC003")
        return None
    known = {b.name: b for b in bodies}
    for k, name in enumerate(section.bodies):
        _require(name, [*known, GROUND], "body", f"{key}.bodies[{k}]", units)
    moving = [known[name] for name in section.bodies if name != GROUND]
    if not 1 <= len(section.bodies) <= 2 or not moving or len(set(section.bodies)) != len(section.bodies):
        found = f"contact {section.name} between {' and '.join(section.bodies) or 'no bodies'}"
        raise BadInput(units.place(f"{key}.bodies"), found, f"two bodies, or one and {GROUND}", code="SPEC015")
    common = [direction for direction in DIRECTIONS if all(direction in b.positions for b in moving)]
    along = _along(section.along, common, key, f"{form}.bodies", units)
    pair = (section.bodies[0], section.bodies[1]) if len(section.bodies) == 2 else (section.bodies[0], GROUND)
    slip = units.slip(along)
    if slip is not None:
        units.check_contact(index, slip)
    return Sliding(pair, {direction: part.symbolic(names) for direction, part in along.items()})


def _along(
    given: Mapping[str, str] | None, common: list[str], key: str, where: str, units: Units
) -> dict[str, Expression]:
    if not common:
        found = "two bodies that share no direction"
        wanted = f"bodies that both have x, y, z or an angle in {where}"
        raise BadInput(units.place(f"{key}.bodies"), found, wanted, code="SPEC020")
    if given is None:
        if len(common) > 1:
            expected = f"`along:` with one of {', '.join(common)}"
            words = f"a contact that could slide along {' or '.join(common)}"
            raise BadInput(units.place(key), words, expected, code="SPEC003")
        given = {common[0]: "1"}
    if not given:
        raise BadInput(units.place(f"{key}.along"), "no direction", f"one of {', '.join(common)}", code="SPEC003")
    for direction in given:
        _require(direction, common, "direction of these bodies", f"{key}.along", units)
    return {d: parse_expression(text, units.place(f"{key}.along")) for d, text in given.items()}


def _require(name: str, known: Sequence[str], what: str, key: str, units: Units) -> None:
    refuse_unknown(name, known, units.place(key), f"unknown {what}", code="SPEC008")
