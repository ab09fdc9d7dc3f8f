"""What libraries warn of stays off a command's screen, and reaches whoever calls the functions or asks for it."""

from __future__ import annotations

import logging
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from codegen.app import cli
from codegen.spec import schema

from .command import SPECS, process

ANCHORS = (
    (SPECS / "one_mass.yaml").read_text().replace("unit: m}", "unit: &u m}", 1).replace("unit: N}", "unit: &u N}", 1)
)


def test_a_warning_of_the_yaml_library_does_not_reach_the_screen(tmp_path: Path) -> None:
    (tmp_path / "anchors.yaml").write_text(ANCHORS)
    done = process("check", "anchors.yaml", cwd=tmp_path)
    assert done.code == 2
    assert done.err.count("\n") == 1 and "[SPEC002]" in done.err


def test_warnings_of_numpy_and_loggers_do_not_reach_the_screen(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """And the filters of the process are what they were behind the command, also after bad input."""

    def warns() -> dict[str, str]:
        np.float64(1e300) * np.float64(1e300)
        np.exp(np.array([1e4]))
        logging.getLogger("matplotlib.font_manager").warning("Matplotlib is building the font cache")
        return {}

    monkeypatch.setattr(schema, "json_schema", warns)
    monkeypatch.setattr(sys, "argv", ["stiction", "schema"])
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        before = list(warnings.filters)
        monkeypatch.setattr(sys, "warnoptions", [])
        with pytest.raises(SystemExit, match="0"):
            cli.main()
        assert capfd.readouterr() == ("{}\n", "")
        assert list(warnings.filters) == before and logging.root.manager.disable == logging.NOTSET
        monkeypatch.setattr(sys, "warnoptions", ["default"])
        with pytest.raises(SystemExit, match="0"), pytest.warns(RuntimeWarning, match="overflow"):
            cli.main()
