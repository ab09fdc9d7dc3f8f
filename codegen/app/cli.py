"""The process of the command ``stiction``: its exit statuses, and the messages of faults, whatever verb runs.

Typer and Rich take a fifth of a second. They are imported for all but ``verify FILE``, which needs neither.
"""

import contextlib
import io
import os
import re
import shlex
import sys
import traceback
from collections.abc import Sequence
from functools import cache
from typing import Any, NoReturn

from codegen.base.errors import BadInput, brief
from codegen.base.interrupt import interrupted, interrupts_noted
from codegen.base.python_words import within_command

INTERNAL, INTERRUPTED = 70, 130
TRACEBACK = "STICTION_TRACEBACK"
"""The environment variable that adds the traceback to an internal error."""
MOST_FAULTS = 20
"""Faults of one file that are shown at once."""


def main() -> None:
    """Run a verb. Bad input gives messages and exit status 2, a fault of stiction a message and 70; no traceback."""
    raw = getattr(sys.stdout, "buffer", None)
    if isinstance(raw, io.RawIOBase):  # python -u, where a partial write would lose the rest
        sys.stdout = io.TextIOWrapper(io.BufferedWriter(raw), sys.stdout.encoding)
    for stream in (sys.stdout, sys.stderr):
        getattr(stream, "reconfigure", dict)(
            errors="backslashreplace"
        )  # a file name may be no text, a screen lack a sign
    traced = bool(os.environ.get(TRACEBACK))
    try:
        with interrupts_noted(), within_command():
            try:
                if (status := _verified(sys.argv[1:])) is not None:
                    sys.exit(status)
                _run_verb()
            except BadInput as error:  # handled here, since its JSON may meet a closed pipe too
                _print_faults(error)
                sys.exit(2)
            finally:
                sys.stdout.flush()  # here; at its end Python would print an error for a closed pipe
    except BrokenPipeError:
        _drop_output()
        sys.exit(1)
    except SystemExit as end:
        if end.code == INTERRUPTED:  # by Typer itself
            _say("interrupted")
        raise
    except KeyboardInterrupt:
        _end_interrupted()
    except Exception as error:
        if interrupted():
            _end_interrupted()
        if isinstance(error, OSError) and error.filename is None:  # by a print; errors of files are BadInput
            _say(f"error: standard output: cannot be written ({error.strerror}); expected room for a result")
            _drop_output()
            sys.exit(2)
        if traced:
            traceback.print_exc()
        _say_internal(error)
        sys.exit(INTERNAL)


def _say(line: str, **options: Any) -> None:
    """Print on the standard error."""
    from codegen.base.terminal import errors

    errors.print(line, **options)


def _say_internal(error: Exception) -> None:
    """Print what a fault of the tool means for the user, and what to do."""
    memory = isinstance(error, MemoryError)
    said = "there is not enough memory" if memory else brief(str(error))
    _say(f"internal error: `{brief(shlex.join(['stiction', *sys.argv[1:]]))}` ended in {type(error).__name__}: {said}")
    small = ", or the machine too small for this input" if memory else ""
    _say(
        f"This is a fault of stiction or of a library below it{small}; nothing says that the input is wrong. "
        f"Please report it with the files that you gave and with what {TRACEBACK}=1 in the environment adds."
    )


def _print_faults(error: BadInput) -> None:
    """Print a line for each fault of the input; with --json also the JSON object of all."""
    for each in error.all[:MOST_FAULTS]:
        code = f" [{each.code}]" if each.code else ""
        _say("error: " + " ".join(str(each).split()) + code, style="red")
    if len(error.all) > MOST_FAULTS:
        more = len(error.all) - MOST_FAULTS
        _say(f"and {more} more, which are shown once these are corrected", style="red")
    if "--json" in sys.argv[1:]:
        from codegen.app.verbs import print_json

        print_json({"format": "stiction-errors/1", "errors": [each.parts for each in error.all]})


def _drop_output() -> None:
    """Redirect the standard output to nothing, so that Python does not write to it again at its end."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _verified(words: Sequence[str]) -> int | None:
    """Run ``verify FILE`` and return its exit status; None for other words, and for a file that cannot be read."""
    if len(words) != 2 or words[0] != "verify" or words[1].startswith("-"):
        return None
    from codegen.app.verify import certificate_in, print_verification

    try:
        return print_verification(certificate_in(words[1]))
    except BadInput:  # the verb says it
        return None


def _run_verb() -> None:
    """Run the verb of the command line by Typer, with the exit status of its result."""
    from codegen.base.terminal import without_library_warnings

    with without_library_warnings():
        try:
            status = _command().main(prog_name="stiction", standalone_mode=False)
        except Exception as error:
            if hasattr(error, "ctx"):  # a UsageError of Typer's copy of click, which Typer does not export
                raise _fault_of_usage(error) from None
            raise
    sys.exit(status or 0)


def _fault_of_usage(error: Any) -> BadInput:
    """A ``UsageError`` of click as bad input; without any argument the help is printed in its place."""
    context, message = error.ctx, error.format_message()
    if context and message == context.get_help():
        error.show()
        sys.exit(error.exit_code)
    found, *alike = re.split(r"[.]? [(]?(?:Did you mean|Possible options:) ", message)
    nearest = re.findall(r"[\w-]+", alike[0])[0] if alike else None
    verb = [word for word in sys.argv[1:] if word in _command().commands][:1]
    path = context.command_path if context else " ".join(["stiction", *verb])  # none for an option without its value
    usage = f"`{' '.join(context.get_usage().split()).removeprefix('Usage: ')}`," if context else "a call"
    found = f"{found[0].lower()}{found[1:]}".rstrip(".")
    expected = f"{usage} as `{path} --help` explains"
    return BadInput(path, found, expected, nearest, code="CALL004")


@cache
def _command() -> Any:
    """All verbs with their options, made once, since that takes 30 ms."""
    from typer.main import get_command

    from codegen.app.verbs import app

    return get_command(app)


def _end_interrupted() -> NoReturn:
    _say("interrupted")
    sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
