"""docs/diagnosis_thresholds.md gives the values that the code has."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "diagnosis_thresholds.md"
ROW = re.compile(r"^\| (`[a-z_]+\.[A-Z_]+`.*?) \| (.*?) \|", re.MULTILINE)
NUMBER = re.compile(r"([−-]?\d[\d,]*(?<!,)(?:\.\d+)?(?:e-?\d+)?)(?:/(\d+))?( %)?")
FOLDERS = ("diagnosis", "effects", "logs")


def numbers(value: str) -> list[float]:
    """The numbers of a cell: 5 %, 1/12, −0.62, 9,000; ``1 in 4`` is 4."""
    text = value.replace("1 in ", "")
    found = NUMBER.findall(text)
    return [
        float(n.replace("−", "-").replace(",", "")) / float(over or 1) * (0.01 if percent else 1.0)
        for n, over, percent in found
    ]


def module_of(stem: str) -> str:
    """The dotted name of the only module with this file name among those that diagnose."""
    files = [p for folder in FOLDERS for p in (ROOT / "codegen" / folder).rglob(f"{stem}.py")]
    assert len(files) == 1, f"{stem}: {files}"
    return ".".join(files[0].relative_to(ROOT).with_suffix("").parts)


def rows() -> list[tuple[str, str]]:
    return ROW.findall(PAGE.read_text(encoding="utf-8"))


@pytest.mark.parametrize(("names", "value"), rows(), ids=lambda text: text.split("`")[1] if "`" in text else "")
def test_a_row_gives_the_value_of_the_code(names: str, value: str) -> None:
    stem = ""
    expected: list[float] = []
    for name in re.findall(r"`([\w.]+)`", names):
        stem = name.partition(".")[0] if "." in name else stem
        constant = getattr(import_module(module_of(stem)), name.rpartition(".")[2])
        expected += np.ravel(constant).tolist()
    assert numbers(value) == pytest.approx(expected, rel=2e-3), names


def test_every_constant_that_the_page_names_exists() -> None:
    for stem, name in re.findall(r"`([a-z_]+)\.([A-Z][A-Z_]+)`", PAGE.read_text(encoding="utf-8")):
        assert hasattr(import_module(module_of(stem)), name), f"{stem}.{name}"


def test_the_page_has_its_thresholds() -> None:
    assert len(rows()) > 60
