"""``stiction check``: a spec that every other verb can use."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import sympy

from codegen.app.generable import refuse_ungenerable
from codegen.app.model import Model, model_of
from codegen.base.border import verb
from codegen.base.text import render
from codegen.certify.size import beyond_checker
from codegen.simulate.runnable import refuse_unrunnable
from codegen.spec import read_spec
from codegen.spec.free_gains import at_middle


@verb
def check(path: str | Path) -> Model:
    """Read and validate a spec: what the other verbs would refuse of it, all but its proof, is refused here.

    Raises:
        BadInput: for anything in it that cannot be used.
    """
    model = model_of(read_spec(path))
    if model.observer is not None:
        refuse_ungenerable(at_middle(model.spec), model.observer)
    refuse_unrunnable(model.spec, model.system, model.observer)
    return model


def check_text(model: Model) -> str:
    """The system in readable form."""
    return render("text/check.txt.j2", **model_view(model))


def model_view(model: Model) -> dict[str, Any]:
    """What ``stiction check`` prints."""
    system = model.system
    values = [(s.name, float(v), system.units[s]) for s, v in system.values.items()]
    slips = dict(zip([c.name for c in system.contacts], system.slip_velocity, strict=True))
    return {
        "spec": model.spec,
        "system": system,
        "mass": [[str(e) for e in system.mass_matrix.row(i)] for i in range(system.mass_matrix.rows)],
        "force": [str(e) for e in system.force],
        "contacts": [
            (c.name, str(slips[c.name]), str(c.force.subs(c.slip, sympy.Symbol("u", real=True))), c.unit)
            for c in system.contacts
        ],
        "values": values,
        "observer": model.observer,
        "uncertifiable": beyond_checker(model.observer) if model.observer else "",
        "gains": [(s.name, float(v), model.observer.gain_units[s]) for s, v in model.observer.gains.items()]
        if model.observer
        else [],
    }
