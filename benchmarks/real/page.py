"""The table of docs/data_NAME.md, between its markers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.real.runs import kept, result
from benchmarks.real.sets import PAGE_NAMES, PAGES, SETS, Diagnosed
from benchmarks.text import replaced
from codegen.base.files import write_atomically
from codegen.diagnosis.fit.measure import RESTART_S

MARKERS = "<!-- python -m benchmarks.real: begin -->", "<!-- python -m benchmarks.real: end -->"
MODELS = ("declared", "refit", "augmented")
HEAD = (
    "| training → test | verdict | force error: declared / refit / augmented | free run | expert, held out |\n"
    "|---|---|---|---|---|\n"
)
SHOWN = 7
"""Parameters of an effect in a row: a sum of waves has dozens."""
SAID = "In the words of the diagnosis:"


def page_of(set_name: str) -> Path:
    """The file of the page of a set."""
    return PAGES / f"data_{PAGE_NAMES.get(set_name, set_name)}.md"


def table(set_name: str, out: Path) -> str:
    """One row a diagnosis, of what earlier runs left in ``out``, and below what is said of each."""
    rows = "".join(row(run, out / set_name / run.name) for run in SETS[set_name])
    said = "".join(words(run, out / set_name / run.name) for run in SETS[set_name])
    return HEAD + rows + (f"\n{SAID}\n\n{said}" if said else "")


def row(run: Diagnosed, out: Path) -> str:
    """The table row of one diagnosis."""
    left, found = kept(out), result(out)
    if left is None or (found is None and not left.failure):
        return f"| {run.words} | not run | | | {run.expert} |\n"
    if found is None:
        failure = left.failure.replace("|", "\\|").replace("\n", " ")
        return f"| {run.words} | no verdict: {failure} | | | {run.expert} |\n"
    forces = _forces(found["error"])
    if left.means:
        forces += f"<br>means of the logs: {' / '.join(f'{1e3 * v:.3g}' for v in left.means)} mN·m"
    return f"| {run.words} | {_verdict(found)} | {forces} | {_free_runs(found)} | {run.expert} |\n"


def words(run: Diagnosed, out: Path) -> str:
    """The verdict of one diagnosis in the tool's own words, its facts below it; empty where there is none."""
    found = result(out)
    if found is None:
        return ""
    facts = "".join(f"  - *{fact['topic']}*: {' '.join(fact['words'].split())}\n" for fact in found["facts"])
    return f"- {run.words}: **{found['headline']}**\n{facts}"


def write(set_name: str, out: Path) -> None:
    """Put the table of a set into its page."""
    page = page_of(set_name)
    write_atomically(page, replaced(page.read_text(encoding="utf-8"), table(set_name, out), MARKERS, page.name))


def _verdict(found: Mapping[str, Any]) -> str:
    named = [f"{e['kind']} on {_place(e['on'])}: {_values(e)}" for e in found["effects"]]
    return f"`{found['verdict']}`" + (f": {'; '.join(named)}" if named else "")


def _place(on: object) -> str:
    return ", ".join(map(str, on)) if isinstance(on, list) else str(on)


def _values(effect: Mapping[str, Any]) -> str:
    units = effect.get("units", {})
    each = [f"{name} = {value:.3g} {units.get(name, '')}".strip() for name, value in effect["parameters"].items()]
    more = [f"and {len(each) - SHOWN} more"] if len(each) > SHOWN else []
    return ", ".join([*each[:SHOWN], *more])


def _forces(error: Mapping[str, Mapping[str, Any]]) -> str:
    shares = [error[m]["relative_force_error"] for m in MODELS]
    return " / ".join("–" if share is None else f"{100 * share:.3g} %" for share in shares)


def _free_runs(found: Mapping[str, Any]) -> str:
    """RMS of the position restarted every so often, a line a coordinate; the time where it is not the usual one."""
    lines = []
    for i, c in enumerate(found["data"]["coordinates"]):
        each = [found["error"][m]["free_run_position_rmse_by_coordinate"][i] for m in MODELS]
        lines.append(" / ".join("diverges" if v is None else f"{v:.3g}" for v in each) + f" {c['unit']}")
    restart = found["data"].get("restart_s", RESTART_S)
    return "<br>".join([*lines, *([f"every {restart:.3g} s"] if restart != RESTART_S else [])])
