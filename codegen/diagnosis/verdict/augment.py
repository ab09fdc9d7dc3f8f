"""The augmented spec: effects and refitted values written into the author's own text, comments kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from codegen.diagnosis.results import FoundEffect
from codegen.effects.declare import declared_symbols, written_place
from codegen.mechanics.base_parameters import base_values
from codegen.mechanics.system import System
from codegen.spec.model import Spec
from codegen.spec.motion import KinematicTree
from codegen.spec.yaml_text import changed_text, load_mapping

DIGITS = 6


def augmented_text(spec: Spec, effects: Sequence[FoundEffect], values: Mapping[str, float], system: System) -> str:
    """The spec's text with effects appended, and with levels and uncertain parameters replaced by values in SI."""
    document, _ = load_mapping(spec.text, str(spec.path))
    if document.get("friction") is None:
        _write_out_joints(document, spec)
    if effects:
        _list_effects_by_line(document)
    for index, contact in enumerate(system.contacts):
        for name, s in contact.law_parameters.items():
            if s.name in values:
                place = ("friction", "contacts", index, name)
                _replace(document, place, values[s.name], float(system.values[s]))
    for parameter in spec.parameters:
        if parameter.name in values and parameter.value != 0:
            share = values[parameter.name] / float(parameter.value)
            _replace(document, ("parameters", parameter.name, "value"), float(parameter.declared) * share)
    for index, symbols in enumerate(declared_symbols(system, spec)):
        for name, s in symbols.items():
            if s.name in values:
                _replace(document, ("effects", index, "parameters", name), values[s.name])
    _write_links(document, spec, values)
    for effect in effects:
        parameters = _flow({name: _short(value) for name, value in effect.parameters.items()})
        entry = {"kind": effect.kind, "on": written_place(effect.on), "parameters": parameters}
        document["effects"].append(_flow(entry))
    return changed_text(spec.text, document)


def _list_effects_by_line(document: CommentedMap) -> None:
    """Make the section of effects a list with a line for each, also where it is missing or empty."""
    entries = document.get("effects")
    if not isinstance(entries, CommentedSeq) or not entries:
        fresh = CommentedSeq()
        if isinstance(entries, CommentedSeq):
            fresh.ca.comment = entries.ca.comment
        document["effects"] = entries = fresh
    entries.fa.set_block_style()


def _flow(values: Mapping[str, object]) -> CommentedMap:
    """A mapping on one line."""
    written = CommentedMap(values)
    written.fa.set_flow_style()
    return written


def _write_out_joints(document: CommentedMap, spec: Spec) -> None:
    """Write the joint friction of a robot file into the spec, where it can be changed.

    A ``friction:`` section replaces all of the file's <dynamics>, so the damping is written as effects.
    """
    contacts = CommentedSeq()
    for c in spec.contacts:
        values = {name: _short(float(value)) for name, value in c.parameters.items()}
        contacts.append(_flow({"name": c.name, "law": c.law, "unit": c.unit, **values}))
    document["friction"] = CommentedMap(contacts=contacts)
    effects = CommentedSeq()
    for e in spec.effects:
        parameters = CommentedMap({name: _short(float(value)) for name, value in e.parameters.items()})
        known = {} if e.tolerance is None else {"tolerance": f"{_short(100 * e.tolerance):g} %"}
        effects.append(_flow({"kind": e.kind, "on": list(e.on), "parameters": parameters, **known}))
    if effects:
        document["effects"] = effects


def _write_links(document: CommentedMap, spec: Spec, values: Mapping[str, float]) -> None:
    """Write refitted base parameters next to the robot file's name; they replace the file's values."""
    if not isinstance(spec.form, KinematicTree):
        return
    nominal = base_values(spec, spec.form)
    moved = {name: value for name, value in values.items() if name in nominal}
    if not moved:
        return
    section = document["urdf"]
    if section.get("base_parameters") is None:
        section["base_parameters"] = CommentedMap()
        section.fa.set_block_style()
    section["base_parameters"].fa.set_block_style()
    for name, value in moved.items():
        _replace(document, ("urdf", "base_parameters", name), value, float(nominal[name]))


def _replace(document: CommentedMap, place: Sequence[str | int], value: float, default: float = 0.0) -> None:
    """Replace the number at the keys ``place``, or number and unit, and note the old value, or the default.

    The note stands at the end of the line, behind the outermost bracket that is open there.
    """
    *above, key = place
    noted: tuple[CommentedMap | CommentedSeq, str | int] | None = None
    section: Any = document
    for k in above:
        parent, section = section, section[k]
        if noted is None and section.fa.flow_style():
            noted = parent, k
    old = section.get(key, default)
    if isinstance(old, (int, float)) and float(old) == _short(value):
        return
    section[key] = _short(value)
    line, entry = noted or (section, key)
    _note(line, entry, f"{key} refitted by diagnosis, was {old}")


def _note(parent: CommentedMap | CommentedSeq, key: str | int, note: str) -> None:
    """Add to the comment at the end of the line of ``parent[key]``; lines of comment below it stay as they are."""
    slots = parent.ca.items.get(key) or []
    # The slot of an end-of-line comment: of a list the first, of a mapping the third.
    at = 0 if isinstance(parent, CommentedSeq) else 2
    token = slots[at] if len(slots) > at else None
    beside, newline, below = token.value.partition("\n") if token else ("", "", "")
    words = beside.strip().lstrip("# ")
    parent.yaml_add_eol_comment(f"{words}; {note}" if words else note, key, column=0)
    if below:
        parent.ca.items[key][at].value += newline + below


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
