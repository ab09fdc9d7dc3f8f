"""A user's own effects stand in the table whatever became of them: accepted, screened, never tried."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from codegen.app.diagnose import Diagnosed
from codegen.diagnosis.diagnose import diagnose_log
from codegen.diagnosis.selection import candidate_fits
from codegen.effects import CATALOGUE
from codegen.effects.register import is_own, load_effects
from tests.diagnosis.stage import log_of, stage, system_of

MINE = '''
import sympy
from codegen.effects import Effect, EffectParameter

class Bump(Effect):
    kind = "bump"
    sits_on = "coordinate"
    equation = "e = -p exp(-((x - x_0)/s)^2)"
    signature = "a push at one place"
    seen_over = "position"
    parameters = (
        EffectParameter("p", "{F}", "height", neutral=0.0),
        EffectParameter("x_0", "{q}", "place", start=lambda covered: [-0.15, -0.05, 0.05, 0.15]),
        EffectParameter("s", "{q}", "width", low=0.0, start=lambda covered: [0.03]),
    )
    confused_with = ()

    def add(self, system, place, p):
        x = system.positions[place]
        return system.with_force(place, -p["p"] * sympy.exp(-(((x - p["x_0"]) / p["s"]) ** 2)))

class Elsewhere(Bump):
    kind = "elsewhere"
    needs = "another machine"

    def applies(self, system, place):
        return False

class Unstarted(Bump):
    kind = "unstarted"
    parameters = (
        Bump.parameters[0],
        EffectParameter("x_0", "{q}", "place", start=lambda covered: []),
        Bump.parameters[2],
    )

class Square(Bump):
    """Fits nothing that the log of a bump shows."""
    kind = "square"
    parameters = (EffectParameter("c", "{F}", "weight", neutral=0.0),)

    def add(self, system, place, p):
        return system.with_force(place, -p["c"] * sympy.cos(400 * system.positions[place]))

EFFECTS = [Bump(), Elsewhere(), Unstarted(), Square()]
'''


@pytest.fixture
def mine(tmp_path: Path) -> Iterator[None]:
    before = dict(CATALOGUE)
    path = tmp_path / "mine.py"
    path.write_text(MINE, encoding="utf-8")
    load_effects(path)
    yield
    CATALOGUE.clear()
    CATALOGUE.update(before)


@pytest.mark.slow
def test_own_effects_are_listed_with_what_became_of_them(
    mine: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(candidate_fits, "FITTED", 1)  # no place among the first for what is tried and no good
    assert [kind for kind in CATALOGUE if is_own(kind)] == ["bump", "elsewhere", "unstarted", "square"]
    entry = "[{kind: bump, on: x, parameters: {p: 6.0, x_0: 0.06, s: 0.04}}]"
    log = log_of(stage(entry), tmp_path, "train.csv")
    spec = stage()
    diagnosis, _ = diagnose_log(spec, system_of(spec), log)
    assert [(e.kind, e.on) for e in diagnosis.effects] == [("bump", "x")], diagnosis.sentence
    assert diagnosis.effects[0].parameters["x_0"] == pytest.approx(0.06, rel=0.02)
    told = {c["kind"]: c["evidence"] for c in diagnosis.as_json()["candidates"] if c["own"]}
    assert set(told) == {"bump", "elsewhere", "unstarted", "square"}
    assert told["bump"]["accepted"] and not told["bump"]["why_not"]
    assert told["elsewhere"]["why_not"] == "does not apply here: another machine"
    assert told["unstarted"]["why_not"].startswith("not tried: its starting values")
    assert not told["square"]["accepted"] and told["square"]["blocks"] > 0 and told["square"]["why_not"]
    page = Diagnosed(diagnosis, Path(), ()).text(paths=False)
    assert all(f"{kind} on x" in page for kind in told)

    log.inputs[:] *= -1
    unfit, _ = diagnose_log(spec, system_of(spec), log)
    assert {c.kind: c.why_not for c in unfit.candidates} == dict.fromkeys(
        told, "not tried: the log is unfit for this spec"
    )
