"""Write codegen/diagnosis/reliability.json and docs/reliability.md anew from kept diagnoses whose truth is known.

``python -m benchmarks.reliability --fit 73009 --machines 657030 --check 88411 [--out practice_results]``: the counts of
the shipped file are of the seeds of ``--fit`` and ``--machines`` and of the spiked real logs; the seeds of ``--check``
say whether the stated probabilities hold on cases that are in none of the counts. `make practice SEED=…`,
`python -m benchmarks.machines --seed S` and `python -m benchmarks.spikes` make the diagnoses, perhaps by earlier
versions of the code (``73009:CODE``, ``--spike-code``); nothing is diagnosed here.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.machines.outcome import PART, RIGHT
from benchmarks.machines.outcome import WITH as WITH_TRUTH
from benchmarks.machines.outcome import outcome_of as machine_outcome
from benchmarks.practice.cases import ROOT, TIERS, Case, cases_in
from benchmarks.practice.runs import code_version, result_in
from benchmarks.practice.tally import is_absorbed
from benchmarks.rates import Rate
from benchmarks.real.spiked import real_sets
from benchmarks.spikes.outcome import DETECTED, EXTRA, WITH, WITHOUT, WRONG, named, outcome_of, spike_of
from benchmarks.text import render
from codegen.base.files import write_atomically
from codegen.diagnosis.fit.acceptance import NEAR_NOISE
from codegen.diagnosis.reliability import FILE, Reliability, class_of

PAGE = ROOT / "docs" / "reliability.md"
Judged = tuple[str, bool]
"""Class of a verdict, and whether it was right."""


@dataclass(frozen=True)
class Source:
    """Judged logs of one kind.

    Attributes:
        words: what they are, for the page. codes: versions of the code that made the diagnoses.
    """

    words: str
    judged: tuple[Judged, ...]
    codes: tuple[str, ...]


def judged_case(case: Case, result: Mapping[str, Any]) -> Judged | None:
    """A diagnosis of a made log; None where its verdict claims nothing.

    `effect` is right where every effect that it names is in the log; `none` where there is none, where the log cannot
    show it, or where the refit of the declared model simulates as well as the truth; `ambiguous` where a true effect is
    among those that tie, or where the log cannot show it.
    """
    name = _class(result)
    if name is None:
        return None
    accepted = {kind for kinds in case.accepted for kind in kinds}
    if result["verdict"] == "effect":
        return name, case.group in ("single", "double") and set(named(result)) <= accepted
    if result["verdict"] == "none":
        nothing = case.group == "none" or case.group.startswith("unident")
        return name, nothing or is_absorbed(case, dict(result))
    tied = {*named(result), *(rival["kind"] for rival in result.get("rivals", []))}
    return name, case.group.startswith("unident") or bool(tied & accepted)


def judged_spike(plain: Mapping[str, Any], spiked: Mapping[str, Any], truth: Mapping[str, Any]) -> Judged | None:
    """A diagnosis of a spiked real log; None where it says no more than that of the plain log."""
    name, outcome = _class(spiked), outcome_of(spike_of(truth, {}, ""), plain, spiked).outcome
    if name is None or outcome not in (DETECTED, EXTRA, WRONG, WITH, WITHOUT):
        return None
    return name, outcome in (DETECTED, WITH)


def judged_machine(truth: Mapping[str, Any], result: Mapping[str, Any]) -> Judged | None:
    """A diagnosis of a machine of the other simulator (benchmarks/machines), judged as a made log is.

    `none` is wrong where a foreign disturbance can be seen, although that page counts it among the right answers there.
    """
    name = _class(result)
    if name is None:
        return None
    outcome = machine_outcome(truth, result)
    if result["verdict"] == "none":
        return name, truth["group"] == "none" or not truth["identifiable"]
    if result["verdict"] == "ambiguous":
        return name, outcome == WITH_TRUTH or (not truth["identifiable"] and truth["group"] == "single")
    return name, outcome in (RIGHT, PART)


def _class(result: Mapping[str, Any]) -> str | None:
    noise = result.get("data", {}).get("level_final")
    return None if noise is None else class_of(result["verdict"], noise <= NEAR_NOISE)


def of_machines(seed: int, out: Path) -> Iterator[tuple[Judged, str]]:
    """Every judged case of a seed of the other simulator, with the version of the code."""
    for results in sorted((out / "machines" / f"results_{seed}").glob("case_*")):
        truth = json.loads((out / "machines" / f"seed_{seed}" / results.name / "truth.json").read_text())
        found = judged_machine(truth, result_in(results))
        if found is not None:
            yield found, json.loads((results / "run.json").read_text())["code"]


def of_seed(seed: int, count: int, code: str, out: Path) -> Iterator[Judged]:
    """Every judged case of a fresh seed that was diagnosed by this code."""
    for tier in TIERS:
        draw = Path(f"seed_{seed}_{count}") / tier
        for case in cases_in(tier, out / "sets" / draw):
            found = judged_case(case, result_in(out / "fresh" / code / draw / case.name))
            if found is not None:
                yield found


def of_spikes(code: str, out: Path) -> Iterator[Judged]:
    """Every judged spiked log that was diagnosed by this code."""
    for name in real_sets([]):
        done = out / "spikes" / code / name
        plain = [result_in(folder) for folder in done.glob("plain_*")]
        for folder in sorted(done.glob("*/")) if plain else ():
            truth = out / "spikes" / "cases" / name / folder.name / "truth.json"
            if folder.name.startswith("plain_") or not truth.is_file():
                continue
            found = judged_spike(plain[0], result_in(folder), json.loads(truth.read_text()))
            if found is not None:
                yield found


def counts(judged: Iterable[Judged]) -> dict[str, tuple[int, int]]:
    """Class → (right, judged)."""
    all_of, right = Counter[str](), Counter[str]()
    for name, is_right in judged:
        all_of[name] += 1
        right[name] += is_right
    return {name: (right[name], all_of[name]) for name in sorted(all_of)}


def page(fit: Sequence[Source], check: Sequence[Source]) -> str:
    """The text of docs/reliability.md."""
    pooled = counts(one for source in fit for one in source.judged)
    checked = counts(one for source in check for one in source.judged)
    rows = [(name, Reliability(*found), Rate(*checked.get(name, (0, 0)))) for name, found in pooled.items()]
    by_source = [(source.words, counts(source.judged), source.codes) for source in fit]
    return render("reliability.md.j2", rows=rows, by_source=by_source, checked=check)


def seed_and_code(text: str) -> tuple[int, str]:
    """``73009`` or ``73009:CODE``; without a code that of the present version."""
    seed, _, code = text.partition(":")
    return int(seed), code or code_version()


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, text in (("fit", "counted"), ("check", "not counted, to check the probabilities")):
        words = f"practice logs of a seed, diagnosed by CODE (this version if not given): {text}"
        parser.add_argument(f"--{name}", type=seed_and_code, nargs="*", default=[], metavar="SEED[:CODE]", help=words)
    parser.add_argument("--machines", type=int, nargs="*", default=[], metavar="SEED", help="of benchmarks.machines")
    parser.add_argument("--count", type=int, default=60, help="cases a tier")
    parser.add_argument("--spike-code", default=code_version(), metavar="CODE", help="what diagnosed the spiked logs")
    parser.add_argument("--out", type=Path, nargs="+", default=[ROOT / "practice_results"])
    args = parser.parse_args(arguments)
    folders = [folder.resolve() for folder in args.out]

    def made(seed: int, code: str) -> Source:
        judged = tuple(one for folder in folders for one in of_seed(seed, args.count, code, folder))
        return Source(f"made logs of seed {seed} (standard and hard tier)", judged, (code,))

    machines = [one for folder in folders for seed in args.machines for one in of_machines(seed, folder)]
    spikes = tuple(one for folder in folders for one in of_spikes(args.spike_code, folder))
    fit = [made(*one) for one in args.fit]
    if machines:
        words = f"[machines of another simulator](other_machines.md), seed {', '.join(map(str, args.machines))}"
        fit.append(Source(words, tuple(one for one, _ in machines), tuple(sorted({code for _, code in machines}))))
    if spikes:
        words = "real logs with a known effect put in ([spikes.md](spikes.md))"
        fit.append(Source(words, spikes, (args.spike_code,)))
    empty = [source.words for source in fit if not source.judged]
    if empty or not fit:
        parser.exit(1, f"reliability: no diagnosis is here of {'; '.join(empty) or 'anything asked for'}\n")
    text = page(fit, [made(*one) for one in args.check])
    pooled = counts(one for source in fit for one in source.judged)
    rows = ",\n".join(f" {json.dumps(name)}: {json.dumps(found)}" for name, found in pooled.items())
    write_atomically(FILE, f"{{\n{rows}\n}}\n")
    write_atomically(PAGE, text)
    print(text)


if __name__ == "__main__":
    main()
