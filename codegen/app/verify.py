"""``stiction verify``: a certificate or a bound, checked by the independent checker."""

from __future__ import annotations

import json
from pathlib import Path

from codegen.base.border import verb_that_raises
from codegen.base.errors import BadInput, Place
from codegen.base.input_files import read_text
from codegen.checker import newtons
from codegen.checker import verify as checker

CERTIFICATE = "a certificate (JSON)"


@verb_that_raises(checker.Refused)
def verify(path: str | Path, spec: Path | None = None) -> checker.Report:
    """Check a certificate or a bound by the independent checker, with the files that lie beside it.

    Raises:
        BadInput: if the file cannot be read.
        codegen.checker.verify.Refused: if the claim does not hold.
    """
    path = Path(path)
    try:
        return newtons.check(read_text(path, CERTIFICATE, checker.MAX_TEXT), path.parent, spec)
    except newtons.Refused as error:
        raise checker.Refused(str(error)) from None
    except json.JSONDecodeError as error:
        raise BadInput(Place(str(path), error.lineno), error.msg, CERTIFICATE) from None
    except OSError as error:  # of a file beside it, or of the spec
        found = f"unreadable ({error.strerror})"
        raise BadInput(str(error.filename or path), found, "a file that the certificate names") from None
    except ValueError as error:
        raise BadInput(str(path), f"no certificate ({error})", CERTIFICATE) from None
