"""What a forged twin may do where a step is not used: begin, lose samples, go on after them."""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from codegen.checker import verify
from codegen.checker.verify import Refused
from codegen.replay.twin import load_twin

from .test_attacks import changed
from .test_binding import GENERATED, certificate, check, forged, sources

MISSED = "    state.z_v = state.z_v - parameters.sample_time * parameters.K_v * outputs.v_hat\n"
RESUMED = "    state.z_v = outputs.v_hat - parameters.K_v * (inputs.x + parameters.sample_time * outputs.v_hat)\n"
LEVEL = "    state.z_rail = outputs.a_hat_rail + parameters.K_F * abs(outputs.v_hat)\n"
COUNT = "state.invalid_samples >= 8:"
# What is written into the twin of one_mass, in place of what.
ATTACKS = {
    "init: a velocity": ("z_v=-(parameters.K_v * inputs.x)", "z_v=1.0 - (parameters.K_v * inputs.x)"),
    "init: the position stays in the velocity": ("z_v=-(parameters.K_v * inputs.x)", "z_v=0.0"),
    "init: a level by the command": ("z_rail=parameters.rail_a", "z_rail=parameters.rail_a + 9.0 * inputs.w"),
    "predict: nothing goes along": (MISSED, ""),
    "predict: the wrong way": (MISSED, MISSED.replace("z_v - ", "z_v + ")),
    "predict: a level grows": (MISSED, MISSED + "    state.z_rail = 2.0 * state.z_rail\n"),
    "predict: a level turns": (MISSED, MISSED + "    state.z_rail = -state.z_rail\n"),
    "predict: a level by what was held": (MISSED, MISSED + "    state.z_rail = state.z_rail + outputs.v_hat\n"),
    "predict: another count": (COUNT, COUNT.replace("8", "3")),
    "predict: never holding": (COUNT, COUNT.replace("8", "800")),
    "resume: nothing": (RESUMED, ""),
    "resume: a velocity": (RESUMED, RESUMED.replace("outputs.v_hat - ", "9.0 - ")),
    "resume: the level of forward motion": (LEVEL, LEVEL.replace("abs(outputs.v_hat)", "outputs.v_hat")),
    "resume: a level": (LEVEL, "    state.z_rail = 0.0\n"),
    "resume: holding on": ("    state.mode = RUNNING\n", ""),
    "resume: counting on": ("    state.invalid_samples = 0\n\n", "\n"),
}
# The same of its modes, refused as it is read.
MODES = {
    "a mode of another value": ("HOLDING = 1 ", "HOLDING = 0 "),
    "a mode that is not listed": ("STARTING = 2 ", "STARTING = 2\nIDLE = 3 "),
    "a mode redefined": ("STARTING = 2 ", "STARTING = 2\nRUNNING = 1 "),
    "another first mode": ("mode: int = RUNNING", "mode: int = 3"),
    "init: a mode": ("z_rail=parameters.rail_a,", "z_rail=parameters.rail_a,\n        mode=2,"),
    "init: a count": ("z_rail=parameters.rail_a,", "z_rail=parameters.rail_a,\n        invalid_samples=7,"),
    "init: holding where it must start": ("State(mode=STARTING)", "State(mode=HOLDING)"),
    "predict: a mode that is not listed": ("    state.mode = HOLDING\n", "    state.mode = 7\n"),
    "predict: no end of the count": (f"        if {COUNT}\n            state.mode = HOLDING\n", ""),
    "predict: a count that goes on": (
        "            state.invalid_samples = 0  #",
        "            state.invalid_samples += 0  #",
    ),
    "predict: a count by the command": ("state.invalid_samples += 1", "state.invalid_samples += outputs.v_hat"),
    "predict: counting in every mode": ("if state.mode == RUNNING:", "if state.mode != STARTING:"),
    "resume: a mode that is not listed": ("    state.mode = RUNNING\n", "    state.mode = 7\n"),
    "resume: starting anew": ("    state.mode = RUNNING\n", "    state.mode = STARTING\n"),
    "a mode that is never left": ("elif state.mode == HOLDING:", "elif state.mode == 7:"),
    "a start that is not made": ("    if state.mode != STARTING:", "    if state.mode == RUNNING:"),
    "step: in another mode": ("if state.mode != RUNNING or", "if state.mode != HOLDING or"),
    "step: a mode": ("    outputs.fault = 0\n", "    outputs.fault = 0\n    state.mode = STARTING\n"),
    "step: by the mode": ("sign_rail = _sign(v_hat)", "sign_rail = _sign(v_hat) + state.mode"),
    "step: by the count": ("sign_rail = _sign(v_hat)", "sign_rail = _sign(v_hat) + 9.0 * state.invalid_samples"),
    "step: by a mode's number": ("sign_rail = _sign(v_hat)", "sign_rail = _sign(v_hat) + 9.0 * STARTING"),
}


@pytest.mark.parametrize("case", MODES)
def test_modes_are_read_in_one_form(case: str) -> None:
    with pytest.raises(Refused, match=r"is no twin|line \d+"):
        check(*changed("one_mass", MODES[case]))


@pytest.mark.parametrize("case", ATTACKS)
def test_what_no_observer_does_between_steps_is_refused(case: str) -> None:
    with pytest.raises(Refused, match="lost samples: "):
        check(*changed("one_mass", ATTACKS[case]))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("chain", "parameters.K_v_v[i] * outputs.v_hat[i]", "parameters.K_v_v[i] * outputs.v_hat[0]"),
        ("chain", "state.z_ground[i] = parameters.ground_a[i]", "state.z_ground[i] = inputs.x[i]"),
        ("two_mass", "parameters.K_F_ground * abs(outputs.v2_hat)", "parameters.K_F_ground * abs(outputs.v1_hat)"),
        ("two_link_arm", "+ parameters.K_F_elbow_shoulder * resumed_3", "- parameters.K_F_elbow_shoulder * resumed_3"),
        ("one_mass_domain", "    state.z_rail = outputs.a_hat_rail\n", "    state.z_rail = 0.0\n"),
        ("rig_to", "    state.mode = RUNNING\n", ""),
    ],
)
def test_other_machines(name: str, old: str, new: str) -> None:
    with pytest.raises(Refused, match="lost samples: "):
        check(*changed(name, (old, new)))


@pytest.mark.parametrize("path", sorted(GENERATED.glob("*/certificate.json")), ids=lambda p: p.parent.name)
def test_what_is_shipped_begins_and_goes_on_so(path: Path) -> None:
    top = verify.parsed(path.read_text("utf-8"))
    gaps = verify.lost.compared(top, verify.binding.Twin((path.parent / "__init__.py").read_text("utf-8")))
    assert gaps == ([verify.lost.BENDS] if path.parent.name == "one_mass_dfo_implicit" else [])


def test_positions_that_code_does_not_move_are_told() -> None:
    """Whoever leaves them out has nothing compared, and the reader is told so."""
    content = certificate("one_mass")
    content["code"]["motion"] = {}
    files = sources("one_mass")
    text = files["__init__.py"].decode().replace(*ATTACKS["predict: nothing goes along"])
    assert verify.lost.BENDS in check(*forged(content, files, text)).open


def runs_on(module: Any, seed: int) -> list[Callable[[], bool]]:
    """The three demands on one_mass, by Python itself on doubles: after init, one lost sample, and a hundred."""
    dice = random.Random(seed)
    parameters, h = module.Parameters(), module.Parameters().sample_time

    def near(a: float, b: float) -> bool:
        return abs(a - b) <= 1e-9 * (1 + abs(a) + abs(b))

    def begins() -> bool:
        given = [module.Inputs(dice.uniform(-9, 9), dice.uniform(-9, 9)) for _ in range(2)]
        seen = [module.step(module.init(parameters, x), parameters, x, module.Outputs()) for x in given]
        return all(near(o.v_hat, 0) and near(o.a_hat_rail, seen[0].a_hat_rail) and not o.fault for o in seen)

    def goes_on(lost: int) -> bool:
        def run(missing: int) -> Any:
            state, out = module.State(z_v=z[0], z_rail=z[1]), module.Outputs()
            module.step(state, parameters, module.Inputs(x, w), out)
            v = out.v_hat
            for _ in range(missing):
                module.step(state, parameters, module.Inputs(math.nan, w), out)
                if not out.fault:
                    return None
            if missing > 8:  # the good sample that sets the states
                module.step(state, parameters, module.Inputs(x + (missing + 1) * h * v, w), out)
                if (out.fault, out.v_hat) != (1, v):
                    return None
                missing += 1
                held = (v, out.a_hat_rail)
                module.step(state, parameters, module.Inputs(x + (missing + 1) * h * v, w), out)
                return None if out.fault else near(out.v_hat, held[0]) and near(out.a_hat_rail, held[1])
            module.step(state, parameters, module.Inputs(x + (missing + 1) * h * v, w), out)
            return None if out.fault else (out.v_hat, out.a_hat_rail)

        x, w, z = dice.uniform(-1, 1), dice.uniform(-50, 50), [dice.uniform(-90, 90), dice.uniform(-90, 90)]
        if lost > 8:
            return run(lost) is True
        plain, held = run(0), run(lost)
        return held is not None and all(map(near, plain, held))

    return [begins, lambda: goes_on(1), lambda: goes_on(100)]


@pytest.mark.slow
def test_mutants_are_accepted_only_where_they_run_on() -> None:
    """One operator, constant or name between `init` and `step` is another; Python itself says whether that shows."""
    files, content, dice = sources("one_mass"), certificate("one_mass"), random.Random(5)
    text = files["__init__.py"].decode()
    begin, end = text.index("    state = State(\n"), text.index("def _handle_fault")
    spots = [
        m for m in re.finditer(r" [-+*] |\b\d+\.\d+\b|\b(?:parameters|outputs)\.\w+", text) if begin < m.start() < end
    ]
    refused = kept = 0
    for k in range(150):
        spot = dice.choice(spots)
        options = [x for x in (" - ", " + ", " * ") if x != spot.group()]
        other = dice.choice(options) if spot.group() in (" - ", " + ", " * ") else f"(2.0 * {spot.group()})"
        wrong = text[: spot.start()] + other + text[spot.end() :]
        if "fault" in spot.group():
            continue
        module = load_twin(wrong, "mutant")
        sound = all(demand() for seed in range(6) for demand in runs_on(module, 100 * k + seed))
        try:
            report = check(*forged(content, files, wrong))
        except Refused:
            refused += 1
            continue
        assert sound and verify.lost.BENDS not in report.open, wrong[spot.start() - 60 :][:120]
        kept += 1
    assert refused > 80 and kept > 0
