"""The augmented spec: found effects and refitted values in the author's own text, whose comments are kept."""

from collections.abc import Mapping, Sequence
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from codegen.diagnosis.results import FoundEffect
from codegen.effects import CATALOGUE
from codegen.effects.declare import declared_symbols, written_place
from codegen.mechanics.base_parameters import base_values
from codegen.mechanics.system import System
from codegen.spec.model import Spec
from codegen.spec.motion import KinematicTree
from codegen.spec.yaml_text import changed_text, load_mapping

DIGITS = 6
"""Significant digits of a written number."""


def augmented_text(spec: Spec, effects: Sequence[FoundEffect], values: Mapping[str, float], system: System) -> str:
    """The spec's text with the found effects and the refitted values in place of the declared ones.

    A found effect is appended, or added to a declared one of its kind and place where their parameters add up. Each
    replaced value is noted in a comment at the end of its line. Friction levels and parameters of effects are
    written in SI, parameters of the model in the unit of their declaration.

    Args:
        values: name of a friction level, model parameter, effect parameter or base parameter → refitted value in SI.
        system: that of the spec; it has the names of the levels and of the declared effects' parameters.
    """
    document, _ = load_mapping(spec.text, str(spec.path))
    if document.get("friction") is None:
        _write_out_joints(document, spec)
    if effects:
        _list_effects_by_line(document)
    for index, contact in enumerate(system.contacts):
        for name, s in contact.law_parameters.items():
            if s.name in values:
                path = ("friction", "contacts", index, name)
                _replace(document, path, values[s.name], float(system.values[s]))
    for parameter in spec.parameters:
        if parameter.name in values and parameter.value != 0:
            in_its_unit = float(parameter.declared) * values[parameter.name] / float(parameter.value)
            _replace(document, ("parameters", parameter.name, "value"), in_its_unit)
    declared = declared_symbols(system, spec)
    more = [_declared_place(effect, spec) for effect in effects]
    for index, symbols in enumerate(declared):
        found = [effect.parameters for effect, at in zip(effects, more, strict=True) if at == index]
        for name, s in symbols.items():
            if s.name in values or found:
                value = values.get(s.name, float(system.values[s])) + sum(part[name] for part in found)
                how = "changed" if found else "refitted"
                _replace(document, ("effects", index, "parameters", name), value, how=how)
    _write_links(document, spec, values)
    for effect in (effect for effect, at in zip(effects, more, strict=True) if at is None):
        parameters = _flow({name: _short(value) for name, value in effect.parameters.items()})
        entry = {"kind": effect.kind, "on": written_place(effect.on), "parameters": parameters}
        document["effects"].append(_flow(entry))
    return changed_text(spec.text, document)


def _declared_place(effect: FoundEffect, spec: Spec) -> int | None:
    """The index of the declared effect to whose parameters those of a found one are added; None if there is none."""
    for index, e in enumerate(spec.effects):
        at = sorted(e.on) == sorted(effect.on.split(", "))  # of two coordinates the order has no meaning
        same = at and (e.kind, {*e.parameters}) == (effect.kind, {*effect.parameters})
        if same and CATALOGUE[e.kind].with_parameters(list(e.parameters)).adds_up:
            return index
    return None


def _list_effects_by_line(document: CommentedMap) -> None:
    """Make the section ``effects:`` a list with one line per effect; an empty list where it is missing or empty."""
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
    """Copy the joint friction of a robot file into the spec, so that its values can be replaced there.

    A ``friction:`` section overrides the file's <dynamics> completely, friction and damping. The damping is therefore
    copied too, as viscous effects.
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
    """Write refitted base parameters into the section ``urdf:``, where they override those of the robot file."""
    if not isinstance(spec.form, KinematicTree):
        return
    nominal = base_values(spec, spec.form)
    refitted = {name: value for name, value in values.items() if name in nominal}
    if not refitted:
        return
    section = document["urdf"]
    if section.get("base_parameters") is None:
        section["base_parameters"] = CommentedMap()
        section.fa.set_block_style()
    section["base_parameters"].fa.set_block_style()
    for name, value in refitted.items():
        _replace(document, ("urdf", "base_parameters", name), value, float(nominal[name]))


def _replace(
    document: CommentedMap, path: Sequence[str | int], value: float, default: float = 0.0, how: str = "refitted"
) -> None:
    """Replace a number, or a number with its unit, and state the old value in a comment at the end of its line.

    A collection in brackets (flow style) has no comments inside; there the comment follows the outermost bracket.

    Args:
        default: the old value if there is no such key yet.
        how: "refitted", or "changed" where an effect that was found is added.
    """
    *above, key = path
    outermost: tuple[CommentedMap | CommentedSeq, str | int] | None = None
    section: Any = document
    for k in above:
        parent, section = section, section[k]
        if outermost is None and section.fa.flow_style():
            outermost = parent, k
    old = section.get(key, default)
    if isinstance(old, (int, float)) and float(old) == _short(value):
        return
    section[key] = _short(value)
    parent, entry = outermost or (section, key)
    _append_comment(parent, entry, f"{key} {how} by diagnosis, was {' '.join(str(old).split())}")


def _append_comment(parent: CommentedMap | CommentedSeq, key: str | int, note: str) -> None:
    """Append ``note`` to the comment at the end of the line of ``parent[key]``, after a semicolon."""
    slots = parent.ca.items.get(key) or []
    # The slot of an end-of-line comment: of a list the first, of a mapping the third.
    at = 0 if isinstance(parent, CommentedSeq) else 2
    token = slots[at] if len(slots) > at else None
    same_line, newline, below = token.value.partition("\n") if token else ("", "", "")
    words = same_line.strip().lstrip("# ")
    parent.yaml_add_eol_comment(f"{words}; {note}" if words else note, key, column=0)
    if below:
        parent.ca.items[key][at].value += newline + below


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
