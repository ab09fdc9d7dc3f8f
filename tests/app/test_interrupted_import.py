"""Ctrl-C while a verb's libraries are being imported: it interrupts, and the next call finds whole libraries."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.app.command import SPECS

SCRIPT = """
import os, signal, sys
import stiction


class Presser:  # Ctrl-C is pressed when a module is looked for, once
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[2]:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)


sys.meta_path.insert(0, Presser())
for k in range(2):
    try:
        stiction.load(sys.argv[1]).diagnose("absent.csv")
    except KeyboardInterrupt:
        print("interrupted")
    except stiction.BadInput as fault:
        print(fault)
assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
"""


@pytest.mark.parametrize("module", ["scipy.signal.bsplines", "codegen.diagnosis.case", "codegen.spec.reader"])
def test_an_interrupted_import_is_finished_first(module: str) -> None:
    command = [sys.executable, "-c", SCRIPT, str(SPECS / "one_mass.yaml"), module]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    first, second = done.stdout.splitlines()
    assert first == "interrupted" and second.startswith("absent.csv: no such file")
