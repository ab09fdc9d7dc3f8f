"""Ranges of names: written out they are the spec that a person would have written out."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.spec.reader import parse_spec
from tests.expected_errors import refused

CHAIN = (Path(__file__).parents[2] / "specs" / "chain.yaml").read_text(encoding="utf-8")


def test_a_range_is_its_names_in_order():
    spec = parse_spec(CHAIN, Path("chain.yaml"))
    assert spec.positions == tuple(f"x{k}" for k in range(1, 17))
    assert [c.name for c in spec.contacts] == [f"ground{k}" for k in range(1, 17)]
    k, c, x, v = spec.symbol("k"), spec.symbol("c"), spec.symbol, spec.symbol
    expected = k * (x("x9") - 2 * x("x10") + x("x11")) + c * (v("v9") - 2 * v("v10") + v("v11"))
    assert (spec.force[9] - expected).expand() == 0
    assert [name for name in spec.envelope if name.endswith("_dot")] == [f"v{k}_dot" for k in range(1, 17)]
    contact = CHAIN[: CHAIN.index("ground1..16")].count("\n") + 1
    assert spec.places["friction.contacts[3].bodies[1]"].line == contact
    assert spec.place("coordinates.x7").line == CHAIN.splitlines().index("  x1..16: {velocity: v1..16, unit: m}") + 1


@pytest.mark.parametrize(
    ("was", "now", "found"), [("v1..16, unit", "v1..15, unit", "`v1..15` 15"), ("x1..16:", "x16..1:", "x16..1")]
)
def test_ranges_that_do_not_fit_are_told_with_their_line(was, now, found):
    with refused(f"SPEC016 chain.yaml:6: {found}"):
        parse_spec(CHAIN.replace(was, now, 1), Path("chain.yaml"))
