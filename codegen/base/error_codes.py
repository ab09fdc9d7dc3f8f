"""The codes of users' errors: what each says, and what to do. A code stays when the words of its messages change.

The letters say where the fault lies: SPEC the spec or the robot file that it names, EFFECT a file with effects of the
user's own, LOG a log or its description, FILE a file or folder, CALL the command's arguments, TOOL another program.
"""

from __future__ import annotations

import tomllib
from pathlib import Path

CODES: dict[str, tuple[str, str]] = {
    code: (meaning, advice)
    for code, (meaning, advice) in tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8")).items()
}
"""Code → (what is wrong, what to do)."""
