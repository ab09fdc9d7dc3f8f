"""The prior of an arm's link parameters, correlated by the numbers of the robot file that they come from."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from mechanics.robots import SEVEN, numbers

from codegen.diagnosis.case import uncertain_values
from codegen.diagnosis.fit.residual import Problem
from codegen.diagnosis.fit.search import Search
from codegen.diagnosis.fit.trial import with_values
from codegen.diagnosis.results import Fact
from codegen.diagnosis.verdict.wrong_values import is_better, wrong_links
from codegen.logs import Log
from codegen.mechanics.base_parameters import base_values
from codegen.spec import Spec, parse_spec
from codegen.spec.motion import KinematicTree
from tests.diagnosis.stage import system_of
from tests.slow_cases import slow_except

TOLERANCE = "tolerance: {mass: 20 %, centre_of_mass: 20 %, inertia: 40 %}"
SEEN = [
    f"{joint}_{moment}" for joint in ("shoulder_pitch", "elbow_pitch", "wrist_pitch") for moment in ("mx", "my", "zz")
]


def arm(folder: Path, text: str) -> Spec:
    (folder / "arm.urdf").write_text(text, encoding="utf-8")
    return parse_spec(f"name: arm\nurdf: {{file: arm.urdf, {TOLERANCE}}}\n", folder / "arm.yaml")


def followed(problem: Problem, information: np.ndarray, true: dict[str, float]) -> dict[str, float]:
    """The most probable values of all parameters where those of ``SEEN`` are known."""
    names = [s.name for s in problem.refitted_symbols]
    seen = np.array([name in SEEN for name in names])
    rest = (information.diagonal() > 0) & ~seen
    values = problem.declared.copy()
    values[seen] = [true[name] for name in names if name in SEEN]
    off = information[np.ix_(rest, seen)] @ (values - problem.declared)[seen]
    values[rest] -= np.linalg.solve(information[np.ix_(rest, rest)], off)
    return dict(zip(names, map(float, values), strict=True))


@pytest.mark.parametrize("share", slow_except([0.8, 1.2], [0.8]))  # that of a lighter arm can fail
def test_links_that_a_log_does_not_show_follow_those_that_it_shows(share: float, tmp_path: Path) -> None:
    """Three parallel joints of seven move. With variances alone, M(x) of a lighter arm is not positive definite."""
    text = SEVEN.read_text(encoding="utf-8")
    spec = arm(
        tmp_path, re.sub(r'(mass value=|i[xyz]{2}=)"([^"]+)"', lambda m: f'{m[1]}"{share * float(m[2]):.15g}"', text)
    )
    assert isinstance(spec.form, KinematicTree)
    true = {name: float(value) for name, value in base_values(spec, spec.form).items()}
    spec = arm(tmp_path, text)
    system, deviations, changes = uncertain_values(spec, system_of(spec), cast(Log, None))
    problem = Problem(system, cast(Any, None), deviations, changes)
    random = np.random.default_rng(5)
    postures = random.uniform(-2, 2, (20, 7))

    def least(information: np.ndarray) -> float:
        """Smallest eigenvalue of M over the postures."""
        model = with_values(system, followed(problem, information, true))
        return min(np.linalg.eigvalsh(numbers(model, model.mass_matrix, x, np.zeros(7)))[0] for x in postures)

    assert least(problem.prior_information) > 0
    if share < 1:
        assert least(np.diag(problem.prior_precision)) < 0


def test_a_wrong_mass_costs_a_fit_once(tmp_path: Path) -> None:
    """The third last link is one tolerance of 20 % heavier: half a nat at most, since others may share it.

    It changes parameters of several joints. With variances alone each of them has a cost of its own.
    """
    text = SEVEN.read_text(encoding="utf-8")
    spec = arm(tmp_path, text)
    mass = list(re.finditer(r'mass value="([^"]+)"', text))[-3]
    heavier = f"{text[: mass.start(1)]}{1.2 * float(mass[1]):.15g}{text[mass.end(1) :]}"
    system, deviations, changes = uncertain_values(spec, system_of(spec), cast(Log, None))
    problem = Problem(system, cast(Any, None), deviations, changes)
    none: Any = None
    search = Search(problem, none, none)
    other = arm(tmp_path, heavier)
    assert isinstance(other.form, KinematicTree)
    true = {name: float(value) for name, value in base_values(other, other.form).items()}
    theta = np.array([true.get(s.name, float(system.values[s])) for s in search.refitted_symbols])
    prior = search.prior(search.declared_trial, theta)
    costs = prior.cost(theta), 0.5 * search.prior_precision @ (theta - search.declared) ** 2
    assert 0.1 < costs[0] <= 0.5 < costs[1], costs


def loaded(text: str, *links: str) -> str:
    """The robot file with a load at the end of some links: two to three times their mass, centre and inertia."""
    for link in links:
        at = text.index(f'<link name="{link}_link"')
        own = text[at : text.index("</inertial>", at)]
        more = re.sub(r'mass value="([^"]+)"', lambda m: f'mass value="{2.5 * float(m[1])}"', own)
        more = re.sub(r'(i[xyz]{2})="([^"]+)"', lambda m: f'{m[1]}="{(4 if m[1] != "izz" else 3) * float(m[2])}"', more)
        more = re.sub(r'xyz="([^"]+)"', lambda m: f'xyz="{" ".join(str(1.8 * float(x)) for x in m[1].split())}"', more)
        text = text.replace(own, more)
    return text


def with_loads(folder: Path, *links: str) -> tuple[Search, np.ndarray]:
    """The search of the seven-joint arm, of which only the prior is used, and the values of an arm with loads."""
    text = SEVEN.read_text(encoding="utf-8")
    spec = arm(folder, text)
    system, deviations, changes = uncertain_values(spec, system_of(spec), cast(Log, None))
    none: Any = None
    search = Search(Problem(system, none, deviations, changes), none, none)
    other = arm(folder, loaded(text, *links))
    assert isinstance(other.form, KinematicTree)
    true = {name: float(value) for name, value in base_values(other, other.form).items()}
    return search, np.array([true.get(s.name, float(system.values[s])) for s in search.refitted_symbols])


LOADS = [("elbow_pitch",), ("forearm_roll", "shoulder_pitch")]


@pytest.mark.parametrize("links", slow_except(LOADS, LOADS[1:]))
def test_the_links_with_a_load_are_those_that_explain_all_wrong_parameters(
    links: tuple[str, ...], tmp_path: Path
) -> None:
    search, values = with_loads(tmp_path, *links)
    names = [x.name for x in search.system.positions]
    found = wrong_links(search, values)
    assert found is not None and sorted(names[k] for k in found) == sorted(links)
    assert wrong_links(search, search.declared) is None


def test_a_load_on_one_link_is_fewer_changes_than_gains_of_three_drives(tmp_path: Path) -> None:
    """It moves more than three parameters out of their tolerances, and equal gains of all drives fit a log as well."""
    search, values = with_loads(tmp_path, "elbow_pitch")
    far = np.abs(values - search.declared) * np.sqrt(search.prior_precision) >= 3
    assert far.sum() > 4

    def fit(theta: np.ndarray, effects: int) -> Any:
        trial, prior = SimpleNamespace(parts=(None,) * effects), SimpleNamespace(tempering=1.0)
        return SimpleNamespace(theta=theta, trial=trial, prior=prior, residual=np.ones((10, 8)))

    assert is_better(search, fit(values, 0), search, fit(search.declared, 3))
    assert not is_better(search, fit(values, 0), search, fit(search.declared, 1))


@pytest.mark.parametrize(
    ("part", "words"), [(0.4, "within"), (1.0, "within"), (1.02, "at"), (1.08, "1.1 times"), (1.53, "1.5 times")]
)
def test_a_value_at_the_edge_of_its_tolerance_is_not_once_its_tolerance_away(part: float, words: str) -> None:
    """Of a two-link arm with masses off by 30 %, a diagnosis wrote "1 times its tolerance of 32.2 %"."""
    given = {"name": "fore_my", "value": "-0.9533", "unit": " kg*m", "was": -1.4153, "ends": ["-0.96", "-0.95"]}
    said = Fact.worded("spec.yaml", "moved value", part=part, size="32.2 %", share=0.16, drive="drive force", **given)
    assert f"-1.4153 kg*m, {words} its tolerance of 32.2 %." in said.words
