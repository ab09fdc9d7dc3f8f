"""Codes of the errors that users see, with a title and advice each. A code stays when the words of a message change.

The letters say where the error is: SPEC in the spec or the robot file that it names, EFFECT in a file of a user's own
effects, LOG in a log or its description, FILE in a file or folder, CALL in the command's arguments, TOOL in another
program.
"""

import tomllib
from pathlib import Path

CODES: dict[str, tuple[str, str]] = {
    code: (meaning, advice)
    for code, (meaning, advice) in tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8")).items()
}
"""Code → (what is wrong, what to do)."""
