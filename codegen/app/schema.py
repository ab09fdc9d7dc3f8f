"""``stiction schema``: the JSON Schema of a spec, for an editor."""

from __future__ import annotations

import json
from pathlib import Path

from codegen.base.border import verb
from codegen.base.files import refuse_target, write_atomically
from codegen.spec.schema import json_schema


def schema_text() -> str:
    """The schema as JSON."""
    return json.dumps(json_schema(), indent=1, ensure_ascii=False) + "\n"


@verb
def write_schema(path: str | Path) -> Path:
    """Write the schema; a spec names it by ``# yaml-language-server: $schema=PATH`` in its first line.

    Raises:
        BadInput: for a file that is not to be written.
    """
    target = Path(path)
    refuse_target(target, None, (".json",))
    write_atomically(target, schema_text())
    return target
