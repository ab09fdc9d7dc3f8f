"""A message names options to whoever calls the command, and arguments to whoever calls from Python."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import stiction as api
from tests.app.command import SPECS, stiction

ONE = SPECS / "one_mass.yaml"
LOG = "t,x,u\n" + "".join(f"{k / 1000},{k / 1e5},1\n" for k in range(50))

CALLS: dict[str, tuple[Callable[[api.Machine, Path], Any], str, str]] = {
    "over": (lambda m, f: m.gains(out=f / "g", over=("K_F", "K_G")), "one_mass.yaml: `over`: unknown gain", ""),
    "plant": (lambda m, f: m.simulate(f / "l.csv", plant="mujco"), "simulate(): `plant`: `mujco`", "mujoco"),
    "to": (lambda m, f: m.export("mjfc", f / "a.xml"), "export(): `to`: `mjfc`", "mjcf"),
    "counts": (
        lambda m, f: m.export("odrive", f / "a.h", on="x", counts=400),
        'export(): `counts`: the number of rows of a map, and to="odrive"; expected to="csv-map"',
        "",
    ),
    "material": (
        lambda m, f: m.diagnose(f / "log.csv", out=f / "d", material="two"),
        "diagnose(): `material`: `two`",
        "",
    ),
    "fmi": (lambda m, f: api.generate_fmu(m, out=f / "fmu", version="4.0"), "generate_fmu(): `version`: `4.0`", ""),
    "from": (lambda m, f: api.init("bar", "two_mas", out=f), "init(): `source`: `two_mas`, no such file", "two_mass"),
    "name": (lambda m, f: api.init("my axis", out=f), "init(): `name`: `my axis`", "my_axis"),
    "precision": (
        lambda m, f: m.generate(f / "o", overrides=api.Overrides(precision="half")),
        "Overrides(): `precision`: `half`",
        "",
    ),
    "target": (
        lambda m, f: m.generate(f / "o", overrides=api.Overrides(targets=("c", "pyhton"))),
        "Overrides(): `targets`: `pyhton`",
        "python",
    ),
    "column": (
        lambda m, f: m.replay(f / "log.csv", columns={"xx": "x"}),
        "replay(): `columns`: unknown name `xx`",
        "x",
    ),
    "no column": (
        lambda m, f: m.replay(f / "log.csv", columns={"w": "y"}),
        "no column `y`, which `columns` asks for as `w`",
        "",
    ),
    "column for a name": (lambda m, f: m.replay(f / "log.csv"), '`columns={"w": "', ""),
    "only": (
        lambda m, f: m.replay(f / "log.csv", columns={"w": "u"}, only=["F_hat"]),
        "replay(): `only`: no output",
        "",
    ),
}


@pytest.mark.parametrize("columns", ["Weg [mm],Kraft [N]", "Weg`s [mm],it's`Kraft [N]"])
def test_all_columns_of_a_log_are_proposed_as_one_argument(columns: str, tmp_path: Path) -> None:
    """As the message says it: the call with what is in its quotes reads the log."""
    (tmp_path / "log.csv").write_text(LOG.replace("x,u", columns))
    machine = api.load(ONE)
    with pytest.raises(api.BadInput) as told:
        machine.replay(tmp_path / "log.csv")
    (proposed,) = re.findall(r"or `columns=(\{.*?\})`", told.value.expected)
    assert machine.replay(tmp_path / "log.csv", columns=ast.literal_eval(proposed)).samples == 50


def test_text_of_a_user_that_looks_like_an_option_is_left(tmp_path: Path) -> None:
    """Its quotation mark has no end, which was an internal error."""
    (tmp_path / "a.yaml").write_text(ONE.read_text().replace("name: one_mass", 'name: "--column x=\'"'))
    with pytest.raises(api.BadInput, match=re.escape("`--column x='`")):
        api.replay(tmp_path / "a.yaml", tmp_path / "log.csv")


@pytest.mark.parametrize("case", CALLS)
def test_in_python_a_message_names_arguments(case: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(LOG)
    call, words, nearest = CALLS[case]
    with pytest.raises(api.BadInput) as told:
        call(api.load(ONE), tmp_path)
    assert words in str(told.value)
    outside = re.sub(r"`stiction [^`]*`", "", str(told.value))
    assert not re.search(r"(?<![\w-])--[a-z]", outside), "an option of the command"
    assert told.value.nearest == (nearest or told.value.nearest)
    assert told.value.parts["file"] in str(told.value) and str(told.value.parts["found"]) in str(told.value)


def test_the_command_names_options(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(LOG)
    assert "error: --plant: `mujco`" in stiction("simulate", ONE, "-o", tmp_path / "l.csv", "--plant", "mujco").err
    assert "`--column w=" in stiction("replay", ONE, tmp_path / "log.csv").err
    with pytest.raises(api.BadInput, match=re.escape("simulate(): `plant`")):  # after the command in the same process
        api.simulate(ONE, tmp_path / "l.csv", plant="mujco")
