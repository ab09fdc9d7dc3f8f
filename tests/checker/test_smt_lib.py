"""Certificates as SMT-LIB: z3 and cvc5 confirm what is shipped, and deny it where a number makes it false."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import pytest

from codegen.app.smt_lib import smt_text
from codegen.base.errors import BadInput
from codegen.certify.region_proofs import REGION_PROOFS
from codegen.checker import verify
from tests.expected_errors import matches

from .test_shipped_mutants import PROOFS, identity
from .test_verify import cfo, scalar, turning

z3 = pytest.importorskip("z3", reason="z3-solver is in the extra `smt`")
cvc5 = pytest.importorskip("cvc5", reason="cvc5 is in the extra `smt`")
COVERED = [p for p in PROOFS if p.name == "certificate.json" and json.loads(p.read_text("utf-8"))["cover"]]
"""Certificates on the cells of a cover, which ``test_second_kernel.py`` proves again."""
LARGE = [p for p in PROOFS if p.parent.name == "two_mass_gdfo" and p.name == "refusal.json"]
LARGE += [p for p in PROOFS if p.name in REGION_PROOFS and p.parent.name in ("rig_dfoa", "rig_dfob")]
FEW = ("weak.json", "presliding.json", "sliding_limit.json")
SHIPPED = [p for p in PROOFS if p.name not in REGION_PROOFS or (p.parent.name == "one_mass_dfo" and p.name in FEW)]
SHIPPED = [p for p in SHIPPED if p.parent.name not in ("chain", "two_mass_gdfo") and p not in COVERED]


def by_z3(text: str) -> str:
    solver = z3.SolverFor("QF_NRA")
    solver.from_string(text)
    return str(solver.check())


def by_cvc5(text: str) -> str:
    solver = cvc5.Solver()
    parser = cvc5.InputParser(solver)
    parser.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, text, "certificate")
    symbols, said = parser.getSymbolManager(), ""
    while not (command := parser.nextCommand()).isNull():
        said += str(command.invoke(solver, symbols))
    return said.strip()


SOLVERS = {"z3": by_z3, "cvc5": by_cvc5}


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("path", SHIPPED, ids=identity)
def test_what_is_shipped_is_confirmed(path: Path, solver: str) -> None:
    assert SOLVERS[solver](smt_text(json.loads(path.read_text("utf-8")))) == "unsat"


@pytest.mark.slow
@pytest.mark.parametrize("path", LARGE, ids=identity)
def test_what_is_shipped_and_large_is_confirmed(path: Path) -> None:
    assert by_z3(smt_text(json.loads(path.read_text("utf-8")))) == "unsat"


def changed(cert: dict[str, Any], path: str, new: Any) -> dict[str, Any]:
    cert = copy.deepcopy(cert)
    *keys, last = [int(k) if k.isdigit() else k for k in path.split(".")]
    node: Any = cert
    for key in keys:
        node = node[key]
    node[last] = new
    return cert


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(
    ("cert", "path", "new"),
    [
        (cfo(), "decay_rate", "78/10"),
        (cfo(), "sample_time", "1/10"),
        (cfo(), "lyapunov_matrix.0.0", "-1"),
        (cfo(), "matrix.0.0", "90"),
        (cfo(), "reversals.0.growth", "454/100"),
        (cfo(), "reversals.0.dwell_samples", 100),
        (scalar(), "decay_rate", "37500001/1000000"),
        (turning(), "variables.m", ["9/10", "20"]),
        (json.loads(SHIPPED[0].with_name("limit.json").read_text()), "along", ["0", "0"]),
        (json.loads(SHIPPED[0].with_name("limit.json").read_text()), "decay_rate", "1"),
    ],
)
def test_a_false_claim_is_denied(cert: Any, path: str, new: Any, solver: str) -> None:
    assert SOLVERS[solver](smt_text(cert)) == "unsat"
    false = changed(cert, path, new)
    with pytest.raises(verify.Refused):
        verify.check(json.dumps(false))
    assert SOLVERS[solver](smt_text(false)) == "sat"


@pytest.mark.parametrize("path", COVERED, ids=identity)
def test_a_cover_is_not_written(path: Path) -> None:
    with pytest.raises(BadInput) as told:
        smt_text(json.loads(path.read_text("utf-8")))
    assert matches(told.value, "CALL003 cosines")


def test_a_dwell_too_long_for_exact_powers() -> None:
    with pytest.raises(BadInput) as told:
        smt_text(changed(cfo(), "reversals.0.dwell_samples", 10**6))
    assert matches(told.value, "CALL003 1000000")
