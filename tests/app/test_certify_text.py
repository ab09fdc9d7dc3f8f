"""What ``stiction certify`` prints, in which order, and what its bound leaves out."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from .command import SPECS, stiction

TEXT = (SPECS / "one_mass.yaml").read_text().replace("  x_noise: [-5e-6, 5e-6]\n", "")
WITHOUT = "noise of x is taken as zero"


def lines_of(verb: str, text: str, folder: Path) -> list[str]:
    path = folder / "one_mass.yaml"
    path.write_text(text)
    done = stiction(verb, path)
    assert done.code == 0, done.err
    return done.out.splitlines()


def test_the_bound_is_printed_before_what_was_checked_and_what_is_assumed(tmp_path: Path) -> None:
    """A new user looked for the bound behind a screen of assumptions."""
    lines = [line.strip() for line in lines_of("certify", (SPECS / "one_mass.yaml").read_text(), tmp_path)]
    kinds = [line.partition(":")[0] for line in lines]
    assert kinds.index("error bound") == 2
    assert kinds.index("error bound") < kinds.index("checked") < kinds.index("assumes")
    assert set(kinds[kinds.index("assumes") :]) == {"assumes"}
    assert not any(WITHOUT in line for line in lines)


@pytest.mark.parametrize("verb", ["certify", "gains"])
def test_noise_that_the_envelope_does_not_bound_is_said_to_be_taken_as_zero(verb: str, tmp_path: Path) -> None:
    lines = lines_of(verb, TEXT, tmp_path)
    bounds = [line for line in lines if "long after a reversal" in line]
    assert bounds and not any("noise 0" in line or " noise 1" in line for line in bounds)
    assert any(WITHOUT in line for line in lines)


def test_the_rate_of_the_slowest_eigenvalue_says_its_measure(tmp_path: Path) -> None:
    """From the |z| that `gains` prints: -ln|z|/h there and (1 - |z|^2)/(2h) in `certify`."""
    text, h = (SPECS / "one_mass.yaml").read_text(), 1e-3
    gains = "\n".join(lines_of("gains", text, tmp_path))
    printed = re.search(r"= -ln\|z\|/h \(each sample multiplies it by \|z\| = (\S+)\)", gains)
    assert printed
    z = float(printed[1])
    certified = "\n".join(lines_of("certify", text, tmp_path))
    found = re.search(r"z of a sample has \(1 - \|z\|\^2\)/\(2h\) = (\S+) 1/s, another measure than", certified)
    assert found and float(found[1]) == pytest.approx((1 - z**2) / (2 * h), rel=1e-3)


@pytest.mark.parametrize("noisy", [True, False])
def test_exact_measurements_are_said_to_be_the_rate_s_assumption_where_the_bound_has_noise(
    noisy: bool, tmp_path: Path
) -> None:
    lines = lines_of("certify", (SPECS / "one_mass.yaml").read_text() if noisy else TEXT, tmp_path)
    assert any("include the position noise of the envelope" in line for line in lines) is noisy
    assert any("measurements are exact." in line for line in lines)
