"""Two effects that act at once: what one looks like without the other, and what a third that imitates both is worth."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.base.progress import shares_to
from codegen.diagnosis.fit.acceptance import near_noise
from codegen.diagnosis.fit.output_error import Fit
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import part_of
from codegen.diagnosis.selection import forward_selection, parsimony
from codegen.effects import CATALOGUE
from codegen.spec import Spec, parse_spec
from tests.diagnosis.stage import STAGE, log_of
from tests.diagnosis.test_adoption import search_of

SWING = "0.5*sin(2*pi*0.4*t) + 0.15*sin(2*pi*1.1*t)"


def turntable(effects: str) -> Spec:
    """A stage that turns, within 37 degrees to either side."""
    text = STAGE.format(effects=effects, level=4, reference=SWING, duration=14, noise=5e-5)
    units = {"unit: m}": "unit: rad}", "unit: N}": "unit: N*m}", "unit: kg}": "unit: kg*m^2}", "N*s/m": "N*m*s"}
    for one, other in units.items():
        text = text.replace(one, other)
    return parse_spec(text, Path("turntable.yaml"))


def on(effects: str, folder: Path) -> tuple[Search, Fit]:
    """A search on the log of a turntable with these effects, and the refit without them."""
    search = search_of(turntable("[]"), log_of(turntable(effects), folder, "train.csv"))
    return search, search.refit()


SPRING = "{kind: spring, on: x, parameters: {k: 20}}"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effects", "kinds"),
    [
        (f"[{SPRING}, {{kind: offset, on: x, parameters: {{f0: -6}}}}]", {"spring", "offset"}),
        (
            "[{kind: input_gain, on: w, parameters: {gain: 0.75}}, {kind: viscous, on: rail, parameters: {b: 5}}]",
            {"input_gain", "viscous"},
        ),
        ("[{kind: gravity_imbalance, on: x, parameters: {G: 21, phase: 0.3}}]", {"gravity_imbalance"}),
    ],
)
def test_two_effects_are_found_and_not_what_imitates_them(effects: str, kinds: set[str], tmp_path: Path) -> None:
    """A spring and a constant force were an unbalanced mass, a gain and a damping a compliance and an inertia error."""
    search, base = on(effects, tmp_path)
    found = forward_selection.find_effects(search, base, lambda turn, share: None).final
    assert {p.kind for p in found.trial.parts} == kinds and near_noise(found)


def test_two_effects_that_together_imitate_one_give_way_to_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wave longer than the stroke and a hardening spring fit the log of a linear spring nearly as well."""
    search, base = on(f"[{SPRING}]", tmp_path)
    wave, hardening, spring = (
        part_of(CATALOGUE[kind], 0, search.system) for kind in ("cogging", "hardening_spring", "spring")
    )
    values = [{"amplitude": 8.0, "period": 3.0, "phase": 0.0}, {"k3": 10.0}]
    both = search.with_parts(base, base.theta, [wave, hardening], values)
    monkeypatch.setattr(parsimony, "every_part", lambda search, taken: [spring])
    shares: list[float] = []
    with shares_to(shares.append):
        found, rivals = parsimony.judged_together(search, base, both, [], False)
    assert shares
    assert found.trial.parts == (spring,) and not rivals and near_noise(found)


@pytest.mark.parametrize(("speed", "names"), [(3e4, {"b"}), (0.2, {"b", "v_s"})])
def test_a_form_is_chosen_again_beside_an_effect_that_was_found_later(
    speed: float, names: set[str], tmp_path: Path
) -> None:
    """A damping that falls with speed was chosen before the spring, beside which it was a line; both were refused."""
    drag = f"{{kind: viscous, on: rail, parameters: {{b: 9, v_s: {speed:g}}}}}"
    search, base = on(f"[{drag}, {SPRING}]", tmp_path)
    curve, spring = CATALOGUE["viscous"].with_parameters(["b", "v_s"]), CATALOGUE["spring"]
    parts = [part_of(effect, 0, search.system) for effect in (curve, spring)]
    both = search.with_parts(base, base.theta, parts, [{"b": 9.0, "v_s": speed}, {"k": 20.0}])
    found, _ = parsimony.with_simplest_effects(search, both, [])
    assert [p.kind for p in found.trial.parts] == ["viscous", "spring"] and near_noise(found)
    assert set(found.trial.parts[0].names) == names


@pytest.mark.parametrize(("lag", "names"), [("tau: 0.03", ("tau",)), ("tau_each: 0.01", ("tau_each",))])
def test_the_usual_form_is_tried_beside_an_effect_that_was_found_later(
    lag: str, names: tuple[str, ...], tmp_path: Path
) -> None:
    """Without the inertia error a lag looked like two; beside two lags a compliance was named that was not there."""
    error = "{kind: inertia_error, on: x, parameters: {delta: -0.4}}"
    search, base = on(f"[{{kind: actuator_lag, on: w, parameters: {{{lag}}}}}, {error}]", tmp_path)
    two, inertia = CATALOGUE["actuator_lag"].with_parameters(["tau_each"]), CATALOGUE["inertia_error"]
    parts = [part_of(effect, 0, search.system) for effect in (two, inertia)]
    both = search.with_parts(base, base.theta, parts, [{"tau_each": 0.015}, {"delta": -0.4}])
    found, _ = parsimony.with_simplest_effects(search, both, [])
    assert found.trial.parts[0].names == names and found.trial.parts[1] == parts[1] and near_noise(found)
