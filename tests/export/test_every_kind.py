"""Every law and every effect is exported without a fault, loads in MuJoCo, and is said to be held or not."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.effects import CATALOGUE
from codegen.effects.declare import system_of
from codegen.export.mechanism import mechanism_of
from codegen.export.mjcf import build_mjcf
from codegen.export.urdf import sdf_text, urdf_text
from codegen.export.usd import usd_text
from codegen.friction import LAWS
from codegen.mechanics.system import System
from codegen.report.examples import EXAMPLES
from codegen.spec.model import Spec
from codegen.spec.reader import parse_spec
from tests.machines import TWO_SPRINGS, axis, effect


def exported(spec: Spec, system: System) -> list[str]:
    """Where the remarks of the MJCF model are; it is loaded where MuJoCo is there."""
    mechanism = mechanism_of(spec, system)
    model = build_mjcf(spec, mechanism, [])
    plain = [write(spec, mechanism, []) for write in (urdf_text, sdf_text, usd_text)]
    for text, remarks in (*plain, (model.text, model.remarks)):
        assert remarks and all(r.text in text for r in remarks)
        assert all(r.worst is None or (r.rms is not None and r.rms <= r.worst * (1 + 1e-9)) for r in remarks)
    try:
        import mujoco
    except ImportError:
        return [r.where for r in model.remarks]
    mujoco.mj_step(loaded := mujoco.MjModel.from_xml_string(model.text), mujoco.MjData(loaded))
    return [r.where for r in model.remarks]


@pytest.mark.parametrize("name", LAWS)
def test_every_law(name: str) -> None:
    given = ", ".join(f"{key}: {value}" for key, value in EXAMPLES.laws[name].parameters.items())
    where = exported(*axis(law=f"law: {name}, {given}"))
    assert f"contact rail ({name})" in where


@pytest.mark.parametrize("kind", CATALOGUE)
def test_every_effect(kind: str) -> None:
    """It changes what is written: the model is another than that of the machine without it."""
    made = CATALOGUE[kind]
    on = {"contact": "rail", "input": "w"}.get(made.sits_on, "x")
    if made.sits_on == "two coordinates":
        text = TWO_SPRINGS.format(between=1, ground=2).replace("name: two_mass", "name: two_mass\n")
        text += f"effects: {effect(kind, '[x1, x2]', **EXAMPLES.effects[kind])}\n"
        spec = parse_spec(text, Path("two.yaml"))
        exported(spec, system_of(spec))
        return
    turns = kind == "gravity_imbalance"
    spec, system = axis(effects=effect(kind, on, **EXAMPLES.effects[kind]), turns=turns)
    assert exported(spec, system)
    plain, _ = axis(turns=turns)
    bare = build_mjcf(plain, mechanism_of(plain, system_of(plain)), []).text
    assert build_mjcf(spec, mechanism_of(spec, system), []).text != bare
