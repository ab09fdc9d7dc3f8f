"""``stiction verify --smt``: a certificate as a ground SMT-LIB 2 file, for a solver independent of the checker.

The file states the negation of the inequalities that the checker proves by LDLᵀ at the vertices. If z3 or cvc5 finds
``unsat``, they hold.
"""

import json
from collections.abc import Mapping
from fractions import Fraction
from itertools import pairwise, product
from pathlib import Path
from typing import Any

from codegen.app.verify import CERTIFICATE
from codegen.base.border import verb
from codegen.base.errors import BadInput
from codegen.base.files import refuse_target, write_atomically
from codegen.base.input_files import read_text
from codegen.base.text import render
from codegen.base.user_text import UserText
from codegen.certify.certificate_text import rational_text
from codegen.checker import verify

LONGEST_DWELL = 30_000
"""Longest dwell time in samples: the file has its decay factor to this power, as an exact number."""


def smt_text(content: Mapping[str, Any]) -> str:
    """The file for a certificate or refutation that the checker has accepted.

    Raises BadInput for a dwell time that is too long for exact powers, or a certificate with a cover.
    """
    if content["cover"]:
        found = "an inequality over sines and cosines, on the cells of a cover"
        expected = "inequalities at the vertices of cells; this certificate is verified by the checker alone"
        raise BadInput("certificate", found, expected, code="CALL003")
    for entry in content["reversals"]:
        if entry["dwell_samples"] > LONGEST_DWELL:
            found = f"{entry['dwell_samples']} samples of dwell time at {entry['contact']}"
            raise BadInput("certificate", found, f"at most {LONGEST_DWELL} samples for an SMT solver", code="CALL003")
    size = list(range(len(content["error"])))
    name, claim = UserText(content["subject"]["name"]), UserText(content["claim"])
    words = {"name": name, "claim": claim, "c": content, "size": size, "vertices": _vertices(content)}
    # The binary digits of an exponent, none for 0, are for powers by repeated squaring.
    return render("text/certificate.smt2.j2", **words, digits=lambda whole: f"{whole:b}" if whole else "")


def _vertices(content: Mapping[str, Any]) -> list[dict[str, str]]:
    """Parameter → end of its interval, for every vertex of every cell, enclosed as in the checker."""
    axes = {}
    for name, ends in content["variables"].items():
        at = [Fraction(x) for x in content["splits"].get(name, ends)]
        axes[name] = list(pairwise(at))
    ranges = {e["name"]: verify.parse(e["expression"], axes, e["name"])[1] for e in content["parameters"]}
    vertices = []
    for cell in product(*axes.values()):
        box = dict(zip(axes, cell, strict=True))
        ends = {name: sorted(set(verify.widen(*value(box)))) for name, value in ranges.items()}
        for point in product(*ends.values()):
            vertices.append({name: rational_text(x) for name, x in zip(ends, point, strict=True)})
    return vertices


def refuse_smt_target(certificate: Path, target: Path) -> None:
    """Raise BadInput for a name that is no .smt2 file to write, or is the certificate itself."""
    refuse_target(target, {"the certificate itself": certificate}, (".smt2",))


@verb
def write_smt(certificate: str | Path, out: str | Path) -> Path:
    """Write the negated inequalities of a certificate as SMT-LIB 2, which another solver should find ``unsat``.

    Raises BadInput for a file that is no certificate, a dwell time that is too long, or a file that cannot be written.
    """
    target = Path(out)
    refuse_smt_target(Path(certificate), target)
    text = read_text(Path(certificate), CERTIFICATE, verify.MAX_TEXT)
    try:
        verify.parsed(text)
    except (verify.Refused, ValueError, RecursionError) as error:
        found = f"no certificate ({error})"
        raise BadInput(str(certificate), found, "a stability certificate", code="CALL003") from None
    write_atomically(target, smt_text(json.loads(text)))
    return target
