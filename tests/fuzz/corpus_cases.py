"""Faults that were found once, as small files: ``corpus/FAMILY/CLASS_OF_FAULT/``, each the files of one case."""

from __future__ import annotations

from pathlib import Path

from . import log_cases, proof_cases, spec_cases
from .case import Case

CORPUS = Path(__file__).with_name("corpus")


def folders() -> list[Path]:
    """The folders in order; the place of one is its seed."""
    return sorted(path for path in CORPUS.glob("*/*") if path.is_dir())


def corpus(seed: int) -> Case:
    """The files of a fault through the stages of its family; a spec's folder may begin with the verb that saw it."""
    folder = folders()[seed]
    files = {path.name: path.read_bytes() for path in sorted(folder.iterdir())}
    if folder.parent.name == "log":
        (name,) = [name for name in files if name != "meta.yaml"]
        return Case(files, log_cases.stages(name))
    if folder.parent.name == "proof":
        name = next(name for name in files if name.endswith(".json"))
        return Case({name: files.pop(name), **files}, proof_cases.stages(name))
    deeper = [verb for verb in spec_cases.DEEPER if folder.name.startswith(f"{verb[0]}_")]
    return Case(files, (spec_cases.check_stage(), *map(spec_cases.verb_stage, deeper)))
