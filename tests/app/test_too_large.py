"""A machine beyond the checker's 32 error components: said by ``check`` already, and before any solver is tried."""

from __future__ import annotations

import re
from unittest.mock import patch

from codegen.certify import size_limit

from .command import SPECS, stiction

LIMIT = "34 error components, and the checker takes at most 32"


def longer() -> str:
    """The chain of sixteen masses with one more."""
    text = (SPECS / "chain.yaml").read_text()
    text = re.sub(r"\.\.(\d+)", lambda m: f"..{int(m[1]) + 1}", text)
    return (
        text.replace("x16)", "x17)").replace("v16)", "v17)").replace("k*(x15 ", "k*(x16 ").replace("c*(v15 ", "c*(v16 ")
    )


def test_check_says_the_limit(tmp_path):
    (tmp_path / "chain.yaml").write_text(longer())
    result = stiction("check", tmp_path / "chain.yaml")
    assert result.code == 0 and LIMIT in result.out
    assert "at most 32" not in stiction("check", SPECS / "chain.yaml").out


def test_certify_refuses_before_it_searches():
    with (
        patch.object(size_limit, "LARGEST", 1),
        patch("codegen.certify.certify.build_family", side_effect=AssertionError),
        patch("codegen.certify.remedies.sample_times.build_family", side_effect=AssertionError),
    ):
        result = stiction("certify", SPECS / "one_mass.yaml")
    assert result.code == 3
    words = " ".join((result.out + result.err).split())
    assert "2 error components, and the checker takes at most 1;" in words
    assert "narrow" not in words and "--uncertified" in words
