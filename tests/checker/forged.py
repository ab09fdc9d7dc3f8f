"""Genuine generated files with a change, its hash stated: what a forger has."""

from __future__ import annotations

import copy
import hashlib
import json
from pathlib import Path
from typing import Any

from codegen.checker import verify

GENERATED = Path(__file__).parents[2] / "generated"
POINT = {"inputs.x": "0", "inputs.w": "1"} | dict.fromkeys(("true.v", "outputs.v_hat"), "4")
POINT |= dict.fromkeys(("true.a_rail", "outputs.a_hat_rail"), "40")
"""A witness for a domain of one_mass."""


def sources(name: str) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in (GENERATED / name).iterdir() if p.is_file()}


def certificate(name: str, proof: str = "certificate.json") -> Any:
    return json.loads((GENERATED / name / proof).read_text("utf-8"))


def check(content: Any, files: dict[str, bytes]) -> verify.Report:
    return verify.check(json.dumps(content), sources=files)


def changed(name: str, *pairs: tuple[str, str], end: str = "c") -> tuple[Any, dict[str, bytes]]:
    """A genuine certificate over a C (or a header) of which these texts are others, with that file's hash."""
    content, files, file = copy.deepcopy(certificate(name)), sources(name), f"{name}.{end}"
    text = files[file].decode()
    for old, new in pairs:
        assert old in text, old
        text = text.replace(old, new)
    content["subject"]["files"][file] = hashlib.sha256(text.encode()).hexdigest()
    return content, files | {file: text.encode()}


def replace_once(files: dict[str, str], pairs: dict[str, list[tuple[str, str]]]) -> None:
    """Replace texts in files, in place; each must occur exactly once. ``pairs``: file → (old, new) of each."""
    for file, changes in pairs.items():
        for old, new in changes:
            assert files[file].count(old) == 1, old
            files[file] = files[file].replace(old, new)
