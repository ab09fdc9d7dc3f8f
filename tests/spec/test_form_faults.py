"""Topology, constraints and Lagrangian: every way to spoil one is told at its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.base.errors import BadInput
from codegen.mechanics import build_system
from codegen.observers import observer_of
from codegen.spec import parse_spec
from tests.expected_errors import matches, refused

from .form_faults import CONSTRAINTS, FAULTS, LAGRANGIAN, OBSERVER, TOPOLOGY


@pytest.mark.parametrize("text", [TOPOLOGY, CONSTRAINTS, LAGRANGIAN], ids=["topology", "constraints", "lagrangian"])
def test_the_good_ones_are_good(text: str) -> None:
    assert build_system(parse_spec(text, Path("m.yaml"))).mass_matrix.is_diagonal()


@pytest.mark.parametrize("fault", FAULTS)
def test_fault(fault: str) -> None:
    good, old, new, words, nearest = FAULTS[fault]
    assert old in good
    text = good.replace(old, new, 1)
    with pytest.raises(BadInput) as told:
        build_system(parse_spec(text, Path("m.yaml")))
    assert matches(told.value, words)
    assert nearest is None or told.value.nearest == nearest
    if fault in ("none", "no force"):
        assert told.value.place.line is None  # what is absent at the top has no line
        return
    assert told.value.place.line is not None
    above = [line for line in text.splitlines()[: told.value.place.line] if line[:1].isalpha()]
    assert told.value.place.key.startswith(above[-1].split(":")[0])  # the line is in the section that is named


REDUNDANT = "    - {name: side, bodies: top, a: 1, unit: N}\n" + OBSERVER


@pytest.mark.parametrize(
    ("kind", "gain"), [("gcfo", "K_F: 5"), ("mgto", "K_1: [[1, 0], [0, 1], [1, 1]], K_2: [[5, 1], [1, 5], [2, 1]]")]
)
def test_more_contacts_than_motions(kind: str, gain: str) -> None:
    """top on bottom, bottom on the floor, and top on a wall: three levels, two accelerations."""
    text = TOPOLOGY.replace(OBSERVER, REDUNDANT).replace("gcfo, gains: {K_F: 5", f"{kind}, gains: {{{gain}")
    with pytest.raises(BadInput) as told:
        observer_of(parse_spec(text, Path("m.yaml")))
    assert f"{kind} on 3 contacts that slide in 2 independent ways" in str(told.value)
    assert "the slip of side follows from that of between and floor, so U'M^-1 U is singular" in str(told.value)
    assert "`kind: gto` with gains of K_1, K_2, K_v" in told.value.expected and "sum" in told.value.expected
    assert not told.value.nearest and told.value.place.key == "observer.kind"


def test_more_contacts_than_motions_under_an_observer_of_coordinates() -> None:
    text = TOPOLOGY.replace(OBSERVER, REDUNDANT).replace("gcfo, gains: {K_F: 5}", "gto, gains: {K_2: -5}")
    assert observer_of(parse_spec(text, Path("m.yaml"))).system.distribution.shape == (2, 3)
    build_system(parse_spec(TOPOLOGY.replace(OBSERVER, REDUNDANT.replace(OBSERVER, "")), Path("m.yaml")))


def test_two_contacts_of_one_slip_on_enough_motions() -> None:
    text = TOPOLOGY.replace("[bottom]", "[bottom, top]")
    with refused("SPEC019 gcfo 2 1 floor between"):
        observer_of(parse_spec(text, Path("m.yaml")))


def test_a_rank_that_falls_at_single_positions_only_is_no_fault() -> None:
    """U = [[1, cos], [0, sin]]-like columns are parallel at x2 = 0 alone."""
    text = LAGRANGIAN.replace("[[1, 0], [-1, 1]]", "[[1, 1], [0, x2/l]]")
    observer_of(parse_spec(text, Path("m.yaml")))
    with refused("SPEC019 gcfo 2 1"):
        observer_of(parse_spec(LAGRANGIAN.replace("[[1, 0], [-1, 1]]", "[[1, x2/l], [0, 0]]"), Path("m.yaml")))


def test_a_distribution_beside_the_bodies_gives_the_signs() -> None:
    spec = parse_spec(TOPOLOGY.replace("friction:\n", "friction:\n  distribution: [[-1, 0], [1, 1]]\n"), Path("m.yaml"))
    assert build_system(spec).distribution.tolist() == [[-1, 0], [1, 1]]
