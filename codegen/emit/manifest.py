"""manifest.json of a folder of generated files: the SHA-256 of each, and of what the manifest itself says."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from codegen.base.files import sha256

OWN = "sha256"
"""The field with the hash of all other fields, as JSON without blanks: line ends and layout may change."""


def manifest_text(content: Mapping[str, Any]) -> str:
    """The manifest with these fields, and its own hash in place of one that is among them."""
    fields = {name: value for name, value in content.items() if name != OWN}
    return json.dumps({**fields, OWN: _hash(fields)}, indent=2) + "\n"


def is_edited(text: str) -> bool:
    """Whether a manifest has another hash of its own than that of what it says; one of an older version has none."""
    try:
        content = json.loads(text)
        stated = content.pop(OWN, None)
    except (ValueError, AttributeError, TypeError, RecursionError):
        return False
    return stated is not None and stated != _hash(content)


def _hash(fields: Mapping[str, Any]) -> str:
    return sha256(json.dumps(fields, separators=(",", ":")))
