"""Declared effects: each entry of a spec's ``effects:`` is checked against the catalogue and added to the System."""

from collections.abc import Collection, Iterator
from dataclasses import astuple
from typing import Any

import sympy

from codegen.base.errors import BadInput, Faults, Place, nearest_name, refuse_unknown
from codegen.effects import CATALOGUE, Effect
from codegen.effects.effect import Symbols
from codegen.effects.places import pairs
from codegen.friction import DynamicLaw
from codegen.mechanics.build import build_system, check_mass_matrix
from codegen.mechanics.contacts import build_contacts
from codegen.mechanics.motion import equation_of_motion
from codegen.mechanics.system import ContactFriction, System
from codegen.spec.model import DeclaredEffect, Spec, symbol
from codegen.spec.numerics import numerical
from codegen.spec.quantity import refuse_other_unit

FAR_VALUE = 1e9
"""Parameter value so large that a condition such as |d| ≤ friction level is violated, if there is one."""


def places_of(effect: Effect, system: System) -> list[str]:
    """Names of the contacts, coordinates, inputs or pairs of coordinates (`x1, x2`) for an effect of this kind."""
    match effect.sits_on:
        case "contact":
            return [c.name for c in system.contacts]
        case "coordinate" | "axis" | "sensor":
            return [x.name for x in system.positions]
        case "two coordinates":
            return [f"{system.positions[i]}, {system.positions[j]}" for i, j in pairs(system)]
        case "input":
            return [w.name for w in system.inputs]


def written_place(on: str) -> str | list[str]:
    """A name of ``places_of`` in the form of a spec or a JSON file, where two coordinates are a list."""
    names = on.split(", ")
    return names if len(names) > 1 else on


@numerical("the model with the declared effects")
def system_of(spec: Spec) -> System:
    """The system of a spec with its declared effects; BadInput as ``build_system`` and ``add_declared_effects``."""
    faults = Faults()
    with faults.noting():
        _refuse_unknown_kinds(spec)
    with faults.noting():
        system = build_system(spec)
    faults.raise_noted()
    return add_declared_effects(system, spec)


def refuse_unknown_forces(spec: Spec) -> None:
    """Raise BadInput for laws of contacts, as ``build_contacts``, and for unknown kinds of effects."""
    faults = Faults()
    with faults.noting():
        build_contacts(spec, equation_of_motion(spec)[2])
    with faults.noting():
        _refuse_unknown_kinds(spec)
    faults.raise_noted()


def add_declared_effects(system: System, spec: Spec) -> System:
    """The system with every effect that the spec declares.

    Raises BadInput for an unknown kind or place, or a parameter that is missing, unknown or out of range.
    """
    _refuse_unknown_kinds(spec)
    faults = Faults()
    for index, declared in enumerate(spec.effects):
        with faults.noting():
            system = _add(system, spec, index, declared)
    faults.raise_noted()
    if spec.effects:
        check_mass_matrix(system, spec)
    return system


def _refuse_unknown_kinds(spec: Spec) -> None:
    """Raise BadInput for declared effects of unknown kind, all of them together."""
    faults = Faults()
    for index, declared in enumerate(spec.effects):
        with faults.noting():
            place = spec.place(f"effects[{index}].kind")
            refuse_unknown(declared.kind, CATALOGUE, place, "unknown effect", code="SPEC008")
    faults.raise_noted()


def effect_symbols(effect: Effect, on: str, system: System) -> dict[str, sympy.Symbol]:
    """Parameter → its symbol kind_place_parameter; with a number for a second effect of the kind at the place."""
    return _symbols(effect, on, {s.name for s in system.values})


def _symbols(effect: Effect, on: str, taken: Collection[str]) -> dict[str, sympy.Symbol]:
    """The symbols of ``effect_symbols``, with names that are not in ``taken``."""
    head, suffix, count = f"{effect.kind}_{on.replace(', ', '_')}", "", 1
    while any(f"{head}{suffix}_{p.name}" in taken for p in effect.parameters):
        count += 1
        suffix = f"_{count}"
    return {p.name: symbol(f"{head}{suffix}_{p.name}") for p in effect.parameters}


def effect_deviations(system: System, spec: Spec) -> dict[sympy.Symbol, float]:
    """Standard deviations, in SI, of the parameters of the declared effects of ``system`` that have a tolerance."""
    found: dict[sympy.Symbol, float] = {}
    for declared, symbols in zip(spec.effects, declared_symbols(system, spec), strict=True):
        if declared.tolerance:
            found |= {s: declared.tolerance * abs(float(system.values[s])) for s in symbols.values()}
    return found


def declared_symbols(system: System, spec: Spec) -> list[dict[str, sympy.Symbol]]:
    """The parameter symbols of each declared effect of a system, as ``add_declared_effects`` named them."""
    taken = {p.name for p in spec.parameters}
    taken |= {s.name for c in system.contacts for s in c.law_parameters.values()}
    found = []
    for declared in spec.effects:
        effect = CATALOGUE[declared.kind].with_parameters(list(declared.parameters))
        symbols = _symbols(effect, _written(effect, declared, system), taken)
        taken |= {s.name for s in symbols.values()}
        found.append(symbols)
    return found


def unit_words(effect: Effect, place: int, system: System) -> dict[str, str]:
    """The unit of each parameter of an effect at a place."""
    match effect.sits_on:
        case "contact":
            words = {"F": system.contacts[place].unit, "q": system.contacts[place].slip_unit, "w": "1"}
        case "input":
            words = {"F": "1", "q": "1", "w": system.input_units[place]}
        case _:
            i = effect.coordinate(system, place)
            words = {"F": system.force_unit(i), "q": system.position_units[i], "w": "1"}
    return {p.name: p.unit.format(**words) for p in effect.parameters}


def _add(system: System, spec: Spec, index: int, declared: DeclaredEffect) -> System:
    """The system with one declared effect; raises BadInput as ``add_declared_effects``."""
    key = f"effects[{index}]"
    if declared in spec.effects[:index]:
        found = f"the same {declared.kind} on {', '.join(declared.on)} twice"
        expected = "each effect once; a second one of its kind has other parameters"
        raise BadInput(spec.place(key), found, expected, code="SPEC021")
    effect = CATALOGUE[declared.kind].with_parameters(list(declared.parameters))
    on = _place(effect, declared, system, spec, key)
    place = places_of(effect, system).index(on)
    symbols = effect_symbols(effect, on, system)
    given = _checked(effect, declared, spec, key)
    if effect.demands and not effect.admissible(system, place, {p: float(v) for p, v in given.items()}):
        found = ", ".join(f"{p} = {float(v):g}" for p, v in given.items())
        raise BadInput(spec.place(f"{key}.parameters"), found, effect.demands, code="SPEC021")
    values = {symbols[p]: v for p, v in given.items()}
    units = unit_words(effect, place, system)
    for name, unit in declared.units.items():
        refuse_other_unit(unit, units[name], f"{name} in `{unit}`", spec.place(f"{key}.parameters.{name}"))
    numbers = {p.name: _exponent(given[p.name]) for p in effect.parameters if p.as_number}
    with_all = system.with_parameters(values, {symbols[name]: unit for name, unit in units.items()})
    richer = added(effect, with_all, place, symbols, spec.place(key))
    if declared.tolerance is not None:
        _refuse_tolerance(effect, declared, richer, place, symbols, spec.place(f"{key}.tolerance"))
    if not numbers:
        return richer
    kept = {name: s for name, s in symbols.items() if name not in numbers}
    system = system.with_parameters({s: values[s] for s in kept.values()}, {s: units[n] for n, s in kept.items()})
    return effect.add(system, place, {**kept, **numbers})


def _exponent(value: Any) -> sympy.Number:
    """An exponent as a SymPy number: an integer as it is, any other as a float.

    With a rational exponent, which is a root of high degree, SymPy's polynomial routines do not end in useful time.
    """
    exact = sympy.Rational(value)
    return sympy.Number(exact) if exact.is_Integer else sympy.Float(exact)


def _place(effect: Effect, declared: DeclaredEffect, system: System, spec: Spec, key: str) -> str:
    """The place named by an entry of ``effects:``, as ``places_of`` writes it."""
    known = places_of(effect, system)
    written = ", ".join(declared.on)
    on = _written(effect, declared, system)
    if not on:
        article = "" if effect.sits_on == "two coordinates" else "one "
        names = " or ".join(f"[{k}]" if "," in k else k for k in known) or "there is none"
        expected, nearest = f"{article}{effect.sits_on}: {names}", nearest_name(written, known)
        raise BadInput(spec.place(f"{key}.on"), f"{declared.kind} on `{written}`", expected, nearest, code="SPEC008")
    if not effect.applies(system, known.index(on)):
        raise BadInput(spec.place(f"{key}.on"), f"{declared.kind} on `{written}`", effect.needs, code="SPEC021")
    return on


def _written(effect: Effect, declared: DeclaredEffect, system: System) -> str:
    """The declared place as ``places_of`` writes it; "" where there is no such place."""
    same = (name for name in places_of(effect, system) if sorted(name.split(", ")) == sorted(declared.on))
    return next(same, "")


def _refuse_tolerance(
    effect: Effect, declared: DeclaredEffect, system: System, place: int, symbols: Symbols, where: Place
) -> None:
    """Raise BadInput where an effect cannot have a tolerance, which lets a refit change its parameters.

    A refit is a linear fit to the force balance, in which a value keeps its sign if its tolerance is below 100 %, and
    has no other limit. So the parameters must all occur in the force balance, and must have no limits that such a
    value can pass: the refitted value could be one that a spec must not have.
    """
    limited = [p.name for p in effect.parameters if p.low is not None or p.high is not None]
    if limited:
        expected = f"no tolerance for {effect.kind}: a refit does not keep to the limits of {', '.join(limited)}"
        raise BadInput(where, "`tolerance`", expected, code="SPEC021")
    keeps_sign = declared.tolerance is not None and declared.tolerance < 1
    far = [
        {p: 0.0 if keeps_sign and sign * v < 0 else sign * FAR_VALUE for p, v in declared.parameters.items()}
        for sign in (1, -1)
    ]
    if not all(effect.admissible(system, place, values) for values in far):
        expected = f"no tolerance for {effect.kind}: a refit does not keep {effect.demands}"
        raise BadInput(where, "`tolerance`", expected, code="SPEC021")
    if any(p.as_number for p in effect.parameters) or not all(map(system.equation_error.has, symbols.values())):
        expected = f"no tolerance for {effect.kind}, whose parameters are not all in the force balance"
        raise BadInput(where, "`tolerance`", expected, code="SPEC021")


def _checked(effect: Effect, declared: DeclaredEffect, spec: Spec, key: str) -> dict[str, Any]:
    """The declared values, in the order of the form's parameters; BadInput for a wrong one."""
    names = [p.name for p in effect.parameters]
    forms = " or ".join(dict.fromkeys(", ".join(p.name for p in form.parameters) for form in effect.forms))
    possible = list(dict.fromkeys(p.name for form in effect.forms for p in form.parameters))
    faults = Faults()
    for name in declared.parameters:
        place, expected = spec.place(f"{key}.parameters.{name}"), f"{', '.join(possible)} of {effect.kind}"
        with faults.noting():
            refuse_unknown(name, possible, place, "unknown parameter", expected, code="SPEC008")
            if name not in names:
                found = f"`{name}` together with `{', '.join(names)}`"
                raise BadInput(place, found, f"the parameters of one form: {forms}", code="SPEC008")
    for p in effect.parameters:
        with faults.noting():
            if p.name not in declared.parameters:
                expected = f"`{p.name}:` ({p.meaning})"
                if any(p not in form.parameters for form in effect.forms):
                    expected += f"; a form has {forms}"
                raise BadInput(spec.place(f"{key}.parameters"), f"`{p.name}` is missing", expected, code="SPEC003")
            value = declared.parameters[p.name]
            if (p.low is not None and value <= p.low) or (p.high is not None and value >= p.high):
                found, place = f"{p.name} = {float(value):g}", spec.place(f"{key}.parameters.{p.name}")
                raise BadInput(place, found, f"a value {' and '.join(p.limits)}", code="SPEC007")
    faults.raise_noted()
    return {name: declared.parameters[name] for name in names}


def added(effect: Effect, system: System, place: int, symbols: Symbols, where: Place | str) -> System:
    """The system with an effect at a place; ``symbols`` must not occur in the system's equations yet.

    Raises BadInput if a parameter appears in no equation, or the effect changes the coordinates, inputs or contacts.
    """
    after = effect.add(system, place, symbols)
    if _consists_of(after) != _consists_of(system):
        found = f"{effect.kind} adds or removes coordinates, inputs or contacts"
        expected = "an `add` that leaves these as they are; for a load behind a spring, add a transmission"
        raise BadInput(where, found, expected, code="SPEC021")
    held = set().union(*(sympy.sympify(e).free_symbols for e in _changed(system, after)))
    without = [name for name, s in symbols.items() if s not in held]
    if without:
        found = f"no equation of the machine depends on {', '.join(f'`{name}`' for name in without)} of {effect.kind}"
        expected = "an `add` that puts every parameter into a force, level, law, inertia, stage, sensor or transmission"
        raise BadInput(where, found, expected, code="SPEC021")
    return after


def _consists_of(system: System) -> tuple[Any, ...]:
    """Coordinates, inputs and names of contacts, which an effect must not change."""
    names = [c.name for c in system.contacts]
    return system.positions, system.velocities, system.inputs, names


def _changed(before: System, after: System) -> Iterator[Any]:
    """The expressions of ``after`` that differ from those of ``before``."""
    for name in ("mass_matrix", "force", "distribution"):
        yield from (new for new, old in zip(getattr(after, name), getattr(before, name), strict=True) if new != old)
    for contact, old in zip(after.contacts, before.contacts, strict=True):
        if contact != old:
            yield from (contact.extra_level, contact.extra_force, *_law(contact))
    for chain in after.actuators.values():
        yield from chain.numbers
    yield from after.sensor_errors.values()
    for transmission in after.transmissions:
        yield from astuple(transmission)


def _law(contact: ContactFriction) -> Iterator[Any]:
    """The expressions of a contact's law: level and, for a law with states, force and rates."""
    law, p = contact.law, contact.law_parameters
    yield contact.law_level
    if isinstance(law, DynamicLaw):
        states = tuple(sympy.Dummy(state.name) for state in law.states)
        yield from (law.force(contact.slip, states, p), *law.rates(contact.slip, states, p))
