"""Registry of the observers, which are lists of equations. To add one: a file with its KINDS, added to OBSERVERS."""

import re
from dataclasses import replace

from codegen.base.errors import BadInput, PlaceOf, refuse_unknown
from codegen.effects.declare import system_of
from codegen.mechanics.sampling import rank, sampled_values
from codegen.mechanics.system import System
from codegen.observers import coulomb, dynamic, tracking
from codegen.observers.equations import Equation, ErrorVariable, Observer, ObserverKind
from codegen.observers.gains import refuse_unknown_gains
from codegen.observers.velocity import refuse_integration
from codegen.spec.free_gains import refuse_free_gains
from codegen.spec.model import ObserverChoice, Spec
from codegen.spec.numerics import numerical
from codegen.spec.places import place_of
from codegen.spec.schema import ObserverSection

OBSERVERS: dict[str, ObserverKind] = {**coulomb.KINDS, **tracking.KINDS, **dynamic.KINDS}
_OF_SUMS = (
    f"or `kind: gto` with gains of {', '.join(tracking.GAINS)}: it estimates the sum of forces on each coordinate"
)
"""What is expected in place of an observer of the friction at each of several dependent contacts."""


def observer_of(spec: Spec, system: System | None = None) -> Observer:
    """The observer of a spec; by default on the spec's system with its declared effects.

    Raises BadInput for a spec without an observer, with free gains, or with contacts whose slips are dependent.
    """
    refuse_free_gains(spec)
    observer = build_observer(spec, system_of(spec) if system is None else system)
    refuse_dependent_contacts(spec, observer)
    return observer


@numerical("the observer")
def build_observer(spec: Spec, system: System) -> Observer:
    """The observer of the spec's ``observer:`` section for this system.

    Raises BadInput for a spec without observer, an unknown kind, or a single-coordinate kind on several coordinates.
    """
    choice = spec.observer
    if choice is None:
        expected = "observer: {kind, velocity, gains, sample_time}"
        raise BadInput(spec.place("name"), "no `observer:` section", expected, code="SPEC029")
    refuse_unknown_words(choice, spec.place)
    place = spec.place("observer.kind")
    kind = OBSERVERS[choice.kind]
    if kind.general and (system.degrees_of_freedom > 1 or len(system.contacts) > 1):
        n, contacts = system.degrees_of_freedom, len(system.contacts)
        found = f"{choice.kind} on {n} coordinate{'s'[: n > 1]} and {contacts} contact{'s'[: contacts > 1]}"
        if contacts > n:  # their slips depend on each other, so no observer can tell their forces apart
            raise BadInput(place, found, f"one contact with the sum of the levels, {_OF_SUMS}", code="SPEC022")
        raise BadInput(place, found, f"{kind.general}, its general form", kind.general, code="SPEC022")
    _refuse_idle_options(spec, choice)
    refuse_integration(spec)
    observer = kind.build(spec, system)
    if choice.integration != "euler":
        euler = kind.build(replace(spec, observer=replace(choice, integration="euler")), system)
        observer = replace(observer, integration=choice.integration, euler=euler)
    _refuse_shared_names(spec, observer)
    return observer


def refuse_unknown_words(choice: ObserverChoice | ObserverSection, place: PlaceOf) -> None:
    """Raise BadInput for an unknown kind of observer, or for gains that its kind does not have; needs no system.

    ``choice``: the observer of a spec, or its section as it stands there.
    """
    refuse_unknown(choice.kind, OBSERVERS, place("observer.kind"), "unknown observer", code="SPEC008")
    refuse_unknown_gains(choice, place, OBSERVERS[choice.kind].gains)


def _refuse_idle_options(spec: Spec, choice: ObserverChoice) -> None:
    """Raise BadInput for options that the chosen kind of observer would ignore."""
    shaped, other = choice.shape is not None, choice.exponent != 1
    given = {"laws": choice.laws, "h": shaped, "domain": choice.domain, "exponent": other}
    for key, value in given.items():
        if value and key not in OBSERVERS[choice.kind].options:
            found = f"`{key}` with `kind: {choice.kind}`, which does not use it"
            readers = " or ".join(f"`kind: {name}`" for name, kind in OBSERVERS.items() if key in kind.options)
            raise BadInput(spec.place(f"observer.{key}"), found, readers, code="SPEC020")


def _refuse_shared_names(spec: Spec, observer: Observer) -> None:
    """Raise BadInput if two quantities, of the spec or of the observer, would have the same name."""
    system = observer.system
    own = [s.name for e in observer.equations for s in (*e.symbols, *(e.state or ()))]
    own += [s.name for e in observer.errors for s in {e.symbol, e.truth} - {*system.velocities}]
    own += [s.name for s in (*observer.signs, *observer.gains, *system.accelerations)]
    own += [label for e in observer.equations for f in e.law for label in f.labels]
    own += [s.name for s in observer.assumed if s not in {e.truth for e in observer.errors}]
    own += ["h", *[f"{v.name}_{when}" for v in system.velocities for when in ("next", "before")]]
    declared = {s.name for s in (*system.positions, *system.velocities, *system.inputs, *system.values)}
    for name in [*own, *sorted(declared)]:
        if own.count(name) + (name in declared) > 1 or re.fullmatch(r"W\d+(_\d+)?|pi_", name):
            laws = [(c.name, p, s.name) for c in system.contacts for p, s in c.law_parameters.items()]
            of_law = (f" (formed from contact `{c}` and parameter `{p}` of its law)" for c, p, s in laws if s == name)
            made = next(of_law, "")
            found = f"the name `{name}`{made}, which the generated observer uses for a quantity of its own"
            raise BadInput(place_of(spec, name), found, "another name", code="SPEC009")


__all__ = [
    "OBSERVERS",
    "Equation",
    "ErrorVariable",
    "Observer",
    "ObserverKind",
    "build_observer",
    "observer_of",
    "refuse_unknown_words",
]


@numerical("where friction acts")
def refuse_dependent_contacts(spec: Spec, observer: Observer) -> None:
    """Raise BadInput for an observer of the friction at each contact if the slips of contacts are linearly dependent.

    Its error dynamics contain K_F U'M⁻¹U (4.19), which is singular if rank U is less than the number of contacts: a
    combination of levels with U F = 0 has no effect on the motion and is unobservable. An observer of the force on each
    coordinate (GTO) does not distinguish contacts. The rank is that at almost every position of the envelope.
    """
    if all(e.contact is None for e in observer.errors):
        return
    points, distribution = sampled_values(spec), observer.system.distribution
    count, motions = distribution.cols, rank(distribution, points)
    if motions == count:
        return
    names = [c.name for c in observer.system.contacts]
    first = next(k for k in range(count) if rank(distribution[:, : k + 1], points) <= k)
    # A contact takes part in the dependence if the others are independent without it.
    others = {j: [i for i in range(first + 1) if i != j] for j in range(first)}
    part = [names[j] for j, rest in others.items() if rank(distribution[:, rest], points) == first]
    found = (
        f"{observer.kind} on {count} contacts that slide in {motions} independent way{'s'[: motions > 1]}: the slip of "
        f"{names[first]} follows from that of {' and '.join(part)}, so U'M^-1 U is singular and no gain can "
        "distinguish their friction"
    )
    expected = (
        f"contacts that slide independently (of several with one slip, one with the sum of the levels), {_OF_SUMS}"
    )
    raise BadInput(spec.place("observer.kind"), found, expected, code="SPEC019")
