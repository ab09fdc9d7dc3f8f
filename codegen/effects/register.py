"""Registration of a user's own effects, from one Python file that the user names; no other file is executed."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from traceback import extract_tb
from types import ModuleType
from typing import Any

from codegen.base.border import OWN_CODE
from codegen.base.errors import BadInput, Place
from codegen.base.input_files import read_text
from codegen.effects import CATALOGUE, Effect
from codegen.effects.declare import effect_symbols, places_of
from codegen.mechanics.system import System
from codegen.spec.reserved import is_identifier
from codegen.spec.units import is_printable

LIST = "EFFECTS"
"""Name of the list in a user's file."""
REQUIRED = ("kind", "sits_on", "equation", "signature", "seen_over", "parameters", "confused_with")
"""Attributes that an effect has no default for."""


def register(effect: Effect, where: str = "an effect") -> None:
    """Add an effect to the catalogue for this run; the same class again replaces the earlier one.

    ``where``: name of the file that defines it. Raises BadInput if its kind is taken by another effect, a name is no
    identifier, or a unit is no unit.
    """
    for name in REQUIRED:
        if not hasattr(effect, name):
            found = f"an effect `{getattr(effect, 'kind', type(effect).__name__)}` without `{name}`"
            raise BadInput(where, found, f"each of {', '.join(REQUIRED)}", code="EFFECT001")
    for name in (effect.kind, *(p.name for p in effect.parameters)):
        if not is_identifier(name):
            expected = "letters, digits and _, starting with a letter, since generated code has names from it"
            raise BadInput(where, f"an effect with the name `{name}`", expected, code="EFFECT001")
    for p in effect.parameters:
        if not is_printable(re.sub(r"\{[Fqw]\}", "N", p.unit)):
            expected = "a unit such as N*m, with {F}, {q} and {w} for those of its place"
            raise BadInput(where, f"`{p.name}` in `{p.unit}`", expected, code="EFFECT001")
    known = CATALOGUE.get(effect.kind)
    # By name: a file that is loaded twice makes a new class of the same name each time.
    if known is not None and type(known).__qualname__ != type(effect).__qualname__:
        raise BadInput(where, f"a second effect `{effect.kind}`", "a kind that no other effect has", code="EFFECT001")
    CATALOGUE[effect.kind] = effect


def is_own(kind: str) -> bool:
    """Whether a kind is an effect of the user's own, registered in this run and not shipped."""
    return kind in CATALOGUE and not type(CATALOGUE[kind]).__module__.startswith("codegen.effects.")


def load_effects(path: str | Path) -> tuple[str, ...]:
    """Run a Python file and register the effects of its list ``EFFECTS``; return their kinds.

    Raises BadInput if the file cannot be read or is not Python, or has no list of effects.
    """
    where = str(path)
    expected = f"a Python file NAME.py with a list `{LIST}`"
    if Path(path).suffix != ".py":
        raise BadInput(where, f"the ending `{Path(path).suffix}`", expected, code="FILE005")
    text = read_text(Path(path), expected)
    module = ModuleType(f"stiction_effects_{Path(path).stem}")
    module.__file__ = where
    try:
        exec(compile(text, where, "exec"), module.__dict__)
    except (Exception, SystemExit) as error:  # any error of the user's own code
        # The innermost line of the user's own file: the fault may be raised in a library that it calls.
        lines = [frame.lineno for frame in extract_tb(error.__traceback__) if frame.filename == where]
        line = error.lineno if isinstance(error, SyntaxError) else lines[-1] if lines else None
        raise BadInput(Place(where, line), f"{type(error).__name__}: {error}", expected, code="EFFECT001") from None
    found = getattr(module, LIST, None)
    if not isinstance(found, list | tuple) or not found or not all(isinstance(e, Effect) for e in found):
        expected = f"`{LIST} = [MyEffect()]`, each a codegen.effects.Effect"
        raise BadInput(where, f"no list `{LIST}` of effects", expected, code="EFFECT001")
    for effect in found:
        register(effect, where)
    OWN_CODE.add(where)
    return tuple(effect.kind for effect in found)


def kinds_of(kind: str) -> set[str]:
    """The kind and the kinds of its base classes; what ``confused_with`` says of a base class holds for it too."""
    classes = type(CATALOGUE[kind]).__mro__
    return {kind, *(c.kind for c in classes if issubclass(c, Effect) and "kind" in vars(c))}


def separating_experiment(kind: str, other: str) -> str:
    """The experiment that discriminates two kinds, by ``confused_with`` of either; "" where neither names the other.

    An effect of a user can name shipped ones, which cannot name it.
    """
    for one, two in ((kind, other), (other, kind)):
        for confusion in CATALOGUE[one].confused_with:
            if confusion.other in kinds_of(two):
                return confusion.separated_by
    return ""


def candidates(system: System) -> Iterator[tuple[Effect, int]]:
    """Each (effect, index of its place) of the catalogue that applies to the system.

    Where a user's own effect is identical to a shipped one, a diagnosis could not discriminate the two, so only the
    user's is a candidate, at the position of the shipped one: of equal candidates the first is named.
    """
    yielded = set[tuple[str, int]]()
    for effect in CATALOGUE.values():
        for place in range(len(places_of(effect, system))):
            if effect.applies(system, place):
                candidate = _users_version(effect, system, place)
                if (candidate.kind, place) not in yielded:
                    yielded.add((candidate.kind, place))
                    yield candidate, place


def twins_of(effect: Effect, system: System, place: int) -> list[tuple[str, str]]:
    """(kind, place) of each candidate with the same motion as an effect (``Effect.twins``).

    Where a user's own effect is identical to a shipped twin, it is named in place of that twin.
    """
    found = list[tuple[str, str]]()
    for kind, on in effect.twins(system, place):
        twin = CATALOGUE[kind]
        found.append((_users_version(twin, system, places_of(twin, system).index(on)).kind, on))
    return found


def _users_version(effect: Effect, system: System, place: int) -> Effect:
    """The user's own effect that is identical to a shipped one at a place; the effect itself where there is none."""
    users = [] if is_own(effect.kind) else [own for kind, own in CATALOGUE.items() if is_own(kind)]
    return next((own for own in users if is_identical(own, effect, system, place)), effect)


def is_identical(own: Effect, effect: Effect, system: System, place: int) -> bool:
    """Whether a user's effect is equal to the shipped one from which it is derived, at one place of a system.

    That is, it is a subclass with the same parameters, and makes the same change of the System.
    """
    derived = isinstance(own, type(effect)) and own.sits_on == effect.sits_on
    if not derived or [p.name for p in own.parameters] != [p.name for p in effect.parameters]:
        return False
    if not own.applies(system, place):
        return False
    symbols = effect_symbols(effect, places_of(effect, system)[place], system)
    return _comparable(own.add(system, place, symbols)) == _comparable(effect.add(system, place, symbols))


def _comparable(system: System) -> tuple[Any, ...]:
    """A System in a form that ``==`` can compare: since laws define no equality, by class and attributes."""
    laws = [(type(c.law), vars(c.law)) for c in system.contacts]
    contacts = [(c.slip, dict(c.law_parameters), c.extra_level, c.extra_force) for c in system.contacts]
    return replace(system, contacts=()), contacts, laws
