"""Of two names for one motion, the one that leaves the friction as declared comes first."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnosis.diagnose import diagnose_log
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, TRAIN, among, competing, log_of, system_of

LONE = STAGE.replace("force: [w - b*v]", "force: [w]").replace("  b: {{value: 6, unit: N*s/m}}\n", "")


def lone(effects: str, level: float) -> Spec:
    """A stage on which nothing but drive and friction acts: a larger mass is then a smaller gain with less friction."""
    text = LONE.format(effects=effects, level=level, reference=TRAIN, duration=14, noise=0)
    return parse_spec(text, Path("stage.yaml"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("entry", "kind", "value"),
    [
        ("{kind: inertia_error, on: x, parameters: {delta: 0.6}}", "inertia_error", 0.6),
        ("{kind: input_gain, on: w, parameters: {gain: 0.8}}", "input_gain", 0.8),
    ],
)
def test_a_payload_is_a_mass_and_a_weak_drive_a_gain(entry: str, kind: str, value: float, tmp_path: Path) -> None:
    spec = lone("[]", 4.0)
    diagnosis, _ = diagnose_log(spec, system_of(spec), log_of(lone(f"[{entry}]", 4.1), tmp_path, "train.csv"))
    (found,) = diagnosis.effects
    assert diagnosis.verdict == "effect" and found.kind == kind, diagnosis.sentence
    assert {found.kind, *(other for other, _ in found.also)} == {"inertia_error", "input_gain"}
    assert next(iter(found.parameters.values())) == pytest.approx(value, rel=0.02)


@competing("offset", "coulomb_asymmetry", "viscous", "spring")
def test_a_twin_that_cannot_have_its_value_is_not_named(tmp_path: Path, kinds: tuple[str, ...]) -> None:
    """A constant force above the friction level is no asymmetry of friction, though the motion is the same.

    A weight of twice the friction level was called indistinguishable from an asymmetry, which the table refused.
    """
    spec = lone("[]", 4.0)
    for force, names in ((8.0, {"offset"}), (2.0, {"offset", "coulomb_asymmetry"})):
        entry = f"{{kind: offset, on: x, parameters: {{f0: {force}}}}}"
        log = log_of(lone(f"[{entry}]", 4.0), tmp_path, f"{force}.csv")
        with among(*kinds):
            diagnosis, _ = diagnose_log(spec, system_of(spec), log)
        (found,) = diagnosis.effects
        assert {found.kind, *(kind for kind, _ in found.also)} == names, diagnosis.sentence
        assert ("no log can tell them apart" in diagnosis.sentence) is (len(names) == 2)
