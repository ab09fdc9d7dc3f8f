"""What a kind of observer says of itself; the registry of the observers collects these."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from codegen.mechanics.system import System
from codegen.observers.equations import Observer
from codegen.spec.model import Spec


@dataclass(frozen=True)
class ObserverKind:
    """A kind of observer, as ``gcfo``.

    Attributes:
        build: the spec and its system → the observer's equations.
        gains: names of the gains that it can have, K_v included.
        options: keys of the ``observer:`` section that only some kinds read, among ``exponent``, ``h``, ``domain`` and
            ``laws``; a spec that sets another of them is refused.
        general: of a kind for one coordinate with one contact: the kind for several; "" for all others.
        by_contact: whether it estimates the friction of each contact, and not only that on each coordinate.
    """

    build: Callable[[Spec, System], Observer]
    gains: tuple[str, ...]
    options: tuple[str, ...] = ()
    general: str = ""
    by_contact: bool = True
