"""A proof whose domain and box hold at no point, so that it says nothing, is refused: a point of them is asked for."""

from __future__ import annotations

import json
from typing import Any

import pytest

from codegen.checker import verify
from tests.checker.forged import POINT, certificate, sources

EMPTY: dict[str, dict[str, Any]] = {
    "a number below 0": {"domain": ["-1"]},
    "0 is not above 0": {"domain": ["0"]},
    "what is never above 0": {"domain": ["-fabs(inputs.x)"]},
    "a quantity and its opposite": {"domain": ["inputs.w", "-inputs.w"]},
    "ranges apart": {"domain": ["sign.rail*outputs.v_hat - 5", "3 - sign.rail*outputs.v_hat"]},
    "a range without a number": {"box": {"inputs.w": ["2", "1"]}},
    "a domain beside its box": {"domain": ["inputs.w - 2"], "box": {"inputs.w": ["0", "2"]}},
    "the code slips one way, the machine the other": {
        "domain": ["outputs.v_hat - 1"], "box": {"true.v": ["-5", "-4"]}},
    "a sign of what is 0": {"box": {"true.v": ["0", "0"]}},
}  # fmt: skip


def checked(change: dict[str, Any], name: str = "one_mass") -> verify.Report:
    files = {x: y for x, y in sources(name).items() if x != "ellipsoid.json"}
    return verify.check(json.dumps(certificate(name, "proof.json") | change), sources=files)


@pytest.mark.parametrize("kind", EMPTY)
def test_a_claim_over_no_point_is_refused(kind: str) -> None:
    for w in ("1", "3/2", "3", "-1"):
        for v in ("4", "-4", "0"):
            at = POINT | {"inputs.w": w, "true.v": v}
            with pytest.raises(verify.Refused, match="witness"):
                checked(EMPTY[kind] | {"witness": at})
    with pytest.raises(verify.Refused, match="`witness` is not of"):
        checked(EMPTY[kind])


@pytest.mark.parametrize(
    "change",
    [
        {"domain": ["3"]},
        {"domain": ["inputs.w"]},
        {"domain": ["sign.rail*outputs.v_hat - 3", "5 - sign.rail*outputs.v_hat"]},
        {"box": {"inputs.w": ["1", "1"]}},
        {"box": {"true.v": ["4", "5"]}, "domain": ["outputs.v_hat - 1"]},
    ],
    ids=str,
)
def test_a_claim_over_some_points_is_proved_with_one_of_them(change: dict[str, Any]) -> None:
    report = checked(change | {"witness": POINT})
    assert report.proved and not report.whole
    for other in (
        {x: n for x, n in POINT.items() if x != "inputs.x"},
        POINT | {"sign.rail": "1"},
        POINT | {"inputs.w": "0*inputs.x"},
    ):
        with pytest.raises(verify.Refused):
            checked(change | {"witness": other})


def test_the_witness_of_a_truth_with_a_sign_is_within_the_range_of_it_times_that_sign() -> None:
    """The levels of one_mass: sign * level is in the range."""
    down = POINT | dict.fromkeys(("true.v", "outputs.v_hat"), "-4")
    box = {"box": {"true.a_rail": ["-50", "-30"]}}
    assert checked(box | {"witness": down}).proved
    with pytest.raises(verify.Refused, match="no point of domain and box"):
        checked(box | {"witness": POINT})
