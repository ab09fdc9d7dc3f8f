"""Peers in C with our interface: NAME_init and NAME_step over structs of doubles. Ours, and those written by hand."""

from __future__ import annotations

from pathlib import Path

from benchmarks.model import NUDGE, Model
from benchmarks.peer import Peer
from benchmarks.result import OURS
from benchmarks.text import render

PEERS = Path(__file__).parent / "peers"


def our_peer(model: Model, fault: str = "hold", limit: float = 60.0) -> Peer:
    """What stiction generates."""
    files = {name: text for name, text in model.files(fault=fault).items() if name in (f"{model.name}.c", f"{model.name}.h")}
    return with_loop(OURS, model.name, files, len(model.program.inputs), len(model.program.outputs), limit)


def hand_peer(name: str, title: str, width: int, outputs: int, **numbers: str) -> Peer:
    """peers/NAME.c and .h; ``numbers`` are macros for both."""
    files = {f"{name}{end}": (PEERS / f"{name}{end}").read_text(encoding="utf-8") for end in (".c", ".h")}
    head = "".join(f"#define {key} {value}\n" for key, value in numbers.items())
    files[f"{name}.h"] = head + files[f"{name}.h"]
    return with_loop(title, name, files, width, outputs)


def with_loop(title: str, name: str, files: dict[str, str], width: int, outputs: int, limit: float = 60.0) -> Peer:
    """A peer from sources with our interface."""
    head = f'#include "{name}.h"\n#include <string.h>\n' + "\n".join(
        [
            f"static {name}_parameters parameters = {name.upper()}_PARAMETERS;",
            f"static {name}_state state;",
            f"static {name}_outputs outputs;",
        ]
    )
    loop = render(
        "loop.c.j2",
        step=f"{name}_step",
        about=title,
        head=head,
        start=f"{name}_init(&state, &parameters, (const {name}_inputs *)row);\n"
        f"for (int k = 0; k < (int)(sizeof state / sizeof(double)); k++) ((double *)&state)[k] += {NUDGE} * (k + 1);",
        call=f"{name}_step(&state, &parameters, (const {name}_inputs *)row, &outputs);",
        keep=f"memcpy(target, &outputs, {outputs} * sizeof(double));",
        width=width,
        outputs=outputs,
    )
    return Peer(title, {**files, "loop.c": loop}, f"{name}_step", width, outputs, limit=limit)
