"""What a refusal proposes: written into the spec it is certified by a fresh run, and nothing nearer is stable.

Nearness and the longest sample time are judged by NumPy's eigenvalues of matrices written by hand.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest

from codegen.base.text import render
from codegen.certify.certify import Certificate, Proposal, Proposals, Refusal
from codegen.certify.remedies import proposals
from stiction import certify, load
from tests.app.command import SPECS, stiction
from tests.slow_cases import slow_except

ONE, TWO = "gains: {K_F: 10, K_v: 100}", "gains: {K_F: [500, 700], K_v: [10, 10]}"
RIG, DFO = "gains: {K_1: 0, K_2: -10, K_v: 50}", "gains: {K_a: -10, K_f1: -0.01, K_f2: 0, K_v: 100}"
OBSERVER = r"(?ms)^observer:\n.*?(?=^\S)"


def write(folder: Path, name: str, old: str, new: str) -> Path:
    text = (SPECS / f"{name}.yaml").read_text()
    assert text.count(old) == 1
    path = folder / f"{Path(name).name}.yaml"
    path.write_text(text.replace(old, new))
    return path


def pasted(path: Path, proposal: Proposal) -> Certificate | Refusal:
    """A fresh run with the proposed line in place of the one in the observer section."""
    key, text = proposal.line.split(":")[0], path.read_text()
    section = re.search(OBSERVER, text)
    assert section is not None
    changed, count = re.subn(rf"(?m)^  {key}:.*$", "  " + proposal.line, section[0])
    assert count == 1
    other = path.with_name("other.yaml")
    other.write_text(text.replace(section[0], changed))
    return load(other).outcome


def proposed(path: Path) -> Proposals:
    """What is proposed, each certified by a fresh run at the rate that was said."""
    found = certify(path).outcome
    assert isinstance(found, Refusal) and found.proposals is not None
    for proposal in (found.proposals.sample_time, found.proposals.gains):
        if proposal is not None:
            again = pasted(path, proposal)
            assert isinstance(again, Certificate), again.reason
            assert again.decay_rate == proposal.decay_rate > 0
    return found.proposals


def cfo_radius(k_f: float, k_v: float, h: float) -> float:
    """Of I + hΨ of specs/one_mass.yaml, m = 1, in (e_v, s e_a)."""
    return float(np.abs(np.linalg.eigvals(np.eye(2) + h * np.array([[-k_v, -1], [k_f * k_v, 0]]))).max())


LOOPS = [(20000, 100, 0.001), (10, 3000, 0.001), (900, 2500, 0.002)]


@pytest.mark.parametrize(("k_f", "k_v", "h"), slow_except(LOOPS, LOOPS[1:2], several=True))
def test_one_mass_cfo(tmp_path: Path, k_f: float, k_v: float, h: float) -> None:
    old = f"{ONE}\n  sample_time: 0.001"
    found = proposed(write(tmp_path, "one_mass", old, f"gains: {{K_F: {k_f}, K_v: {k_v}}}\n  sample_time: {h}"))
    assert found.gains is not None and found.sample_time is not None
    longest = found.sample_time.sample_time
    assert cfo_radius(k_f, k_v, longest) < 1 < cfo_radius(k_f, k_v, longest * 1.02)
    new_f, new_v = found.gains.gains["K_F"], found.gains.gains["K_v"]
    assert cfo_radius(new_f, new_v, h) < 1
    distance = abs(np.log(new_f / k_f)) + abs(np.log(new_v / k_v))
    shifts = np.linspace(-distance, distance, 61)
    nearest = min(
        abs(a) + abs(b) for a in shifts for b in shifts if cfo_radius(k_f * np.exp(a), k_v * np.exp(b), h) < 1
    )
    assert distance < nearest + 0.1  # 0.05 inside of what the eigenvalues alone would allow, and the grid's step


def test_another_integration_at_the_same_gains_and_sample_time(tmp_path: Path) -> None:
    """v_hat decays to 1/(1 + h K_v) = 1/4 in a semi-implicit sample, and grows to -2 v_hat in one of explicit Euler."""
    old = f"{ONE}\n  sample_time: 0.001"
    new = "gains: {K_F: 10, K_v: 3000}\n  sample_time: 0.001\n  integration: euler"
    path = write(tmp_path, "one_mass", old, new)
    useful = proposed(path)
    assert useful.integration is None, "the same step is proposed with its bound"
    assert useful.useful is not None and useful.useful.line == "integration: semi_implicit, sample_time: 0.001"
    path.write_text(re.sub(r"(?m)^  (v_dot|x_noise):.*\n", "", path.read_text()))
    found = proposed(path).integration
    assert found is not None and found.line == "integration: semi_implicit"
    again = pasted(path, found)
    assert isinstance(again, Certificate) and again.decay_rate == found.decay_rate > 0
    assert found.sample_time == 0.001 and found.gains == {"K_F": 10, "K_v": 3000}
    assert "integration: semi_implicit with a rate of" in " ".join(certify(path).text().split())


def test_one_mass_sample_time_too_long(tmp_path: Path) -> None:
    found = proposed(write(tmp_path, "one_mass", f"{ONE}\n  sample_time: 0.001", f"{ONE}\n  sample_time: 0.1"))
    assert found.sample_time is not None and found.gains is not None
    h = found.sample_time.sample_time
    assert cfo_radius(10, 100, h) < 1 < cfo_radius(10, 100, h * 1.02)
    assert cfo_radius(found.gains.gains["K_F"], found.gains.gains["K_v"], 0.1) < 1


def test_tracker(tmp_path: Path) -> None:
    found = proposed(write(tmp_path, "thesis/rig_to", RIG, "gains: {K_1: 0, K_2: -3000, K_v: 50}"))
    assert found.sample_time is not None and found.gains is not None
    gains = found.gains.gains
    assert (gains["K_1"], gains["K_v"]) == (0, 50)
    assert -100 < gains["K_2"] < -90  # hK_v = 1/2, J = 1, so Jury's last condition is h²|K_2 K_v| < hK_v: |K_2| < 100


@pytest.mark.slow
def test_two_masses(tmp_path: Path) -> None:
    found = proposed(write(tmp_path, "two_mass", TWO, "gains: {K_F: [50000, 70000], K_v: [100, 1000]}"))
    assert found.sample_time is not None and found.gains is not None


@pytest.mark.slow
def test_guarded_cfo(tmp_path: Path) -> None:
    """The proposed gains must leave the domain a bound too, or a fresh run would refuse it."""
    found = proposed(write(tmp_path, "one_mass_domain", ONE, "gains: {K_F: 10, K_v: 3000}"))
    assert found.gains is not None and found.sample_time is not None


@pytest.mark.parametrize(
    ("name", "old", "wrong"),
    [
        ("thesis/rig_to", RIG, RIG.replace("-10", "10")),
        pytest.param("two_mass", TWO, TWO.replace("[500, 700]", "[[500, 0], [0, -700]]"), marks=pytest.mark.slow),
        pytest.param("thesis/one_mass_dfo_implicit", DFO, DFO.replace("-10", "10"), marks=pytest.mark.slow),
    ],
)
def test_a_wrong_sign_is_turned(tmp_path: Path, name: str, old: str, wrong: str) -> None:
    found = proposed(write(tmp_path, name, old, wrong))
    assert found.gains is not None and found.sample_time is None
    assert found.gains.line == (old.replace("[500, 700]", "[[500, 0], [0, 700]]"))


@pytest.mark.slow
def test_where_nothing_helps(tmp_path: Path) -> None:
    """A DFO learns nothing of its level where the force is zero, whatever the gains."""
    path = write(tmp_path, "thesis/one_mass_dfo", DFO, DFO)
    found = proposed(path)
    assert (found.gains, found.sample_time) == (None, None) and "cannot be estimated" in found.skipped
    assert f"no other gains or sample time were tried: {found.skipped}" in " ".join(
        stiction("certify", path).err.split()
    )


def test_one_that_is_too_large(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(proposals, "LARGEST", 1)
    path = write(tmp_path, "one_mass", ONE, "gains: {K_F: 20000, K_v: 100}")
    assert proposed(path) == Proposals(None, None, "there are 2 error components, and the search takes up to 1")
    assert "tried: there are 2 error components" in stiction("certify", path).err


def test_text_and_json(tmp_path: Path) -> None:
    path = write(tmp_path, "one_mass", ONE, "gains: {K_F: 20000, K_v: 100}")
    with patch("codegen.app.certify.certify", return_value=certify(path)):
        result, told = stiction("certify", path), stiction("certify", path, "--json")
    assert (result.code, result.out, told.code) == (3, "", 3)
    content = json.loads(told.out)
    assert content["certified"] is False and content["refutation"]["along"]
    for key in ("gains", "sample_time"):
        proposal = content["proposals"][key]
        assert f"{proposal['line']} with a rate of {proposal['decay_rate']:.4g} 1/s" in result.err
    good = json.loads(stiction("certify", SPECS / "one_mass.yaml", "--json").out)
    assert good["certified"] and good["certificate"]["format"] == "stiction-certificate/1"
    assert good["sample_times"]["implicit"] is None  # any


@pytest.mark.parametrize(("longest", "warned"), [(0.0, False), (0.02, True)])
def test_the_step_of_the_code_is_compared_with_a_sample_time_that_was_found(longest: float, warned: bool) -> None:
    text = render("text/_sample_times.j2", sample_times={"euler": 0.0, "implicit": longest}, solved=False, regions=None)
    assert "euler none found" in text
    assert ("two Newton steps" in text) == warned


@pytest.mark.parametrize(
    ("name", "new", "longest_useful"),
    [("one_mass", "50 ms", ("semi_implicit", "0.02")), ("emps", "100 ms", None)],
)
def test_a_useless_bound_is_followed_by_a_step_with_a_useful_one(
    name: str, new: str, longest_useful: tuple[str, str] | None, tmp_path: Path
) -> None:
    """Both remedies had bounds of kilonewtons for a friction of 50 N, and the reader was left to guess."""
    path = tmp_path / f"{name}.yaml"
    text = (SPECS / f"{name}.yaml").read_text()
    section = re.search(OBSERVER, text)
    assert section is not None and re.search(r"(?m)^  sample_time: \S.*$", section[0])
    slow = re.sub(r"(?m)^  sample_time: .*$", f"  sample_time: {new}", section[0])
    path.write_text(text.replace(section[0], slow))
    found = certify(path).outcome
    assert isinstance(found, Refusal) and found.proposals is not None
    longest, useful = found.proposals.sample_time, found.proposals.useful
    assert longest is not None and longest.of_little_use and useful is not None
    step, h = re.fullmatch(r"integration: (\w+), sample_time: (\S+)", useful.line).groups()  # type: ignore[union-attr]
    assert float(h) <= longest.sample_time
    assert longest_useful in (None, (step, h))
    path.write_text(path.read_text().replace(f"sample_time: {new}", f"integration: {step}\n  sample_time: {h}", 1))
    again = certify(path)
    assert again.certificate is not None and not isinstance(again.bounds, str)
    assert all(b.steady < b.friction for b in again.bounds if b.friction is not None)
    assert not any(b.useless for b in again.bounds)


@pytest.mark.parametrize(("little_use", "tried"), [("|e| <= 9 N, the friction at most 5 N", True), ("", False)])
def test_a_further_step_is_tried_only_where_the_bound_is_useless(
    little_use: str, tried: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine = load(write(tmp_path, "one_mass", ONE, "gains: {K_F: 20000, K_v: 100}"))
    longest, useful = Proposal("longest", 0.01, {}, 1.0, little_use), Proposal("useful", 0.005, {}, 1.0)
    monkeypatch.setattr(proposals, "_first_certified", lambda *_: longest)
    monkeypatch.setattr(proposals, "_with_useful_bound", lambda *_: useful)
    found = proposals.propose(machine.spec, machine.analysis, lambda spec: machine, lambda: {"euler": 1e-4})
    assert found.useful is (useful if tried else None)


def test_a_proposed_sample_time_is_the_one_that_was_certified() -> None:
    """The spec's own may have more than three digits: 21.2345 ms was proposed as 0.0212."""
    line = render("text/proposed_line.j2", key="step", h=0.0212345, gains={}, step="semi_implicit").strip()
    assert line == "integration: semi_implicit, sample_time: 0.0212345"
