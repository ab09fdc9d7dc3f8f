"""Errors cross the border of a process: of a pool over many logs, what one raises in its worker reaches the caller."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from codegen.base.errors import BadInput, Place
from tests.app.command import SPECS


def some_errors() -> list[Exception]:
    place = Place("a.yaml", 3, "force[0]")
    fault = BadInput(place, "`x`", "a number", "y", "about", code="SPEC006")
    fault.others = (BadInput(place, "unknown `z`", "one of x", code="SPEC008"),)
    return [fault, *fault.others]


@pytest.mark.parametrize("error", some_errors(), ids=lambda error: type(error).__name__)
def test_an_error_survives_pickling(error: Exception) -> None:
    plain = {k: str(v) for k, v in vars(error).items()}
    for again in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
        assert type(again) is type(error) and str(again) == str(error)
        assert {k: str(v) for k, v in vars(again).items()} == plain


SCRIPT = """
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import stiction

if __name__ == "__main__":
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        for call in ((stiction.replay, sys.argv[1], "absent.csv"), (stiction.verify, sys.argv[1])):
            try:
                pool.submit(*call).result(timeout=120)
            except stiction.BadInput as fault:
                print(fault)
"""


def test_bad_input_in_a_worker_reaches_the_caller(tmp_path: Path) -> None:
    """In a process of its own, since a pool leaves a child behind that keeps account of its resources."""
    (tmp_path / "many_logs.py").write_text(SCRIPT)
    command = [sys.executable, str(tmp_path / "many_logs.py"), str(SPECS / "one_mass.yaml")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    first, second = done.stdout.splitlines()
    assert "absent.csv: no such file" in first and "not JSON" in second
