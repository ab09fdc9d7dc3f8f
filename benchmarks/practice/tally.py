"""The score of a set of fresh cases: rates of right and wrong, and what is not right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.practice import score as scoring
from benchmarks.practice.cases import Case
from benchmarks.practice.runs import Run, result_in, times
from benchmarks.practice.score import coverage, right, score
from benchmarks.rates import Rate, rate

AS_WELL = 1.05
"""A refit whose free runs of the test log have at most this multiple of the error of the true parameters leaves
nothing to find: both figures carry the noise of the positions, and restart from states that two filters made."""
ORACLES = ("true_parameters", "true_structure_true_plant")
"""On the hard tier the first has the declared parameters, which are off; the second has those of the simulation."""


@dataclass(frozen=True)
class Tally:
    """The score of one set under one version of the code.

    Attributes:
        done: cases of the set that were diagnosed; failed: the generator found no such draw.
        rates: in words → rate.
        verdicts: with their counts. cpu: median, 90th percentile and longest in s; None where no run has a result.
        absorbed: singles that the refit simulates as well as the true parameters do, each with what was said.
        wrong: what is not right, a line each.
    """

    seed: int
    count: int
    tier: str
    code: str
    done: int
    failed: int
    rates: dict[str, Rate]
    verdicts: dict[str, int]
    cpu: tuple[float, float, float] | None
    absorbed: tuple[str, ...]
    wrong: tuple[str, ...]

    @property
    def key(self) -> tuple[int, int, str, str]:
        return self.seed, self.count, self.tier, self.code


def is_absorbed(case: Case, result: dict[str, Any]) -> bool:
    """Whether the refit of the declared model simulates the test log as well as the true parameters do."""
    ours = result.get("error", {}).get("refit", {}).get("free_run_position_rmse")
    known = case.truth.get("oracle", {})
    theirs = [known[name]["sim_rmse"] for name in ORACLES if name in known]
    return case.group == "single" and ours is not None and bool(theirs) and ours <= AS_WELL * min(theirs)


def tally(key: tuple[int, int, str, str], out: Path, cases: Sequence[Case], runs: Sequence[Run], failed: int) -> Tally:
    """The score of these cases, whose results are in folders below ``out``.

    Args:
        key: seed, count, tier and version of the code.
    """
    rows = score(out, cases)
    absorbed = {case.name for case in cases if is_absorbed(case, result_in(out / case.name))}
    singles = [r for r in rows if r["group"] == "single"]
    clear = [r for r in singles if r["case"] not in absorbed]
    hidden = [r for r in singles if r["case"] in absorbed]
    inside, truths = coverage(out, cases)

    def marked(group: str, mark: str) -> Rate:
        return rate(bool(r[mark]) for r in rows if r["group"].split("_")[0] == group)

    verdicts: dict[str, int] = {}
    for r in rows:
        verdicts[r["verdict"]] = verdicts.get(r["verdict"], 0) + 1
    taken = times(runs)
    return Tally(
        *key,
        done=len(rows),
        failed=failed,
        rates={
            scoring.FIRST: rate(r["top1"] for r in clear),
            scoring.MISSED: rate(r["missed"] for r in clear),
            scoring.EXTRA: rate(r["extra_effect"] for r in singles),
            scoring.ABSORBED: rate(_absorbed_is_right(r) for r in hidden),
            scoring.FIRST_OF_ALL: rate(r["top1"] for r in singles),
            scoring.BOTH: marked("double", "both"),
            scoring.ALARM: marked("none", "false_alarm"),
            scoring.NONE: rate(right(r) for r in rows if r["group"] == "none"),
            scoring.OVERCLAIM: marked("unident", "overclaim"),
            scoring.FOREIGN: marked("foreign", "foreign_called_known"),
            scoring.INTERVALS: Rate(inside, truths),
        },
        verdicts=dict(sorted(verdicts.items())),
        cpu=None if taken is None else taken.cpu,
        absorbed=tuple(_line(r) for r in hidden),
        wrong=tuple(_line(r) for r in rows if not right(r) and not (r in hidden and _absorbed_is_right(r))),
    )


def _absorbed_is_right(row: dict[str, Any]) -> bool:
    return bool(row["top1"] or row["verdict"] == "none")


def _line(row: dict[str, Any]) -> str:
    said = ", ".join(row["found"] or row["candidates"][:2])
    return f"{' + '.join(row['truth']) or row['group']} → {row['verdict']}{f' {said}' if said else ''}"
