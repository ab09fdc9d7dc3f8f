"""``stiction replay``: a spec's generated observer over a measured log."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from codegen.app.derived import Source, derived_from
from codegen.base.border import verb
from codegen.base.files import refuse_target
from codegen.logs.arrays import Given, as_files
from codegen.replay.engine import Engine
from codegen.replay.log_warnings import declared_friction, preflight_warnings
from codegen.replay.over_log import Replayed, replay_log
from codegen.replay.samples import Samples


@verb
def replay(
    source: Source,
    log: Given,
    out: str | Path | None = None,
    description: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
    only: Sequence[str] = (),
) -> Replayed:
    """Run the generated C of a spec's observer over a log.

    Args:
        log: CSV or .npy of any length, a log of another format, or arrays by the names of columns.
        out: CSV or .npy for the estimates; None writes nothing.
        description, columns: how the log names its columns.
        only: the outputs to write; all by default.

    Raises:
        BadInput: for a bad spec, log or output, or a log at another sample time than the observer's; or without a
            C compiler.
    """
    machine = derived_from(source)
    spec, program = machine.spec, machine.program
    target = Path(out) if out is not None else None
    with as_files(log=log) as ((path,),):
        if target is not None:
            refuse_target(target, {"the log itself": path, "the spec itself": spec.path})
        engine = Engine(program, machine.sources)
        samples = Samples(spec, program, float(machine.observer.sample_time), path, description, columns)
        declared = declared_friction(spec, machine.observer)
        result = replay_log(spec, program, engine, samples, declared, target, only)
        against = preflight_warnings(spec, path, description, columns, result.faults)
    notes = tuple(note for note in result.notes if note not in against)
    return replace(result, notes=notes, warnings=(*against, *result.warnings))  # causes before symptoms
