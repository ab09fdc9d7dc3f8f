"""C without its guard for invalid samples (`--fault none`) is bound to the same proof; a guard is all there or not."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

import stiction
from codegen.checker import frame, verify
from tests.checker.forged import GENERATED

SPECS = Path(__file__).parents[2] / "specs"


@cache
def bare(name: str, precision: str = "double") -> dict[str, str]:
    """The C and header without a guard of a shipped spec."""
    (path,) = (p for p in (SPECS / f"{name}.yaml", SPECS / "thesis" / f"{name}.yaml") if p.exists())
    texts = stiction.load(path).with_overrides(stiction.Overrides(precision=precision, fault="none")).sources
    return {file: texts[file] for file in (f"{name}.c", f"{name}.h")}


def checked(name: str, files: dict[str, str]) -> verify.Report:
    proof = (GENERATED / name / "proof.json").read_text("utf-8")
    return verify.check(proof, sources={file: text.encode() for file, text in files.items()})


LOOPS = pytest.param("chain", marks=pytest.mark.slow)


@pytest.mark.parametrize("name", ["one_mass", "two_mass_gto", "two_link_arm", LOOPS])
@pytest.mark.parametrize("precision", ["double", "single"])
def test_a_shipped_proof_is_one_of_the_c_without_a_guard(name: str, precision: str) -> None:
    files = bare(name, precision)
    assert "int fault" not in files[f"{name}.h"]
    report = checked(name, files)
    words = "\n".join(report.proved)
    assert report.whole == (name != "two_link_arm")
    assert "an invalid sample is used like any other" in words and "inputs that are no numbers" in words
    assert "samples with a fault" not in words and "held estimates" not in words


def test_the_step_is_that_of_the_guarded_c() -> None:
    guarded = {file: (GENERATED / "two_mass_gto" / file).read_text("utf-8") for file in bare("two_mass_gto")}
    a, b = frame.read("two_mass_gto", bare("two_mass_gto")), frame.read("two_mass_gto", guarded)
    assert (a.init, a.commit, a.states, a.outputs) == (b.init, b.commit, b.states, b.outputs)
    assert a.step == [one for one in b.step if one[0] != "check"] and a.sums is None and not a.predict + a.resume


LAW = "outputs->v_hat = v_hat;"
FORGED = {
    "another law": (
        "c",
        "outputs->a_hat_rail = a_hat_rail;",
        "outputs->a_hat_rail = 0.99 * a_hat_rail;",
        "do not show",
    ),
    "an output that is another state": ("c", LAW, "outputs->v_hat = state->z_v;", "do not show"),
    "a state set before the outputs": ("c", LAW, f"state->z_v = 0.0; {LAW}", ""),
    "a branch": ("c", LAW, f"if (inputs->w > 3.0) {{ state->z_v = 0.0; }} {LAW}", "cannot be read"),
    "a return": ("c", LAW, f"return; {LAW}", "cannot be read"),
    "a start that moves": ("c", "state->z_rail = parameters->rail_a;", "state->z_rail = inputs->w;", "init"),
    "a guard in the header alone": ("h", "double F_hat_on_x;", "double F_hat_on_x; int fault;", "no fields of doubles"),
    "the mode of a guard": ("c", LAW, f"double ONE_MASS_RUNNING = 1.0; {LAW}", "form that is read"),
}


@pytest.mark.parametrize("kind", FORGED)
def test_forgeries_are_refused(kind: str) -> None:
    end, old, new, why = FORGED[kind]
    files, file = dict(bare("one_mass")), f"one_mass.{end}"
    assert files[file].count(old) == 1
    files[file] = files[file].replace(old, new)
    if why:
        with pytest.raises(verify.Refused, match=re.escape(why)):
            checked("one_mass", files)
    else:  # the step has read the state before, and sets it again after: the same function
        assert checked("one_mass", files).whole
