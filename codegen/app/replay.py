"""``stiction replay`` as a function: a spec's generated observer over a measured log."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from codegen.base.border import verb
from codegen.base.files import refuse_target
from codegen.base.text import render
from codegen.cancellation import with_cancellation
from codegen.emit.package import emit_sources, make_header
from codegen.observers import Observer, observer_of
from codegen.program import Program, build_program
from codegen.replay.engine import engine_for
from codegen.replay.over_log import Replayed, replay_log
from codegen.replay.samples import Samples
from codegen.spec import Spec, read_spec
from codegen.spec.numerics import numerical


@verb
def replay(
    path: str | Path,
    log: str | Path,
    out: str | Path | None = None,
    description: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
    only: Sequence[str] = (),
) -> Replayed:
    """Run the generated C of a spec's observer over a log, or its Python twin where there is no C compiler.

    Args:
        log: CSV or .npy of any length, or .mat.
        out: CSV or .npy for the estimates; None writes nothing.
        description, columns: how the log names its columns.
        only: the outputs to write; all by default.

    Raises:
        BadInput: for a bad spec, log or output, or a log at another sample time than the observer's.
    """
    spec = read_spec(path)
    observer = observer_of(spec)
    program = _program(spec, observer)
    target = Path(out) if out is not None else None
    if target is not None:
        refuse_target(target, {"the log itself": Path(log), "the spec itself": spec.path})
    engine = engine_for(program, emit_sources(program, make_header(spec.path.name, spec.sha256, spec.source)))
    samples = Samples(spec, program, float(observer.sample_time), Path(log), description, columns, engine.holds)
    return replay_log(program, engine, samples, target, only)


@numerical("the step of the observer")
def _program(spec: Spec, observer: Observer) -> Program:
    return build_program(with_cancellation(spec, observer), spec.code)


__all__ = ["Replayed", "replay"]


def replayed_text(replayed: Replayed) -> str:
    """What was written, and how fast."""
    return render("text/replayed.txt.j2", r=replayed)
