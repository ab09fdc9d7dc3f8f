"""``stiction schema``: the JSON Schema of a spec, for an editor."""

from __future__ import annotations

from pathlib import Path

from codegen.base.border import verb
from codegen.base.files import refuse_target, write_atomically
from codegen.base.result import json_text
from codegen.spec.schema import json_schema


def schema_text() -> str:
    """The schema as JSON."""
    return json_text(json_schema())


@verb
def write_schema(path: str | Path) -> Path:
    """Write the schema; a spec names it by ``# yaml-language-server: $schema=PATH`` in its first line.

    Raises:
        BadInput: for a file that cannot be written.
    """
    target = Path(path)
    refuse_target(target, None, (".json",))
    write_atomically(target, schema_text())
    return target
