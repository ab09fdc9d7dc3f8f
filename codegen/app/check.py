"""``stiction check``: validates a spec and prints the system that it describes."""

from collections.abc import Iterator
from dataclasses import asdict
from math import pi
from typing import Any

import sympy

from codegen.app.derived import Derived, Source, derived_from
from codegen.base.border import verb
from codegen.base.errors import BadInput
from codegen.base.result import named
from codegen.base.text import render
from codegen.certify.size_limit import beyond_checker
from codegen.effects.declare import declared_symbols
from codegen.emit.c import c_language
from codegen.mechanics.system import System
from codegen.observers import Observer
from codegen.program import Program, lower
from codegen.simulate.simulable import refuse_unrunnable
from codegen.spec.free_gains import free_entries
from codegen.spec.model import Spec
from codegen.spec.motion import KinematicTree
from codegen.spec.numerics import numerical
from codegen.spec.places import with_place

MOST_TURNS = 4
"""Range of a link's angle, in turns, above which it is noted; this is the number of a range of 25 degrees."""


@verb
def check(source: Source) -> Derived:
    """Read and validate a spec, for all verbs. Only a certificate can be refused later.

    Raises BadInput for each fault of the spec.
    """
    machine = derived_from(source)
    machine.refuse_unknown_words()
    observer = None
    if machine.spec.observer is not None:
        observer = machine.nominal.observer
        refuse_ungenerable(machine.nominal)
    refuse_unrunnable(machine.spec, machine.system, observer)
    return machine


def check_text(machine: Derived) -> str:
    """The system in readable form."""
    return render("text/check.txt.j2", transmissions=machine.system.transmissions, **check_json(machine))


def check_json(machine: Derived) -> dict[str, Any]:
    """The JSON object of ``stiction check --json``: expressions as text, numbers with their units."""
    spec, system = machine.spec, machine.system
    observer = None if spec.observer is None else machine.nominal.observer
    coordinates = zip(system.positions, system.velocities, system.position_units, strict=True)
    u = sympy.Symbol("u", real=True)
    robot = spec.form if isinstance(spec.form, KinematicTree) else None
    shares = {p.name: p.tolerance for p in spec.parameters}
    for effect, symbols in zip(spec.effects, declared_symbols(system, spec), strict=True):
        shares |= {s.name: effect.tolerance for s in symbols.values()}
    tolerances = {name: {"tolerance": share} for name, share in shares.items() if share is not None}
    tolerances |= {p.name: {"deviation": p.deviation} for p in spec.parameters if p.deviation is not None}
    values = {s.name: {"value": float(v), "unit": system.units[s]} for s, v in system.values.items()}
    return {
        "format": "stiction-check/1",
        **named(spec, "name source"),
        "coordinates": [{"name": x.name, "velocity": v.name, "unit": unit} for x, v, unit in coordinates],
        "inputs": [{"name": w.name, "unit": u} for w, u in zip(system.inputs, system.input_units, strict=True)],
        "robot": robot and {"file": robot.file, "tolerance": robot.tolerance and asdict(robot.tolerance)},
        "mass_matrix": [[_readable(e) for e in system.mass_matrix.row(i)] for i in range(system.mass_matrix.rows)],
        "force": [_readable(e) for e in system.force],
        "contacts": [
            {"name": c.name, "slip": str(slip), "law": str(c.force.subs(c.slip, u)), "unit": c.unit}
            for c, slip in zip(system.contacts, system.slip_velocity, strict=True)
        ],
        "effects": [{"kind": e.kind, "on": list(e.on)} for e in spec.effects],
        "values": {name: number | tolerances.get(name, {}) for name, number in values.items()},
        "observer": None if observer is None else _observer_json(machine, observer),
        "envelope": {name: [float(low), float(high)] for name, (low, high) in spec.envelope.items()},
        "notes": [  # what a spec may say by a slip of writing although it is valid
            *_notes_on_friction(system),
            *_notes_on_angles(system),
            *_notes_on_turns(machine),
            *_notes_on_sample_time(machine),
        ],
    }


def _notes_on_friction(system: System) -> Iterator[str]:
    for c in system.contacts:
        p = {name: float(system.values[symbol]) for name, symbol in c.law_parameters.items()}
        if c.law.is_weaker_at_rest(p):
            yield (
                f"{c.name}: the static level F_s = {p['F_s']:.6g} {c.unit} is below the Coulomb level "
                f"F_c = {p['F_c']:.6g} {c.unit}. If that is not meant, exchange the two."
            )
        if c.extra_level == 0 and c.extra_force == 0 and c.law.is_frictionless(p):
            yield f"{c.name}: the friction level is zero at all speeds, so there is no friction at this contact."


def _notes_on_angles(system: System) -> Iterator[str]:
    """The notes on constant angles of more than a turn in a sine, cosine or tangent, as if given in degrees."""
    calls = (system.equation_error.atoms(call) for call in (sympy.sin, sympy.cos, sympy.tan))
    constant = {call.args[0]: call for found in calls for call in sorted(found, key=str)}
    for angle in sorted(constant.keys() & system.values.keys(), key=str):
        if abs(value := float(system.values[angle])) > 2 * pi:
            yield (
                f"{angle} = {value:.6g} in {constant[angle]} is in rad, and more than a turn. If it is meant in "
                f"degrees, write `unit: deg`."
            )


def _notes_on_turns(machine: Derived) -> Iterator[str]:
    """The notes on a link's angle whose range is of more than ``MOST_TURNS`` turns, as if given in degrees.

    A link's angle q is in the equations by sin and cos of p q + ... alone: gravity on a link has p = 1, its inertia
    p = 1 or 2. The equations then repeat after a turn, which a range need not exceed. A motor's angle, with cogging of
    a higher p or as the position of a spring, may have a range of many turns, and is not noted.
    """
    spec, system = machine.spec, machine.system
    waves = sorted(system.equation_error.atoms(sympy.sin, sympy.cos), key=str)
    for q, unit in zip(system.positions, system.position_units, strict=True):
        low, high = map(float, spec.envelope.get(q.name, (0, 0)))
        if unit != "rad" or high - low <= MOST_TURNS * 2 * pi:
            continue
        own = [wave for wave in waves if wave.has(q)]
        rest = system.equation_error.xreplace({wave: sympy.Dummy() for wave in own})
        if own and not rest.has(q) and all(wave.args[0].diff(q) in (-2, -1, 1, 2) for wave in own):
            yield (
                f"{q}: the envelope's range, {low:.6g} to {high:.6g} rad, is of {(high - low) / (2 * pi):.3g} turns, "
                f"and the equations repeat after one. "
                f"If it is meant in degrees, write `[{low:.6g} deg, {high:.6g} deg]`."
            )


def _notes_on_sample_time(machine: Derived) -> Iterator[str]:
    """The note on a sample time at which an error grows that decays in continuous time, such as 1 s for 1 ms."""
    if machine.spec.observer is None or free_entries(machine.spec):
        return
    analysis = machine.analysis
    if analysis.stable or analysis.spectral_abscissa >= 0:
        return
    longest = analysis.largest_sample_time
    limit = "" if analysis.dynamics.implicit else f"; explicit Euler is stable below {longest:.4g} s at these gains"
    yield (
        f"with a sample_time of {float(machine.observer.sample_time):.6g} s the observer is unstable: its error grows "
        f"by the factor {analysis.spectral_radius:.4g} in a sample{limit}."
    )


def _readable(entry: Any) -> str:
    """An entry of M or g as text, its numbers as they are usually written: 10.791 for 10791/1000, but 1/2 and 1/12.

    A decimal has 12 digits; those of a robot file have more.
    """
    if entry.is_Number:
        return f"{float(entry):.12g}"
    long = [r for r in entry.atoms(sympy.Rational) if r.q > 8 and 10**15 % int(r.q) == 0]  # with a finite decimal
    return str(sympy.sstr(entry.xreplace({r: sympy.Float(r, 12) for r in long}), full_prec=False))


def _observer_json(machine: Derived, observer: Observer) -> dict[str, Any]:
    free = free_gains(machine)
    gains = {s.name: {"value": float(v), "unit": observer.gain_units[s]} for s, v in observer.gains.items()}
    return {
        **named(observer, "kind velocity"),
        "sample_time": float(observer.sample_time),
        "gains": {name: gain for name, gain in gains.items() if name not in free} | free,
        "uncertifiable": _uncertifiable(machine.nominal) or None,
    }


def _uncertifiable(machine: Derived) -> str:
    """Why the spec alone rules out a certificate; else empty."""
    from codegen.analysis.operating_points import refuse_missing_ranges

    try:
        refuse_missing_ranges(machine.spec, machine.dynamics.points)
    except BadInput as missing:
        return f"the envelope has {missing.found}; add {missing.expected}"
    return beyond_checker(machine.observer)


def free_gains(machine: Derived) -> dict[str, dict[str, Any]]:
    """Name of each gain that the spec leaves free → its range and unit."""
    if not free_entries(machine.spec):
        return {}
    from codegen.analysis.feasibility.axes import gain_axes

    observer = machine.nominal.observer
    return {
        s.name: {"free": sorted((axis.low * sign, axis.high * sign)), "unit": observer.gain_units[s]}
        for axis in gain_axes(machine.spec, observer)
        for s, sign in axis.weights.items()
    }


def refuse_ungenerable(machine: Derived) -> None:
    """Raise BadInput, with its line, for what ``generate`` would refuse before it searches for a certificate."""
    assert machine.header
    _refuse_unprintable(machine.spec, machine.program)
    assert machine.dynamics


@numerical("the generated step")
def _refuse_unprintable(spec: Spec, program: Program) -> None:
    """Raise BadInput for a number of the generated step that cannot be written as a literal, such as infinity."""
    with with_place(spec):
        code = lower(program)
        literal = c_language(program).literal  # every language refuses the same numbers
        for value in (*(f.value or 0.0 for f in program.parameters), *code.derived_values):
            literal(value)
        for node in code.nodes:
            if node.kind == "number":
                literal(node.value)
