"""Peers in C with our interface: NAME_init and NAME_step over structs of doubles. Ours, and those written by hand."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from benchmarks.measure.build import C_FLAGS, Peer
from benchmarks.model import NUDGE, Model
from benchmarks.result import OURS
from benchmarks.text import render

SOURCES = Path(__file__).parent / "sources"


def our_peer(model: Model, title: str = OURS, fault: str = "hold", limit: float = 60.0) -> Peer:
    """The C that stiction generates, as a peer."""
    names = (f"{model.name}.c", f"{model.name}.h")
    files = {name: text for name, text in model.files(fault=fault).items() if name in names}
    sizes = len(model.program.inputs), len(model.output_names)
    return _with_loop(title, model.name, files, sizes, (), limit, len(model.program.states))


def hand_peer(name: str, title: str, width: int, outputs: int, **macros: str) -> Peer:
    """sources/NAME.c and .h, compiled with the macros."""
    files = {f"{name}{end}": (SOURCES / f"{name}{end}").read_text(encoding="utf-8") for end in (".c", ".h")}
    return _with_loop(title, name, files, (width, outputs), [f"-D{key}={value}" for key, value in macros.items()])


def _with_loop(
    title: str,
    name: str,
    files: Mapping[str, str],
    sizes: tuple[int, int],
    flags: list[str] | tuple[str, ...],
    limit: float = 60.0,
    states: int = 0,
) -> Peer:
    """A peer and its loop; of its state only the first ``states`` numbers are nudged, or all where that is 0."""
    width, outputs = sizes
    step = f"{name}_step"
    loop = render("loop_structs.c.j2", name=name, step=step, width=width, outputs=outputs, nudge=NUDGE, states=states)
    return Peer(title, {**files, "loop.c": loop}, step, width, outputs, flags=(*C_FLAGS, *flags), limit=limit)
