"""Contacts whose friction an observer cannot distinguish, because their slips are dependent."""

from __future__ import annotations

from codegen.base.errors import BadInput
from codegen.mechanics.sampling import rank, sampled_values
from codegen.observers.equations import Observer
from codegen.spec.model import Spec
from codegen.spec.numerics import numerical


@numerical("where friction acts")
def refuse_dependent_contacts(spec: Spec, observer: Observer) -> None:
    """Raise BadInput where an observer of each contact would act on contacts that slide dependently.

    Its error decays at K_F U'M⁻¹U (4.19), which is singular when the rank of U is below the number of contacts: a
    combination of levels that gives no force never shows in the motion. An observer of the force on each coordinate
    (GTO) need not distinguish contacts. The rank is that at almost every position of the envelope.
    """
    if all(e.contact is None for e in observer.errors):
        return
    points, distribution = sampled_values(spec), observer.system.distribution
    count, motions = distribution.cols, rank(distribution, points)
    if motions == count:
        return
    names = [c.name for c in observer.system.contacts]
    first = next(k for k in range(count) if rank(distribution[:, : k + 1], points) <= k)
    # Those without which the rest would be independent are the ones that take part.
    others = {j: [i for i in range(first + 1) if i != j] for j in range(first)}
    part = [names[j] for j, rest in others.items() if rank(distribution[:, rest], points) == first]
    found = (
        f"{observer.kind} on {count} contacts that slide in {motions} independent ways: the slip of {names[first]} "
        f"follows from that of {' and '.join(part)}, so U'M^-1 U is singular and no gain can distinguish their friction"
    )
    expected = "contacts that slide independently, or gto"
    raise BadInput(spec.place("observer.kind"), found, expected, "gto", code="SPEC019")
