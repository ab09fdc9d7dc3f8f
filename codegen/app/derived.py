"""A spec and the objects derived from it, each computed once, when it is first used.

spec → system → observer → analysis
                        ↘ program → sources → outcome (certificate or refusal) → files
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

from codegen.base.errors import Faults, refuse_unknown
from codegen.base.files import sha256
from codegen.base.progress import begin
from codegen.base.result import Shown
from codegen.effects.declare import refuse_unknown_forces, system_of
from codegen.mechanics.system import System
from codegen.observers import Observer, observer_of, refuse_unknown_words
from codegen.spec import Spec, read_spec
from codegen.spec.free_gains import at_middle
from codegen.spec.model import CancellationChoice
from codegen.spec.numerics import numerical
from codegen.spec.places import with_place

if TYPE_CHECKING:
    from codegen.analysis.analysis import Analysis
    from codegen.analysis.operating_points import EvaluatedDynamics
    from codegen.certify.outcome import Certificate, Refusal
    from codegen.emit.header import Header
    from codegen.export.generated_observer import GeneratedObserver
    from codegen.program import Program


@dataclass(frozen=True)
class Overrides:
    """Options of a command that override the spec; None and () for the spec's own choice or the default."""

    in_words = 'stiction.Overrides(…), as stiction.Overrides(precision="single")'  # in a message about an argument
    precision: str | None = None
    fault: str | None = None
    targets: tuple[str, ...] = ()

    @property
    def printers(self) -> tuple[str, ...]:
        """The requested names of PRINTERS, in its order."""
        from codegen.emit import ALWAYS, PRINTERS

        return tuple(PRINTERS) if "all" in self.targets else self.targets or ALWAYS

    @property
    def chosen(self) -> dict[str, str]:
        """Key of the spec's ``code`` section → the choice that replaces it."""
        given = {"precision": self.precision, "fault": self.fault}
        return {key: value for key, value in given.items() if value is not None}

    def applied(self, spec: Spec) -> Spec:
        """The spec with the command's choices. Raises BadInput for an unknown precision, fault policy or target."""
        from codegen.emit import PRINTERS
        from codegen.program.model import FAULTS, PRECISIONS

        known = {"precision": PRECISIONS, "fault": FAULTS}
        for key, value in self.chosen.items():
            refuse_unknown(value, known[key], f"--{key}", "", " or ".join(known[key]), code="CALL001")
        targets = (*PRINTERS, "all")
        expected = f"one of {', '.join(targets)}, or fmu alone"
        for target in self.targets:
            refuse_unknown(target, targets, "--target", "", expected, code="CALL001")
        return replace(spec, code=spec.code.model_copy(update=self.chosen))

    @property
    def options(self) -> str:
        """The options as in the command, each after a space."""
        given = [*self.chosen.items(), *(("target", t) for t in self.targets)]
        return "".join(f" --{option} {value}" for option, value in given)


class Derived(Shown):
    """A spec, and all that is derived from it: system, observer, analysis, program, sources, certificate and files.

    Args:
        overrides: the command's own choices of precision, fault policy and targets.
        origin: a machine that differs in observer and code only; its system is used.

    Raises:
        TypeError: for a path in place of a spec.
    """

    in_words = "a machine"  # in a message about an argument

    def __init__(self, spec: Spec, overrides: Overrides | None = None, origin: Derived | None = None) -> None:
        if not isinstance(spec, Spec):
            raise TypeError(f"a machine is made of a Spec, not of {type(spec).__name__}; stiction.load(path) reads one")
        self.overrides = overrides or Overrides()
        self.spec = spec if self.overrides == Overrides() else self.overrides.applied(spec)
        self._origin = origin
        self.__dict__["_is_made"] = True

    def __setattr__(self, name: str, value: object) -> None:
        """Refuse a change: what was derived from the spec before would stay as it was."""
        if "_is_made" in self.__dict__:
            raise AttributeError(
                f"a machine is not changed (`{name}`): edit its spec's file and stiction.load it again"
            )
        super().__setattr__(name, value)

    def __fspath__(self) -> str:
        """The file of the spec, for messages."""
        return str(self.spec.path)

    @property
    def summary(self) -> Mapping[str, object]:
        spec, choice = self.spec, self.spec.observer
        return {
            "name": spec.name,
            "coordinates": ", ".join(spec.positions),
            "contacts": ", ".join(c.name for c in spec.contacts) or "none",
            "effects": ", ".join(e.kind for e in spec.effects) or "none",
            "observer": "none" if choice is None else f"{choice.kind} ({choice.velocity} velocity)",
        }

    def with_spec(self, spec: Spec) -> Derived:
        """A machine of the same mechanics with another observer section."""
        return Derived(spec, self.overrides, self)

    def with_overrides(self, overrides: Overrides | None) -> Derived:
        """The same machine with the command's own choices for its code."""
        return self if overrides is None else Derived(self.spec, overrides, self)

    def generated_observer(self, precision: str, cancelling: bool = False) -> GeneratedObserver:
        """The generated observer for ``export``; with ``cancelling`` also its cancelling input."""
        from codegen.export.generated_observer import GeneratedObserver

        spec = self.spec
        if cancelling and spec.cancellation is None:
            spec = replace(spec, cancellation=CancellationChoice())
        machine = Derived(spec, Overrides(precision=precision), self)
        return GeneratedObserver(machine.program, machine.sources, lambda: machine.outcome)

    @cached_property
    def nominal(self) -> Derived:
        """The machine with its free gains at mid-range, for results that do not depend on their values."""
        spec = at_middle(self.spec)
        return self if spec is self.spec else self.with_spec(spec)

    @cached_property
    def system(self) -> System:
        """M, g, U and the contacts, declared effects included."""
        if self._origin is not None:
            return self._origin.system
        begin("building the model")
        return system_of(self.spec)

    def refuse_unknown_words(self) -> None:
        """Raise one BadInput for all faults of the system and all unknown names in the observer's section."""
        faults = Faults()
        with faults.noting():
            assert self.system
        if self.spec.observer is not None:
            with faults.noting():
                refuse_unknown_words(self.spec.observer, self.spec.place)
        faults.raise_noted()

    @cached_property
    def observer(self) -> Observer:
        """The observer's equations. Raises BadInput for a spec without one, or with free gains."""
        self.refuse_unknown_words()
        return observer_of(self.spec, self.system)

    @cached_property
    def dynamics(self) -> EvaluatedDynamics:
        """The error dynamics and their values over the envelope. Raises BadInput where these are not finite."""
        from codegen.analysis.operating_points import dynamics_over_envelope

        begin("error dynamics")
        return dynamics_over_envelope(self.spec, self.observer)

    @cached_property
    def analysis(self) -> Analysis:
        """Ψ, its characteristic polynomial, gain conditions and margins."""
        from codegen.analysis.analysis import judge

        return judge(self.spec, self.dynamics)

    @cached_property
    def program(self) -> Program:
        """The step as named blocks, the cancelling input included where the spec asks for it."""
        observer = self.observer
        begin("equations of the step")
        return _program(self.spec, observer)

    @cached_property
    def header(self) -> Header:
        """The origin that generated files state: spec, hashes and command.

        Raises BadInput for a file name that generated files cannot print.
        """
        from codegen.certify.certificate_text import rational_text
        from codegen.emit.header import make_header

        spec, options = self.spec, self.overrides.options
        envelope = {name: (rational_text(low), rational_text(high)) for name, (low, high) in spec.envelope.items()}
        return make_header(spec.path.name, spec.sha256, spec.source, spec.robot, options, envelope)

    @cached_property
    def sources(self) -> Mapping[str, str]:
        """File name → text of the C, the Python and the other targets."""
        assert self.program
        begin("printing the code")
        return _sources(self.spec, self)

    @cached_property
    def outcome(self) -> Certificate | Refusal:
        """The stability certificate of the sampled observer, bound to its sources, or the refusal.

        Raises BadInput for an envelope without a needed range, or a domain without a bound.
        """
        from codegen.certify.bound.error_bound import with_bounds
        from codegen.certify.certify import Certificate, certify

        hashes = {name: sha256(text) for name, text in self.sources.items()}
        of_spec = partial(certify, self.spec, self.analysis, hashes, self.header.command.raw)
        begin("certificate")
        outcome = of_spec()
        sources = {name: text.encode() for name, text in self.sources.items()}
        if isinstance(outcome, Certificate):
            begin("error bounds")
            bounded = with_bounds(self.spec, self.analysis, outcome)
            begin("proof of the C")
            found, refused = _with_kernel_proof(bounded, self, sources)
            angles = _narrow_angles(self.analysis) if refused else []
            if not angles and not (refused and FALLS_SHORT in found.not_by_kernel):
                return found
            begin("certificate over a cover")
            other = of_spec(all_angles=True)
            if isinstance(other, Certificate):
                turned, refused = _with_kernel_proof(with_bounds(self.spec, self.analysis, other), self, sources)
                return replace(found, not_by_kernel=turned.not_by_kernel) if refused else turned
            if not angles:
                return found
            names = " and ".join(angles)
            words = (
                f"V decreases for {names} in the envelope; of the C this is proved only for all values of the sine and "
                f"cosine of {names}, and no V was found for these"
            )
            return replace(found, not_by_kernel=f"{words}: {found.not_by_kernel}")
        if outcome.regions is not None and "sliding.json" in outcome.regions.proofs:
            return _with_sliding_proof(outcome, outcome.regions.proofs["sliding.json"], self, sources)
        return outcome

    @cached_property
    def files(self) -> Mapping[str, str]:
        """File name → text of all files of generated/NAME/."""
        from codegen.certify import REGION_PROOFS
        from codegen.certify.outcome import Certificate
        from codegen.checker.verify import PROOF, SETS
        from codegen.emit.package import emit_manifest, emit_readme

        outcome, sources = self.outcome, self.sources
        result = outcome.content if isinstance(outcome, Certificate) else outcome.reason
        ellipsoid = outcome.ellipsoid if isinstance(outcome, Certificate) else None
        bounds = outcome.bounds if isinstance(outcome, Certificate) and ellipsoid is not None else ()
        files = {**sources, **outcome.proofs}
        files["README.md"] = emit_readme(
            self.program,
            self.header,
            result,
            tuple(sources),
            outcome.proofs,
            outcome.kernel is not None,
            bounds,
            REGION_PROOFS,
        )
        if outcome.kernel is not None:
            files[PROOF] = outcome.kernel
        if ellipsoid is not None:
            files[SETS] = ellipsoid
        files["manifest.json"] = emit_manifest(self.header, files, outcome.not_made)
        return files


FALLS_SHORT = "V may not fall"
"""Words of a refusal of the kernel that another P or another cover may change."""
Source = Derived | str | Path
"""Argument of a verb: a machine, or the file of its spec."""


def derived_from(given: Source) -> Derived:
    """The machine of a verb's argument."""
    if isinstance(given, Derived):
        return given
    begin("reading the spec")
    return Derived(read_spec(given, refuse_unknown_words, refuse_unknown_forces))


@numerical("the generated step")
def _program(spec: Spec, observer: Observer) -> Program:
    from codegen.program import build_program

    with with_place(spec):
        if spec.cancellation is not None:
            from codegen.cancellation import with_cancellation  # with scipy.optimize, which few specs need

            observer = with_cancellation(spec, observer)
        return build_program(observer, spec.code)


@numerical("the generated step")
def _sources(spec: Spec, machine: Derived) -> Mapping[str, str]:
    from codegen.emit.package import emit_sources

    program, printers = machine.program, machine.overrides.printers
    with with_place(spec):
        return emit_sources(program, machine.header, printers)


def _with_sliding_proof(
    refusal: Refusal, sliding: Mapping[str, Any], machine: Derived, sources: Mapping[str, bytes]
) -> Refusal:
    """The refusal with a proof of sliding.json that the kernel accepts, or why there is none."""
    from codegen.certify.kernel_form import NotCovered
    from codegen.certify.sliding_form import sliding_proofs
    from codegen.checker import verify as checker

    why = ""
    try:
        for proof in sliding_proofs(machine.observer, machine.program.places, sliding):
            try:
                checker.by_kernel_alone(json.loads(proof), dict(sources))
            except checker.Refused as error:
                why = str(error)
            else:
                return replace(refusal, kernel=proof, not_by_kernel="")
    except NotCovered as error:
        why = str(error)
    return replace(refusal, not_by_kernel=why)


def _narrow_angles(analysis: Analysis) -> list[str]:
    """The angles in the error matrix's sines and cosines whose range in the envelope is less than a full turn."""
    from codegen.certify.cover import over_variables
    from codegen.certify.family import build_family

    family = build_family(analysis.dynamics, analysis.points.ranges)
    ranges = {a: family.variables[a] for a in over_variables(family)[1] if a in family.variables}
    return [a.name for a, (low, high) in ranges.items() if high - low < 2 * pi * (1 - 1e-6)]


def _with_kernel_proof(
    certificate: Certificate, machine: Derived, sources: Mapping[str, bytes]
) -> tuple[Certificate, bool]:
    """Add the kernel's proof of the C to a certificate, and with it the invariant ellipsoids under noise and drift.

    Returns:
        (certificate, refused): ``certificate.not_by_kernel`` says why if there is no proof; ``refused`` is whether the
        kernel was given one and did not accept it.
    """
    from codegen.certify.bound.ellipsoid import with_ellipsoid
    from codegen.certify.kernel_form import NotCovered, proof_text
    from codegen.checker import verify as checker
    from codegen.checker.errors import NOT_MOVED

    observer, places = machine.observer, machine.program.places
    if certificate.functions:
        why = f"the error matrix contains {', '.join(certificate.functions)}, which the proof of the C does not have"
        return replace(certificate, not_by_kernel=why), False
    try:
        proof = proof_text(observer, places, certificate.content)
        content = checker.parsed(certificate.text)
        _, shown, unproved = checker.of_its_proof(content, {**sources, checker.PROOF: proof.encode()})
    except (NotCovered, checker.Refused) as error:
        why = str(error)
        if NOT_MOVED in why and observer.system.distribution.has(*observer.system.positions):
            why = "the friction distribution U depends on the position, and exact estimates then move by a term in h**2"
        return replace(certificate, not_by_kernel=why), isinstance(error, checker.Refused)
    if unproved:
        return replace(certificate, kernel=None, not_by_kernel=unproved), True
    certificate = replace(certificate, kernel=proof, not_by_kernel="")
    return with_ellipsoid(certificate, machine.spec, observer, places, shown), False
