"""``stiction verify --smt``: what the checker finds in a certificate, for another solver."""

from __future__ import annotations

import json
from pathlib import Path

from codegen.app.smt_lib import smt_text
from codegen.app.verify import CERTIFICATE
from codegen.base.border import verb
from codegen.base.errors import BadInput
from codegen.base.files import refuse_target, write_atomically
from codegen.base.input_files import read_text
from codegen.checker import verify as checker


@verb
def write_smt(certificate: str | Path, out: str | Path) -> Path:
    """Write what the checker finds in a certificate as SMT-LIB 2, negated, for another solver to find ``unsat``.

    Raises:
        BadInput: for what is no certificate, if a dwell is too long for it, or for a file that is not to be written.
    """
    target = Path(out)
    refuse_target(target, {"the certificate itself": Path(certificate)}, (".smt2",))
    text = read_text(Path(certificate), CERTIFICATE, checker.MAX_TEXT)
    try:
        checker.parsed(text)
    except (checker.Refused, ValueError, RecursionError) as error:
        raise BadInput(
            str(certificate), f"no certificate ({error})", "a stability certificate", code="CALL003"
        ) from None
    write_atomically(target, smt_text(json.loads(text)))
    return target
