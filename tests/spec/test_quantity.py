"""A number with its unit, where the unit that it must have is known."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.base.errors import BadInput
from codegen.spec import Spec, parse_spec

ONE = (Path(__file__).parents[2] / "specs" / "one_mass.yaml").read_text()
LOG = "log: {scale: {t: %s, x: %s, v: %s}, cutoff_hz: %s}\n"


def spec(*pairs: tuple[str, str], behind: str = "") -> Spec:
    text = ONE
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return parse_spec(text + behind, Path("s.yaml"))


def test_a_time_in_milliseconds() -> None:
    plain, with_unit = (
        spec(),
        spec(("  sample_time: 0.001", "  sample_time: 1 ms"), ("duration: 12\n", "duration: 0.2 min\n")),
    )
    assert with_unit.observer == plain.observer and with_unit.simulation == plain.simulation


def test_scales_of_a_log() -> None:
    log = spec(behind=LOG % ("1 ms", "2 mm", "1 cm/s", "0.5 kHz")).log
    assert log == spec(behind=LOG % ("0.001", "0.002", "0.01", "500")).log


@pytest.mark.parametrize("given", ["1 mm", "1 ms/s", "foo", "ms", "1 2", "1_0 ms"])
def test_anything_else_is_told(given: str) -> None:
    with pytest.raises(BadInput) as told:
        spec(("  sample_time: 0.001", f"  sample_time: {given}"))
    assert told.value.place.key == "observer.sample_time" and given in told.value.found
    assert "alone" not in told.value.expected


def test_a_power_by_either_sign() -> None:
    length = ("parameters:\n", "parameters:\n  x0: {value: 1, unit: m}\n")
    product = spec(("  - w\n", "  - w - m*v*v/x0\n"), length)
    for power in ("v**2", "v^2", "v ^ 2"):
        assert spec(("  - w\n", f"  - w - m*{power}/x0\n"), length).force == product.force
