"""``observer.domain`` of a spec: where a (G)CFO's estimate is certified through reversals, stick and noise."""

from __future__ import annotations

import sympy

from codegen.base.errors import BadInput
from codegen.mechanics.system import System
from codegen.observers.equations import Domain
from codegen.spec.model import Spec


def read_domain(spec: Spec, system: System) -> Domain | None:
    """The domain of the spec; the range of the true level is the envelope's ``a_CONTACT``.

    Raises:
        BadInput: for a domain on several coordinates or contacts, with measured velocity, another h than h(s) = s or
            exponential or implicit steps, or without a range for the level that contains the declared one.
    """
    choice = spec.observer
    assert choice is not None
    if choice.domain is None:
        return None
    place = spec.place("observer.domain")
    if system.degrees_of_freedom > 1 or len(system.contacts) > 1:
        found = f"a domain for {system.degrees_of_freedom} coordinates and {len(system.contacts)} contacts"
        raise BadInput(
            place, found, "one coordinate with one contact; for several there is no such domain", code="SPEC022"
        )
    if choice.velocity != "estimated" or choice.integration not in ("euler", "semi_implicit"):
        found = f"a domain with {choice.velocity} velocity under {choice.integration}"
        raise BadInput(place, found, "`velocity: estimated`, and euler or semi_implicit", code="SPEC022")
    if choice.exponent != 1 or choice.shape is not None:
        raise BadInput(
            place,
            "a domain together with `exponent` or `h`",
            "neither of them: a domain needs h(s) = s",
            code="SPEC005",
        )
    contact = system.contacts[0]
    key = f"a_{contact.name}"
    level = spec.envelope.get(key)
    if level is None:
        raise BadInput(
            place,
            f"no range for {key}",
            f"`{key}: [low, high]` in the envelope: the true friction level",
            code="SPEC026",
        )
    at_rest = contact.level_at_rest
    if level[0] < 0 or (at_rest is not None and not level[0] <= at_rest.subs(system.values) <= level[1]):
        found = f"[{level[0]}, {level[1]}]"
        raise BadInput(
            spec.place(f"envelope.{key}"),
            found,
            "a range of levels >= 0 in which the declared one lies",
            code="SPEC007",
        )
    domain = choice.domain
    samples = max(1, int(sympy.ceiling(domain.settle / choice.sample_time)))
    return Domain(domain.slip_speed, samples, level, domain.innovation)
