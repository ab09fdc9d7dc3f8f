"""The suggested gains written into the author's own text, comments kept."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from codegen.analysis.feasibility.axes import GainAxis
from codegen.analysis.feasibility.suggest import Suggestion
from codegen.spec.free_gains import gain_entries
from codegen.spec.model import FreeGain, Spec
from codegen.spec.yaml_text import changed_text, load_mapping

DIGITS = 6


def suggested_text(spec: Spec, axes: Sequence[GainAxis], suggestion: Suggestion) -> str:
    """The spec's text with the suggested gains in place of the free or chosen ones, and a comment."""
    assert spec.observer is not None
    document, _ = load_mapping(spec.text, str(spec.path))
    section = document["observer"]
    gains = section["gains"]
    before = {(e.gain, e.path): e.value for e in gain_entries(spec.observer.gains)}
    for axis in axes:
        for (gain, path), weight in axis.entries.items():
            _place(gains, (gain, *path), _plain(weight * suggestion.numbers[axis.name]))
    for name in dict.fromkeys(gain for axis in axes for gain, _ in axis.entries):
        was = ", ".join(_words(value) for (gain, _), value in before.items() if gain == name)
        _comment(section, gains, name, f"{name} suggested by stiction gains, was {was}")
    return changed_text(spec.text, document)


def _place(gains: CommentedMap, keys: tuple[Any, ...], number: float | int) -> None:
    """Write a number at gains[k][k]…."""
    parent: CommentedMap | CommentedSeq = gains
    for key in keys[:-1]:
        parent = parent[key]
    parent[keys[-1]] = number


def _comment(section: CommentedMap, gains: CommentedMap, name: str, note: str) -> None:
    """Append a comment to the gain, or after the whole mapping where it is on one line; old comments stay."""
    parent, key = (section, "gains") if gains.fa.flow_style() else (gains, name)
    tokens = [t for t in (parent.ca.items.get(key) or []) if t is not None and not isinstance(t, list)]
    words = "; ".join(t.value.strip().lstrip("# ") for t in tokens if t.value.strip())
    parent.yaml_add_eol_comment(f"{words}; {note}" if words else note, key, column=0)


def _words(value: Any) -> str:
    return f"free {float(value.low):g} to {float(value.high):g}" if isinstance(value, FreeGain) else str(value)


def _plain(value: float) -> float | int:
    short = float(f"{value:.{DIGITS}g}")
    return int(short) if short.is_integer() and abs(short) < 1e6 else short
