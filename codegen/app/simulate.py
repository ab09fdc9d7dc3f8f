"""``stiction simulate``: a log of the plant of a spec."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from codegen.app.derived import Source, derived_from
from codegen.base.border import verb
from codegen.base.errors import BadInput, nearest_name
from codegen.base.files import refuse_target
from codegen.base.text import render
from codegen.simulate.closed_loop import simulate as simulate_plant
from codegen.simulate.observed_loop import METHODS
from codegen.simulate.simulated import Simulated, write_simulated


@verb
def simulate(
    source: Source,
    out: str | Path,
    progress: Callable[[float], None] | None = None,
    method: str = "steps",
) -> Simulated:
    """Write a log of the plant of a spec, with its declared effects, driven as its ``simulation:`` section says.

    Args:
        method: of the plant: ``steps``, or ``events`` for the slow reference.

    Raises:
        BadInput: for a bad spec or one without ``simulation:``, another method, or a file that is not to be written.
    """
    chosen = next((known for known in METHODS if known == method), None)
    if chosen is None:
        raise BadInput("--method", f"`{method}`", " or ".join(METHODS), nearest_name(method, METHODS), code="CALL001")
    target = Path(out)
    refuse_target(target, {"the spec itself": Path(source)}, (".csv", ".txt"))
    machine = derived_from(source)
    return write_simulated(target, machine.spec, simulate_plant(machine.spec, machine.system, progress, method=chosen))


def simulated_notes(simulated: Simulated) -> str:
    """What is to be said of a log beside its path; often nothing."""
    return render("text/simulated_notes.txt.j2", s=simulated)
