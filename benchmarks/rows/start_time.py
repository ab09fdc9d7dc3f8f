"""Seconds of the processor that a command takes from nothing: help, a wrong word, and the verbs that answer at once."""

from __future__ import annotations

import statistics
import subprocess
import sys

from benchmarks.page import ROOT
from benchmarks.result import Goal, Row, Table, figure

REPEAT = 7
NUMPY = "python -c 'import numpy'"
WORDS = "--help", "--version", "chekc", "check --help", "diagnose --help"
VERBS = "verify generated/one_mass/certificate.json", "check specs/one_mass.yaml", "derive specs/one_mass.yaml"
START = "import sys; sys.argv[0] = 'stiction'; from stiction import main; main()"
AT_ONCE, CHECK = 0.4, 1.2
MEASURE = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
print(used.ru_utime + used.ru_stime)
"""


def seconds(*python: str) -> float:
    """CPU time, user and system, of one run of Python with these arguments."""
    command = [sys.executable, "-c", MEASURE, sys.executable, *python]
    return float(subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout)


def row() -> Row:
    runs = {NUMPY: ("-c", "import numpy")}
    runs |= {f"stiction {words}": ("-c", START, *words.split()) for words in (*WORDS, *VERBS)}
    spent: dict[str, list[float]] = {title: [] for title in runs}
    for _ in range(REPEAT):  # in turn, so that what else the machine does meets all alike
        for title, arguments in runs.items():
            spent[title].append(seconds(*arguments))
    median = {title: statistics.median(found) for title, found in spent.items()}
    lines = [
        (title, figure(median[title]), figure(min(found)), figure(median[title] / median[NUMPY]))
        for title, found in spent.items()
    ]
    slowest = max(median[f"stiction {words}"] for words in WORDS)
    check = median["stiction check specs/one_mass.yaml"]
    return Row(
        "start_time",
        "From the command to its first word",
        goals=(
            Goal("help, version and a wrong word in under 0.4 s", slowest, AT_ONCE, unit=" s", basis="seconds"),
            Goal("`check` of one mass in under 1.2 s", check, CHECK, unit=" s", basis="seconds"),
        ),
        tables=(Table(("command", "median, s", "least, s", "÷ import numpy"), tuple(lines)),),
    )
