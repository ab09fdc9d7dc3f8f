"""``errors CODE``, ``effects KIND`` and ``laws LAW`` show one entry in full; other findings of a first use."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import stiction as offered
from codegen.base.error_codes import CODES
from codegen.effects import CATALOGUE
from codegen.friction import LAWS

from .command import SPECS, is_one_message, stiction


def test_one_code() -> None:
    for name in ("LOG003", "log003"):
        assert stiction("errors", name).out == f"{'LOG003':<10} {' '.join(CODES['LOG003'])}\n"
    (row,) = json.loads(stiction("errors", "LOG003", "--json").out)["codes"]
    assert row["code"] == "LOG003"


def test_the_list_of_laws_says_what_drives_means() -> None:
    told = " ".join(stiction("laws").out.split())
    assert "drives: level" in told and "drives: state" in told and "drives: neither" in told
    assert "drives level: cfo and gcfo can estimate" in told and "drives state: dfo and gdfo can" in told


def test_every_effect_and_law_in_full() -> None:
    for kind, effect in CATALOGUE.items():
        out = stiction("effects", kind).out
        assert out.startswith(f"{kind}: {effect.equation}\n") and all(p.meaning in out for p in effect.parameters)
    for name, law in LAWS.items():
        out = stiction("laws", name).out
        assert out.startswith(f"{name}: ") and f"source: {law.source}\n" in out
        assert all(p.meaning in out for p in law.parameters)
    assert [e["kind"] for e in json.loads(stiction("effects", "cogging", "--json").out)["effects"]] == ["cogging"]
    assert [law["name"] for law in json.loads(stiction("laws", "stribeck", "--json").out)["laws"]] == ["gaussian"]


@pytest.mark.parametrize(
    ("words", "near"),
    [(("errors", "LOG03"), "LOG003"), (("effects", "coging"), "cogging"), (("laws", "lugree"), "lugre")],
)
def test_another_word_is_told_with_the_nearest(words: tuple[str, str], near: str) -> None:
    told = stiction(*words)
    assert is_one_message(told) and f"(did you mean '{near}'?)" in told.err


def test_a_robot_file_in_place_of_a_spec_is_pointed_to_init(tmp_path: Path) -> None:
    told = stiction("check", SPECS / "seven_joint_arm.urdf")
    assert is_one_message(told) and "`stiction init seven_joint_arm.urdf`" in told.err
    (tmp_path / "arm.xml").write_text("<?xml version='1.0'?>\n<mujoco><worldbody/></mujoco>")
    told = stiction("derive", tmp_path / "arm.xml")
    assert is_one_message(told) and "MuJoCo" in told.err and "`stiction init arm.xml`" in told.err
    (tmp_path / "page.yaml").write_text("<html></html>")
    told = stiction("check", tmp_path / "page.yaml")
    assert is_one_message(told) and "XML" in told.err and "init" not in told.err


@pytest.mark.parametrize("path", [None, 3, b"spec.yaml", ["spec.yaml"]])
def test_what_is_no_path_is_bad_input(path: object) -> None:
    for verb in (offered.load, offered.derive, offered.check):
        with pytest.raises(offered.BadInput) as told:
            verb(path)
        assert told.value.code == "CALL001"
