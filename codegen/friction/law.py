"""What a friction law is: a level over slip speed, its parameters, and a bound on its slope."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import sympy


@dataclass(frozen=True)
class LawParameter:
    """A parameter of a law.

    Attributes:
        unit: template over {F} (the contact's force unit) and {q} (its slip's unit).
        positive: whether it must be greater than zero; otherwise zero is admitted too.
        meaning: a few words.
    """

    name: str
    unit: str
    positive: bool
    meaning: str


class FrictionLaw(ABC):
    """A zero-memory law F = level(|u|) sgn(u) on the slip velocity u.

    Attributes:
        name: as it stands in a spec.
        source: where the law is published.
        parameters: in order.
    """

    name: ClassVar[str]
    source: ClassVar[str]
    parameters: ClassVar[tuple[LawParameter, ...]]

    @abstractmethod
    def level(self, slip_speed: sympy.Expr, p: Mapping[str, sympy.Expr]) -> sympy.Expr:
        """The level a(|u|) ≥ 0, in the contact's force unit."""

    @abstractmethod
    def slope_bound(self, p: Mapping[str, sympy.Expr]) -> sympy.Expr:
        """A bound on |∂a/∂u| (Lemma 2.1), in force unit · s / slip unit."""
