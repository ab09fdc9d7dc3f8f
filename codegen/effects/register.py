"""Effects of a user's own, from one Python file that the user names; nothing else is ever run."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from codegen.effects import CATALOGUE, Effect
from codegen.errors import BadInput

LIST = "EFFECTS"


def register(effect: Effect, where: str = "an effect") -> None:
    """Add an effect to the catalogue for this run; the same class again takes the place of the earlier.

    Raises:
        BadInput: if its kind is taken by another effect.
    """
    known = CATALOGUE.get(effect.kind)
    if known is not None and type(known).__qualname__ != type(effect).__qualname__:
        raise BadInput(where, f"a second effect `{effect.kind}`", "a kind of its own")
    CATALOGUE[effect.kind] = effect


def is_own(kind: str) -> bool:
    """Whether a kind is a user's own, and none of the catalogue that is shipped."""
    return not type(CATALOGUE[kind]).__module__.startswith("codegen.effects.")


def load_effects(path: str | Path) -> tuple[str, ...]:
    """Run a Python file and register what its list ``EFFECTS`` holds; their kinds.

    Raises:
        BadInput: if the file cannot be read or is not Python, or has no list of effects.
    """
    where = str(path)
    if Path(path).suffix != ".py" or not Path(path).is_file():
        raise BadInput(where, "no such Python file", f"a file NAME.py with a list `{LIST}`")
    loader = importlib.util.spec_from_file_location(f"stiction_effects_{Path(path).stem}", path)
    if loader is None or loader.loader is None:
        raise BadInput(where, "a file that Python cannot load", f"a file NAME.py with a list `{LIST}`")
    module = importlib.util.module_from_spec(loader)
    try:
        loader.loader.exec_module(module)
    except (SyntaxError, ImportError, UnicodeDecodeError) as error:
        raise BadInput(where, f"{type(error).__name__}: {error}", f"a Python file with a list `{LIST}`") from None
    found = getattr(module, LIST, None)
    if not isinstance(found, list | tuple) or not found or not all(isinstance(e, Effect) for e in found):
        raise BadInput(where, f"no list `{LIST}` of effects", f"`{LIST} = [MyEffect()]`, each a codegen.effects.Effect")
    for effect in found:
        register(effect, where)
    return tuple(effect.kind for effect in found)
