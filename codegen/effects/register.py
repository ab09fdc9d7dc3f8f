"""User-defined effects from one Python file that the user names; no other file is executed."""

from __future__ import annotations

import re
from pathlib import Path
from traceback import extract_tb
from types import ModuleType

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import read_text
from codegen.effects import CATALOGUE, Effect
from codegen.spec.reserved import is_identifier
from codegen.spec.units import is_written

LIST = "EFFECTS"


def register(effect: Effect, where: str = "an effect") -> None:
    """Add an effect to the catalogue for this run; the same class again replaces the earlier one.

    Raises:
        BadInput: if its kind is taken by another effect, or its names are no identifiers, or a unit is none.
    """
    for name in (effect.kind, *(p.name for p in effect.parameters)):
        if not is_identifier(name):
            expected = "letters, digits and _, starting with a letter, since generated code has names from it"
            raise BadInput(where, f"an effect with the name `{name}`", expected, code="EFFECT001")
    for p in effect.parameters:
        if not is_written(re.sub(r"\{[Fqw]\}", "N", p.unit)):
            raise BadInput(
                where,
                f"`{p.name}` in `{p.unit}`",
                "a unit such as N*m, with {F}, {q} and {w} for those of its place",
                code="EFFECT001",
            )
    known = CATALOGUE.get(effect.kind)
    if known is not None and type(known).__qualname__ != type(effect).__qualname__:
        raise BadInput(where, f"a second effect `{effect.kind}`", "a kind that no other effect has", code="EFFECT001")
    CATALOGUE[effect.kind] = effect


def is_own(kind: str) -> bool:
    """Whether a kind is a user's own and not in the shipped catalogue."""
    return not type(CATALOGUE[kind]).__module__.startswith("codegen.effects.")


def load_effects(path: str | Path) -> tuple[str, ...]:
    """Run a Python file and register the effects of its list ``EFFECTS``; return their kinds.

    Raises:
        BadInput: if the file cannot be read or is not Python, or has no list of effects.
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
        lines = [frame.lineno for frame in extract_tb(error.__traceback__) if frame.filename == where]
        line = error.lineno if isinstance(error, SyntaxError) else lines[-1] if lines else None
        raise BadInput(Place(where, line), f"{type(error).__name__}: {error}", expected, code="EFFECT001") from None
    found = getattr(module, LIST, None)
    if not isinstance(found, list | tuple) or not found or not all(isinstance(e, Effect) for e in found):
        raise BadInput(
            where,
            f"no list `{LIST}` of effects",
            f"`{LIST} = [MyEffect()]`, each a codegen.effects.Effect",
            code="EFFECT001",
        )
    for effect in found:
        register(effect, where)
    return tuple(effect.kind for effect in found)
