"""Every peer computes our step, so that ratios compare equal work; the page says what was measured."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from jinja2 import UndefinedError

from benchmarks.measure.build import Missing, Unbuilt, build, difference, outputs_of
from benchmarks.measure.compare import TOLERANCE, compare
from benchmarks.measure.counting import count
from benchmarks.model import Model, load
from benchmarks.page import PAGE, ROOT, kept, page, section
from benchmarks.peers import python_peers
from benchmarks.peers.plain_c import hand_peer, our_peer
from benchmarks.peers.study import gain_sets, in_c, in_numba
from benchmarks.result import Entry, Row
from benchmarks.rows import chain, python_twin, seven_joint_arm, two_link_arm, two_mass
from benchmarks.rows.chain import chain_rows
from benchmarks.text import render
from codegen.base.resources import resource_folder
from tests.compiled.toolchain import need
from tests.slow_cases import slow_except


@contextmanager
def installed() -> Iterator[None]:
    """Skips where a peer of the extra `benchmark` is not installed; one that is here and does not compile fails."""
    try:
        yield
    except Unbuilt:
        raise
    except Missing as missing:
        pytest.skip(str(missing))


def run(make, rows: np.ndarray, folder: Path) -> np.ndarray:
    """A peer's outputs."""
    folder.mkdir(exist_ok=True)
    (folder / "rows").write_bytes(np.ascontiguousarray(rows).tobytes())
    with installed():
        return outputs_of(build(make(), folder / "peer"), folder / "rows")


@cache
def arm() -> Model:
    return load("two_link_arm", travel=0.05, force=0.002)


@cache
def masses() -> Model:
    return load("two_mass")


OF_TWO_MASSES = [title for title, _ in two_mass.candidates(masses())[1:]]


@pytest.mark.parametrize("title", slow_except(OF_TWO_MASSES, OF_TWO_MASSES[::2]))
def test_the_two_masses(tmp_path, title):
    makers, rows = dict(two_mass.candidates(masses())), masses().rows()
    ours, theirs = (run(makers[name], rows, tmp_path / str(k)) for k, name in enumerate(("stiction", title)))
    assert np.all(np.std(ours, axis=0) > 0.01)
    assert difference(ours, theirs) < TOLERANCE


OF_THE_ARM = [title for title, _ in two_link_arm.candidates(arm())[1:]]


@pytest.mark.parametrize("title", slow_except(OF_THE_ARM, OF_THE_ARM[:1]))  # all before a measurement
def test_the_two_link_arm(tmp_path, title):
    makers, rows = dict(two_link_arm.candidates(arm())), arm().rows()
    ours, theirs = (run(makers[name], rows, tmp_path / str(k)) for k, name in enumerate(("stiction", title)))
    assert difference(ours, theirs) < TOLERANCE


@pytest.mark.parametrize("n", slow_except([4, 20], [4]))
def test_the_chain(tmp_path, n):
    ours = chain.our_chain(n, tmp_path)
    makers = dict(chain.candidates(n, ours))
    found = [run(make, chain_rows(n, 64), tmp_path / str(k)) for k, make in enumerate(makers.values())]
    assert len(found) == 3 and found[0].shape == (64, 4 * n)
    assert max(difference(found[1], other) for other in found) < TOLERANCE


@pytest.mark.slow
def test_the_seven_joints_of_pinocchio(tmp_path):
    model = load("seven_joint_arm")
    makers = dict(seven_joint_arm.candidates(model, resource_folder("specs") / "seven_joint_arm.urdf"))
    found = [run(make, model.rows(), tmp_path / str(k)) for k, make in enumerate(makers.values())]
    assert max(difference(found[0], other) for other in found) < TOLERANCE


@pytest.mark.parametrize("make", [maker for _, maker in python_twin.PEERS[1:]])
def test_the_peers_in_python(make):
    rows, names = masses().rows(256), masses().output_names
    ours = python_peers.as_table(python_peers.twin(masses())(rows), names)
    with installed():
        found = python_peers.as_table(make(masses())(rows), names)
    assert difference(ours, found) < TOLERANCE


def test_the_studies_of_gains(tmp_path):
    gains, rows = gain_sets(32), masses().rows(1000)
    scalar, lanes = (in_c(masses(), tmp_path / kind, kind, "double")(gains, rows) for kind in ("scalar", "lanes"))
    assert np.std(scalar) > 1e-3 * np.mean(scalar)
    assert scalar.tobytes() == lanes.tobytes()
    with installed():
        compiled = in_numba()
    assert np.allclose(compiled(gains, rows), scalar, rtol=TOLERANCE, atol=0)


def test_a_peer_that_computes_something_else_is_not_measured():
    others = [
        ("stiction", lambda: our_peer(masses())),
        ("a hundredth of a gain off", lambda: hand_peer("hand_two_mass", "", 3, 8, LEVEL_GAIN="500.001")),
    ]
    _, off = compare(others, masses().rows(64), counted=False)
    assert off.times is None and "something else" in off.note


def test_a_peer_that_does_not_compile_is_no_absent_one(tmp_path):
    broken = our_peer(masses())
    broken = replace(broken, files=broken.files | {"loop.c": "no C"})
    with pytest.raises(Unbuilt, match="does not compile"):
        run(lambda: broken, masses().rows(8), tmp_path / "broken")


def test_a_missing_peer_says_why():
    def absent():
        raise Missing("not installed")

    _, missing = compare(
        [("stiction", lambda: our_peer(masses())), ("other", absent)], masses().rows(64), counted=False
    )
    assert (missing.note, missing.times) == ("not installed", None)


def test_instructions_by_function_add_up(tmp_path):
    need("valgrind")
    (tmp_path / "rows").write_bytes(arm().rows(32).tobytes())
    found = count(build(our_peer(arm()), tmp_path / "peer"), tmp_path / "rows", 32)
    assert set(found.parts) > {"two_link_arm_step"}
    assert sum(found.parts.values()) == pytest.approx(found.instructions, abs=2)


def test_the_page_is_that_of_the_kept_results():
    results = kept()
    assert results is not None
    assert page(results) == (ROOT / PAGE).read_text(encoding="utf-8")


def test_the_page_needs_every_name():
    with pytest.raises(UndefinedError):
        section(Row("two_mass", "without its facts", (Entry("stiction"),)))
    with pytest.raises(UndefinedError):
        render("loop_structs.c.j2", name="x")
