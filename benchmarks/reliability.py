"""Write codegen/diagnosis/reliability.json and docs/reliability.md anew from kept diagnoses whose truth is known.

``python -m benchmarks.reliability --fit 73009 --check 88411 [--out practice_results]``: the counts of the shipped file
are of the seeds of ``--fit`` and of the spiked real logs; the seeds of ``--check`` say whether the stated probabilities
hold on cases that are in none of the counts. `make practice SEED=…` and `python -m benchmarks.spikes` make the
diagnoses, perhaps by earlier versions of the code (``--fit-code``, ``--spike-code``, ``--check-code``); nothing is
diagnosed here.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.practice.cases import ROOT, TIERS, Case, cases_in
from benchmarks.practice.runs import code_version, result_in
from benchmarks.practice.tally import is_absorbed
from benchmarks.rates import Rate
from benchmarks.real.spiked import real_sets
from benchmarks.spikes.outcome import DETECTED, EXTRA, WITH, WITHOUT, WRONG, named, outcome_of, spike_of
from codegen.base.files import write_atomically
from codegen.base.text import render
from codegen.diagnosis.fit.credit import NEAR_NOISE
from codegen.diagnosis.reliability import FILE, Reliability, class_of

PAGE = ROOT / "docs" / "reliability.md"
Judged = tuple[str, bool]
"""Class of a verdict, and whether it was right."""


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


def _class(result: Mapping[str, Any]) -> str | None:
    noise = result.get("data", {}).get("level_final")
    return None if noise is None else class_of(result["verdict"], noise <= NEAR_NOISE)


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


def page(fit: Mapping[str, tuple[int, int]], check: Mapping[str, tuple[int, int]], sources: Mapping[str, Any]) -> str:
    """The text of docs/reliability.md."""
    rows = [(name, Reliability(*found), Rate(*check.get(name, (0, 0)))) for name, found in fit.items()]
    return render("text/reliability.md.j2", rows=rows, **sources)


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", type=int, nargs="+", required=True, metavar="SEED")
    parser.add_argument("--check", type=int, nargs="*", default=[], metavar="SEED")
    parser.add_argument("--count", type=int, default=60, help="cases a tier")
    for name in ("fit", "spike", "check"):
        text = f"version of the code that made the diagnoses of --{name}; by default this one"
        parser.add_argument(f"--{name}-code", default=code_version(), metavar="CODE", help=text)
    parser.add_argument("--out", type=Path, nargs="+", default=[ROOT / "practice_results"])
    args = parser.parse_args(arguments)
    folders = [folder.resolve() for folder in args.out]

    def of(seeds: Sequence[int], code: str) -> list[Judged]:
        return [one for folder in folders for seed in seeds for one in of_seed(seed, args.count, code, folder)]

    spikes = [one for folder in folders for one in of_spikes(args.spike_code, folder)]
    fit, check = counts([*of(args.fit, args.fit_code), *spikes]), counts(of(args.check, args.check_code))
    if not fit:
        parser.exit(1, f"reliability: no diagnosis by code {args.fit_code} is here\n")
    sources = {"fitted": args.fit, "checked": args.check, "spikes": len(spikes)}
    codes = {"code": args.fit_code, "spike_code": args.spike_code, "checked_code": args.check_code}
    text = page(fit, check, sources | codes)
    rows = ",\n".join(f" {json.dumps(name)}: {json.dumps(found)}" for name, found in fit.items())
    write_atomically(FILE, f"{{\n{rows}\n}}\n")
    write_atomically(PAGE, text)
    print(text)


if __name__ == "__main__":
    main()
