"""Every shipped spec and the C and Python that it gives now, in each precision that the tool offers."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

import stiction
from codegen.cancellation import with_cancellation
from codegen.certify.certificate_text import rational_text
from codegen.emit.package import emit_sources, make_header
from codegen.program import Program, build_program
from codegen.spec.schema import CodeChoice
from tests.slow_cases import slow_except

from .interface import Interface, read_interface
from .signals import Channel, Excitation

SPECS = Path(__file__).parents[2] / "specs"
SHIPPED = tuple(sorted(str(p.relative_to(SPECS).with_suffix("")) for p in SPECS.rglob("*.yaml")))
SHIPPED = tuple(name for name in SHIPPED if not name.startswith(("plants/", "gallery/", "data/")))  # run, not generated
KINDS = (
    *("one_mass_domain", "chain", "two_link_arm", "thesis/one_mass_cfo_semi_implicit", "thesis/one_mass_dfo_implicit"),
    *(
        "thesis/rig_dfob",
        "thesis/rig_to",
        "thesis/two_mass_cancellation",
        "thesis/two_mass_gdfo",
        "thesis/two_mass_gto",
    ),
)
"""Each observer, law and way to step, and code with loops and with sines: for what costs seconds a spec."""
REPRESENTATIVE = slow_except(SHIPPED, KINDS)
PRECISIONS = ("double", "single")
REST = {"theta1": -np.pi / 2}
"""The two-link arm hangs down, where the gravity that its input does not carry is small."""


def path_of(spec: str) -> Path:
    return SPECS / f"{spec}.yaml"


@cache
def model(spec: str) -> stiction.Machine:
    return stiction.check(path_of(spec))


@cache
def program(spec: str, precision: str = "double", fault: str = "hold") -> Program:
    observer = model(spec).observer
    assert observer is not None
    return build_program(with_cancellation(model(spec).spec, observer), CodeChoice(precision=precision, fault=fault))


@cache
def sources(spec: str, precision: str = "double", fault: str = "hold") -> Mapping[str, str]:
    """File name → text, as ``stiction generate`` writes it."""
    machine = model(spec).spec
    ranges = {name: (rational_text(low), rational_text(high)) for name, (low, high) in machine.envelope.items()}
    header = make_header(machine.path.name, machine.sha256, machine.source, machine.robot, envelope=ranges)
    return emit_sources(program(spec, precision, fault), header)


@cache
def interface(spec: str, precision: str = "double") -> Interface:
    name = program(spec).name
    return read_interface(name, sources(spec, precision)[f"{name}.h"])


@cache
def excitation(spec: str, precision: str = "double") -> Excitation:
    """Speeds within the envelope, and inputs of three times the largest friction level."""
    machine, face, made = model(spec).spec, interface(spec, precision), program(spec)
    observer = model(spec).observer
    assert observer is not None
    envelope = {name: float(high) for name, (_, high) in machine.envelope.items()}
    levels = [float(v) for c in machine.contacts for name, v in c.parameters.items() if name in ("a", "a1")]
    channels = {w.name: Channel("input", envelope.get(w.name, 3 * max(levels))) for w in machine.inputs}
    for x in machine.coordinates:
        channels[x.name] = Channel("position", envelope[x.velocity], REST.get(x.name, 0.0))
        channels[x.velocity] = Channel("velocity", envelope[x.velocity])
    names = {made.reference(f.name): f.name for f in made.inputs}
    order = tuple(channels[names[element]] for element in face.elements("inputs"))
    return Excitation(order, float(observer.sample_time), np.dtype("f8" if face.real == "double" else "f4"))
