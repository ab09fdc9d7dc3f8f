"""Reader of a spec, text → Spec: names resolved, expressions parsed, units checked; nothing of the text is executed.

The functions that read a section, and those for numbers and units, raise BadInput at the line of a value that they
cannot use.
"""

import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import sympy

from codegen.base.errors import BadInput, Faults, Place, PlaceOf, nearest_name, refuse_unknown
from codegen.base.input_files import read_text
from codegen.base.user_text import foreign_letter
from codegen.spec.expression import exact_number, printed
from codegen.spec.model import Contact, Coordinate, DeclaredEffect, Input, LogColumns, Parameter, Spec, signal_units
from codegen.spec.motion import Sliding
from codegen.spec.motion_section import read_motion, refuse_no_form
from codegen.spec.observer_section import read_cancellation, read_observer
from codegen.spec.quantity import (
    read_deviation,
    read_factor,
    read_numbers,
    read_quantity,
    read_share,
    refuse_other_unit,
)
from codegen.spec.reserved import is_identifier, why_not_file, why_not_name
from codegen.spec.schema import ObserverSection, SpecDocument
from codegen.spec.simulation_section import read_simulation
from codegen.spec.units import inertia_for, require_coherent, same_dimension, si_factor, unit_name
from codegen.spec.urdf_section import expand_robot
from codegen.spec.validation import nearest_place, validate, with_known_keys
from codegen.spec.yaml_text import SPEC_FIRST, load_plain

TOLERANCE = "tolerance"
"""A key of parameters and effects that contacts do not have."""
OTHER_UNITS = "logs in other units are converted by `units:` in their meta.yaml"
ObserverCheck = Callable[[ObserverSection, PlaceOf], None]
"""Function (section, key → its file and line) that raises BadInput for what stands in an observer's section."""
ForceCheck = Callable[[Spec], None]
"""Function that raises BadInput for the laws and effects of a spec, which may lack what could not be read."""


def read_spec(path: str | Path, of_observer: ObserverCheck | None = None, of_forces: ForceCheck | None = None) -> Spec:
    """The validated spec of a file.

    ``of_observer`` and ``of_forces`` are further checks, of the observer's section and of laws and effects, made and
    raised only together with other faults. Raises BadInput for an invalid path, a robot file, or faults in the spec,
    with file and line; ``others`` has further faults.
    """
    if not isinstance(path, str | os.PathLike):
        raise BadInput("the path of a spec", f"{path!r}", "text, or a Path", code="CALL001")
    if isinstance(path, str) and "\n" in path.strip():
        found = f"text of {len(path.splitlines())} lines"
        expected = "the path of a spec file; save a spec that you have as text to a file"
        raise BadInput("the path of a spec", found, expected, code="CALL001")
    path = Path(path)
    try:
        text = read_text(path, "a spec file (YAML)")
    except BadInput as error:
        if error.code not in ("FILE002", "FILE006") or path.suffix.lower() in (".yaml", ".yml"):
            raise
        raise BadInput(error.place, error.found, error.expected + SPEC_FIRST, code=error.code) from None
    _refuse_robot_file(text, path)
    return parse_spec(text, path, of_observer, of_forces)


def _refuse_robot_file(text: str, path: Path) -> None:
    """Raise BadInput, with a hint to ``init``, for a robot description or a MuJoCo model instead of a spec."""
    if text.lstrip("\N{ZERO WIDTH NO-BREAK SPACE} \t\r\n").startswith("<"):
        mujoco, urdf = "<mujoco" in text, "<robot" in text
        found = "a MuJoCo model (MJCF)" if mujoco else "a robot description (URDF)" if urdf else "XML"
        made = f"; `stiction init {path.name}` writes one for it" if mujoco or urdf else ""
        raise BadInput(str(path), found, f"a spec file (YAML){made}", code="SPEC001")


def parse_spec(
    text: str, path: Path, of_observer: ObserverCheck | None = None, of_forces: ForceCheck | None = None
) -> Spec:
    """The validated spec of a text; ``path`` is for messages, the checks are as of ``read_spec``."""
    return _Reading(text, path).spec(of_observer, of_forces)


class _Reading:
    """Reading of one file: its document, the places of its keys, and the faults so far."""

    def __init__(self, text: str, path: Path) -> None:
        self.text, self.path, self.faults = text, path, Faults()
        document, self.places = load_plain(text, str(path))
        filled, self.tree = expand_robot(document, path, self.places)
        try:
            self.document = validate(SpecDocument, filled, self.places, str(path))
        except BadInput as fault:
            self.faults.noted.append(fault)
            if isinstance(filled, dict):
                meant = [nearest_name(str(key), SpecDocument.model_fields) or key for key in filled]
                self.faults.result(refuse_no_form, meant, self.place)
            document = with_known_keys(SpecDocument, filled)
            if document is None:
                self.faults.raise_noted()
            assert document is not None
            self.document = document

    def place(self, key: str) -> Place:
        return nearest_place(key, self.places, str(self.path))

    def spec(self, of_observer: ObserverCheck | None, of_forces: ForceCheck | None) -> Spec:
        """The spec; raises all faults that were found, those of keys first."""
        spec = self.faults.result(self._spec)
        # Without other faults the system is built, and its faults are raised together with those of the observer.
        if self.faults.noted and spec is not None and of_forces is not None:
            self.faults.result(of_forces, spec)
        if self.faults.noted and of_observer is not None and self.document.observer is not None:
            self.faults.result(of_observer, self.document.observer, self.place)
        self.faults.raise_noted()
        assert spec is not None
        return spec

    def _spec(self) -> Spec:
        """The spec, without what could not be read of sections that nothing else depends on."""
        d = self.document
        self.faults.result(self._check_file)
        coordinates = tuple(Coordinate(name, c.velocity, c.unit) for name, c in d.coordinates.items())
        if not coordinates:
            raise BadInput(self.place("coordinates"), "no coordinate", "at least one", code="SPEC003")
        inputs = tuple(Input(name, i.unit) for name, i in d.inputs.items())
        parameters = tuple(p for p in (self.faults.result(self._parameter, name) for name in d.parameters) if p)
        self._check_names(coordinates, inputs, d.parameters)
        for c in coordinates:
            self.faults.result(self._position_unit, c)
        for i in inputs:
            self.faults.result(self._si_unit, i.unit, f"inputs.{i.name}.unit")
        named = not self.faults.noted
        for k in range(len(d.friction.contacts)):
            self.faults.result(self._refuse_tolerance, k)
        if not named:  # sections that depend on names and units are read only if these are valid
            read = [self.faults.result(self._contact, k, None) for k in range(len(d.friction.contacts))]
            if all(read):
                self.faults.result(read_observer, d.observer, [c for c in read if c], self.place)
            for k in range(len(d.effects)):
                self.faults.result(self._effect, k)
            self.faults.raise_noted()
        coordinates = tuple(replace(c, unit=self._position_unit(c)) for c in coordinates)
        inputs = tuple(replace(i, unit=self._si_unit(i.unit, f"inputs.{i.name}.unit")) for i in inputs)

        motion = self.faults.result(read_motion, d, coordinates, inputs, self.place, self.tree)
        slidings = motion.slidings if motion else (None,) * len(d.friction.contacts)
        contacts = [self.faults.result(self._contact, i, sliding) for i, sliding in enumerate(slidings)]
        friction = tuple(contact for contact in contacts if contact)
        effects = [self.faults.result(self._effect, i) for i in range(len(d.effects))]
        observer = cancellation = None
        if len(friction) == len(contacts):
            observer = self.faults.result(read_observer, d.observer, friction, self.place)
            cancellation = self.faults.result(read_cancellation, d.cancellation, friction, self.place)
        units = self._envelope_units(coordinates, inputs)
        ranges = {name: self.faults.result(self._range, name, units) for name in d.envelope}
        envelope = {name: bounds for name, bounds in ranges.items() if bounds is not None}
        simulation = self.faults.result(read_simulation, d.simulation, coordinates, inputs, self.place)
        log = self.faults.result(self._log, signal_units(coordinates, inputs)) or LogColumns()
        if motion is None or len(friction) < len(contacts) or not all(effects):
            self.faults.raise_noted()
        assert motion is not None
        return Spec(
            name=d.name,
            source=d.source,
            coordinates=coordinates,
            inputs=inputs,
            parameters=parameters,
            mass_matrix=motion.mass_matrix,
            force=motion.force,
            distribution=motion.distribution,
            form=motion.form,
            contacts=friction,
            effects=tuple(effect for effect in effects if effect),
            observer=observer,
            envelope=envelope,
            simulation=simulation,
            log=log,
            text=self.text,
            path=self.path,
            places=self.places,
            code=d.code,
            cancellation=cancellation,
        )

    def _check_file(self) -> None:
        """Note a name that no generated file can have, and a line of ``source`` that C would join to the next one."""
        name, faults = self.document.name, self.faults
        with faults.noting():
            self._name(name, "name")
            if why := why_not_file(name):
                found = f"the name `{name}`, {why}"
                raise BadInput(self.place("name"), found, "another name", f"{name}_axis", code="SPEC009")
        if any(line.rstrip().endswith(("\\", "??/")) for line in self.document.source.splitlines()[:-1]):
            found = "a line that ends in a backslash, or in ??/, which C reads as one"
            expected = "text without a backslash or ??/ at the end of a line"
            raise BadInput(self.place("source"), found, expected, code="SPEC006")

    def _name(self, name: str, key: str) -> None:
        if not is_identifier(name) or len(name) > 60:
            expected = "at most 60 letters a to z, digits and _, starting with a letter"
            near = re.sub(r"\W", "_", name, flags=re.ASCII)[:60]
            nearest = near if is_identifier(near) else None
            found = f"the name `{name}`{foreign_letter(name)}"
            raise BadInput(self.place(key), found, expected, nearest, code="SPEC009")
        if why := why_not_name(name, self.document.name):
            nearest = None if why_not_name(f"{name}_", self.document.name) else f"{name}_"
            raise BadInput(self.place(key), f"the name `{name}`, {why}", "another name", nearest, code="SPEC009")

    def _check_names(
        self, coordinates: Iterable[Coordinate], inputs: Iterable[Input], parameters: Iterable[str]
    ) -> None:
        seen: dict[str, str] = {}
        named = [(c.name, f"coordinates.{c.name}") for c in coordinates]
        named += [(c.velocity, f"coordinates.{c.name}.velocity") for c in coordinates]
        named += [(i.name, f"inputs.{i.name}") for i in inputs] + [(name, f"parameters.{name}") for name in parameters]
        for name, key in named:
            with self.faults.noting():
                self._name(name, key)
                if name in seen:
                    found = f"the name `{name}`, which {self.place(seen[name])} uses already"
                    raise BadInput(self.place(key), found, "two different names", code="SPEC009")
            seen.setdefault(name, key)

    def _si_unit(self, text: str, key: str, remedy: str = OTHER_UNITS) -> str:
        """The name of a unit in which code takes and returns values; ``remedy`` as of ``require_coherent``."""
        require_coherent(text, self.place(key), remedy)
        return unit_name(text, self.place(key))

    def _position_unit(self, coordinate: Coordinate) -> str:
        """The name of a coordinate's unit, m or rad; raises BadInput for another one."""
        key = f"coordinates.{coordinate.name}.unit"
        unit = self._si_unit(coordinate.unit, key)
        if not any(same_dimension(unit, own, self.place(key)) for own in ("m", "rad")):
            expected = "m or rad: a coordinate is a position or an angle; a current, a voltage or a force is an input"
            raise BadInput(self.place(key), f"unit {coordinate.unit}", expected, code="SPEC014")
        return unit

    def _parameter(self, name: str) -> Parameter:
        section, key = self.document.parameters[name], f"parameters.{name}"
        declared = exact_number(section.value, self.place(f"{key}.value"))
        exact = declared * self._factor(name, section.unit, self.place(f"{key}.unit"))
        value = printed(exact, self.place(f"{key}.value"), f"{section.value} {section.unit} in SI units")
        text, at = section.tolerance, self.place(f"{key}.{TOLERANCE}")
        deviation = None if text is None else read_deviation(text, section.unit, at)
        share = self._tolerance(text, key) if deviation is None else None
        return Parameter(name, value, section.unit, declared, share, deviation)

    def _tolerance(self, text: str | None, key: str) -> float | None:
        return None if text is None else read_share(text, self.place(f"{key}.{TOLERANCE}"))

    def _factor(self, name: str, unit: str, place: Place) -> sympy.Rational:
        """Factor of a parameter's unit to SI; for an ambiguous unit in the mass matrix, an inertia is suggested.

        For a value in percent, it is suggested as a number.
        """
        try:
            return si_factor(unit, place)
        except BadInput as error:
            if unit.strip() == "%":
                share = float(exact_number(self.document.parameters[name].value, place)) / 100
                nearest = f"value: {share:.15g}, unit: 1"
                raise BadInput(place, error.found, "a unit, or 1", nearest, code=error.code) from None
            inertia = inertia_for(error.nearest)
            if inertia and re.search(rf"\b{re.escape(name)}\b", str(self.document.mass_matrix or "")):
                raise BadInput(place, error.found, error.expected, inertia, code=error.code) from None
            raise

    def _contact(self, index: int, sliding: Sliding | None) -> Contact:
        section, key = self.document.friction.contacts[index], f"friction.contacts[{index}]"
        self._name(section.name, f"{key}.name")
        if section.name in {c.name for c in self.document.friction.contacts[:index]}:
            found = f"a second contact `{section.name}`"
            raise BadInput(self.place(f"{key}.name"), found, "a different name for each contact", code="SPEC009")
        given = {name: value for name, value in (section.model_extra or {}).items() if not _is_tolerance(name)}
        bare = next((f"{name}: {value}" for name, value in given.items() if isinstance(value, int | float)), "a: 5")
        unit = self._si_unit(section.unit, f"{key}.unit", f"a number may have its own, `{bare} {section.unit}`")
        values, units = read_numbers(given, key, self.place)
        return Contact(section.name, section.law, unit, values, sliding, units)

    def _refuse_tolerance(self, index: int) -> None:
        """Raise BadInput for a tolerance of a contact, which would be read as a parameter of its law."""
        for key in self.document.friction.contacts[index].model_extra or {}:
            if _is_tolerance(key):
                place = self.place(f"friction.contacts[{index}].{key}")
                expected = "no tolerance for a friction law: a diagnosis fits friction levels freely"
                raise BadInput(place, f"unknown key `{key}`", expected, code="SPEC004")

    def _effect(self, index: int) -> DeclaredEffect:
        section, key = self.document.effects[index], f"effects[{index}]"
        values, units = read_numbers(section.parameters, f"{key}.parameters", self.place)
        tolerance = self._tolerance(section.tolerance, key)
        return DeclaredEffect(section.kind, tuple(section.on), values, units, tolerance)

    def _envelope_units(self, coordinates: Sequence[Coordinate], inputs: Sequence[Input]) -> dict[str, str]:
        """Name → SI unit, of every quantity that may have a range in the envelope."""
        units = signal_units(coordinates, inputs)
        del units["t"]
        for c in coordinates:
            units |= {f"{c.velocity}_dot": f"{c.unit}/s^2", f"{c.name}_noise": c.unit}
        for contact in self.document.friction.contacts:
            units |= {f"a_{contact.name}": contact.unit, f"f_{contact.name}": contact.unit}
            units[f"f_{contact.name}_dot"] = f"({contact.unit})/s"
        return units

    def _range(self, name: str, units: Mapping[str, str]) -> tuple[Any, Any]:
        key, (low, high) = f"envelope.{name}", self.document.envelope[name]
        plain = [n for n in units if not n.endswith(("_dot", "_noise")) and not n.startswith("f_")]
        expected = f"one of {', '.join(plain)}; with _dot or _noise behind it; or f_ with a contact's name"
        refuse_unknown(name, units, self.place(key), "unknown name", expected, code="SPEC008")
        places = self.place(f"{key}[0]"), self.place(f"{key}[1]")
        bounds = read_quantity(low, units[name], places[0]), read_quantity(high, units[name], places[1])
        if not bounds[0] < bounds[1]:
            turned = f"[{high}, {low}]" if bounds[1] < bounds[0] else None
            expected = "a range [low, high] with low < high"
            raise BadInput(self.place(key), f"[{low}, {high}]", expected, turned, code="SPEC007")
        return bounds

    def _log(self, units: Mapping[str, str]) -> LogColumns:
        section = self.document.log
        if section is None:
            return LogColumns()
        for key, names in (("columns", section.columns), ("scale", section.scale)):
            for name in names:
                refuse_unknown(name, sorted(units), self.place(f"log.{key}.{name}"), "unknown name", code="SPEC008")
        scale = {}
        for name, text in section.scale.items():
            where = self.place(f"log.scale.{name}")
            scale[name], unit = read_factor(text, where)
            refuse_other_unit(unit, units[name], f"`{text}`", where)
        place = self.place("log.cutoff_hz")
        cutoff = float(read_quantity(section.cutoff_hz, "1/s", place)) if section.cutoff_hz else None
        return LogColumns(dict(section.columns), scale, cutoff, dict(section.published))


def _is_tolerance(key: str) -> bool:
    """Whether a key is `tolerance`, or means it, as `tol`."""
    return nearest_name(key, [TOLERANCE]) is not None
