"""The augmented spec: effects added and levels refitted in the author's own text, comments kept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from codegen.diagnosis.results import FoundEffect
from codegen.spec.model import Spec
from codegen.spec.yaml_text import dump, load_mapping

DIGITS = 6


def augmented_text(spec: Spec, effects: Sequence[FoundEffect], levels: Mapping[str, Mapping[str, float]]) -> str:
    """The spec's text with effects appended and friction levels replaced.

    Args:
        effects: as found.
        levels: contact → law parameter → refitted value.
    """
    document, _ = load_mapping(spec.text, str(spec.path))
    for contact in document["friction"]["contacts"]:
        for name, value in levels.get(contact["name"], {}).items():
            old = contact[name]
            contact[name] = _short(value)
            contact.yaml_add_eol_comment(f"refitted by diagnosis, was {old}", name, column=0)
    if not effects:
        return dump(document)
    entries = document.get("effects")
    if not isinstance(entries, CommentedSeq) or not entries:
        fresh = CommentedSeq()
        if isinstance(entries, CommentedSeq):
            fresh.ca.comment = entries.ca.comment
        document["effects"] = entries = fresh
    entries.fa.set_block_style()
    for effect in effects:
        entry = CommentedMap(kind=effect.kind, on=effect.on)
        parameters = CommentedMap({name: _short(value) for name, value in effect.parameters.items()})
        parameters.fa.set_flow_style()
        entry["parameters"] = parameters
        entry.fa.set_flow_style()
        entries.append(entry)
    return dump(document)


def _short(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
