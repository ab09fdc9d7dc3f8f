"""Section ``cancellation``: which friction the generated input cancels, and by which method."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from codegen.base.errors import BadInput, Place, refuse_unknown
from codegen.spec.expression import exact_number
from codegen.spec.model import CancellationChoice, Contact
from codegen.spec.schema import CancellationSection


def read_cancellation(
    section: CancellationSection | None, contacts: Sequence[Contact], place: Callable[[str], Place]
) -> CancellationChoice | None:
    """Read the section; None where the spec has none.

    Args:
        contacts: of the spec.
        place: key → its file and line.

    Raises:
        BadInput: for a gain that is not in (0, 2], a damping that is negative or combined with ``appendix_b``, or an
            unknown contact.
    """
    if section is None:
        return None
    gain = exact_number(section.gain, place("cancellation.gain"))
    if not 0 < gain <= 2:
        expected = "a factor on the friction estimate: above 0, up to 2"
        raise BadInput(place("cancellation.gain"), f"gain {section.gain}", expected, code="SPEC007")
    damping = exact_number(section.damping, place("cancellation.damping"))
    if damping < 0:
        words = f"damping {section.damping}"
        raise BadInput(place("cancellation.damping"), words, "0 or a positive number", code="SPEC007")
    if damping and section.method == "appendix_b":
        found = "`damping` with `method: appendix_b`, which does not use it"
        raise BadInput(place("cancellation.damping"), found, "method: minimum_norm", "minimum_norm", code="SPEC022")
    chosen = section.contacts
    if isinstance(chosen, str):
        return CancellationChoice(section.method, section.weight, gain, chosen, damping)
    names = [c.name for c in contacts]
    for k, name in enumerate(chosen):
        refuse_unknown(name, names, place(f"cancellation.contacts[{k}]"), "unknown contact", code="SPEC008")
    if not chosen or len(set(chosen)) < len(chosen):
        expected = "names of contacts, each once"
        raise BadInput(place("cancellation.contacts"), "no contact, or one twice", expected, code="SPEC015")
    return CancellationChoice(section.method, section.weight, gain, tuple(chosen), damping)
