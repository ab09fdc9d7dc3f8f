"""What cannot be cancelled, or not safely, is refused with the reason; what a spec may say is checked."""

from __future__ import annotations

import pytest

from codegen.base.errors import BadInput
from codegen.cancellation import RankFalls, plan, with_cancellation
from codegen.cancellation.plan import keeps_rank
from codegen.certify import cover
from codegen.mechanics.build import build_system
from codegen.observers import build_observer
from tests.expected_errors import matches, refused
from tests.machines import machine_text, read

DIAGONAL = [[1, 0], [0, 1]]


def build(text: str):
    spec = read(text)
    return with_cancellation(spec, build_observer(spec, build_system(spec)))


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("cos(x1)", r"rank 2 falls at x1 = -?1\.571"),
        ("sin(x1) - 0.5", r"rank 2 falls at x1 = 0\.5236"),
        ("sin(x1)**2", r"rank 2 falls at x1 = -?\d"),
        ("1 - cos(x1 - 0.3)", r"rank 2 falls at x1 = 0\.3"),
    ],
)
def test_a_rank_that_falls_in_the_envelope(entry, message):
    with pytest.raises(RankFalls, match=rf"cancellation: an input matrix whose {message}.*damping"):
        build(machine_text(DIAGONAL, [[entry, "0"], ["0", "1"]], DIAGONAL, "{}", "mgto", "x1: [-2, 2]"))


@pytest.mark.parametrize("entry", ["cos(x1)", "sin(x1)**2", "sin(x1 - x2)"])
def test_the_proof_stands_alone_where_the_search_finds_nothing(entry, monkeypatch):
    monkeypatch.setattr(plan, "STARTS", 0)
    monkeypatch.setattr(cover, "DEEPEST_BOX", 8)
    spec = read(machine_text(DIAGONAL, [[entry, "0"], ["0", "1"]], DIAGONAL, "{}", "mgto"))
    system = build_system(spec)
    found = keeps_rank(system.input_matrix, 2, system.values, system.positions, ((-2.0, 2.0),) * 2)
    assert not found.proven and found.falls_at is None


@pytest.mark.parametrize("entry", ["cos(x1)", "1.01 + sin(3*x1)", "2 - exp(-x1**2/2)*cos(x2)"])
def test_a_rank_that_is_proven_to_stay(entry):
    build(machine_text(DIAGONAL, [[entry, "0"], ["sin(x2)", "1"]], DIAGONAL, "{}", "mgto", "x1: [-1.5, 1.5]"))


def test_a_rank_may_stay_though_every_pair_of_inputs_loses_it_somewhere():
    B = [["cos(x1)", "sin(x1)", "0"], ["0", "0", "1"]]
    build(machine_text(DIAGONAL, B, DIAGONAL, "{}", "mgto", "x1: [-3, 3]"))
    with pytest.raises(RankFalls):
        build(machine_text(DIAGONAL, B, DIAGONAL, "{method: appendix_b}", "mgto", "x1: [-3, 3]"))


def test_a_rank_may_stay_though_columns_and_rows_lose_it():
    """a(x) b(x)' of two unit vectors that turn: rank 1 everywhere, no entry without a zero."""
    B = [[f"{a}*{b}" for b in ("cos(x1)", "sin(x1)")] for a in ("cos(x2)", "sin(x2)")]
    text = machine_text(DIAGONAL, B, DIAGONAL, "{}", "mgto", "x1: [-3, 3], x2: [-3, 3]")
    with pytest.raises(RankFalls, match="that keeps its rank 1, while no 1 of its columns or rows do: columns whose"):
        build(text)


def test_appendix_b_speaks_of_the_inputs_it_uses():
    B = [["cos(x1)", "sin(x1)"], ["0", "0"]]
    with pytest.raises(RankFalls, match=r"an input matrix of w[12] alone whose rank 1 falls at x1 ="):
        build(machine_text(DIAGONAL, B, DIAGONAL, "{method: appendix_b}", "mgto", "x1: [-3, 3]"))


def test_what_has_no_enclosure_is_not_called_proven():
    spec = read(machine_text(DIAGONAL, [["1 + tanh(x1)/2", "0"], ["0", "1"]], DIAGONAL, "{}", "mgto"))
    system = build_system(spec)
    found = keeps_rank(system.input_matrix, 2, system.values, system.positions, ((-1.0, 1.0),) * 2)
    assert not found.proven and found.falls_at is None


@pytest.mark.parametrize(
    ("section", "key", "said"),
    [
        ("{gain: 0}", "gain", "SPEC007 0"),
        ("{gain: 3}", "gain", "SPEC007 3"),
        ("{method: smallest}", "method", "SPEC006 `smallest` 'minimum_norm' 'appendix_b'"),
        ("{weigth: identity}", "weigth", "SPEC004 `weigth` 'weight'"),
        ("{contacts: [c3]}", "contacts[0]", "SPEC008 `c3` c1, c2"),
        ("{contacts: [c1, c1]}", "contacts", "SPEC015"),
        ("{method: appendix_b, damping: 0.1}", "damping", "SPEC022 appendix_b 'minimum_norm'"),
        ("{damping: -1}", "damping", "SPEC007 -1"),
    ],
)
def test_the_section(section, key, said):
    with pytest.raises(BadInput) as told:
        build(machine_text(DIAGONAL, [[1], [1]], DIAGONAL, section))
    assert told.value.place.key == f"cancellation.{key}" and matches(told.value, said)


def test_contacts_need_an_observer_of_each():
    with pytest.raises(BadInput) as told:
        build(machine_text(DIAGONAL, [[1], [1]], DIAGONAL, "{contacts: [c1]}", "gto"))
    assert matches(told.value, "SPEC027 gto") and told.value.nearest == "mgto"


def test_nothing_is_cancellable():
    with refused("SPEC027 cancellation.contacts: all"):
        build(machine_text(DIAGONAL, [[1], [1]], DIAGONAL, "{contacts: cancellable}"))


def test_an_input_that_moves_nothing():
    with refused("SPEC027 cancellation:"):
        build(machine_text(DIAGONAL, [[0], [0]], DIAGONAL))
