"""``verify FILE`` runs without the libraries of the command line, and says the same as with them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.slow_cases import slow_except

from .command import are_messages, contents, process, stiction

GENERATED = Path(__file__).parents[2] / "generated"


def imported(*words: str) -> set[str]:
    """The packages that the command imports."""
    code = "import sys; from codegen.app.cli import main\ntry: main()\nfinally: print(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=True)
    return {name.split(".")[0] for name in done.stderr.split()}


def test_neither_typer_nor_rich_is_imported() -> None:
    path = str(GENERATED / "one_mass" / "certificate.json")
    assert not {"typer", "pydantic", "rich", "threadpoolctl"} & imported("verify", path)
    assert {"typer", "rich"} <= imported("verify", path, "--json")


@pytest.mark.parametrize("name", slow_except(["one_mass", "one_mass_domain", "two_link_arm"], ["one_mass_domain"]))
@pytest.mark.parametrize("file", ["", "certificate.json", "proof.json"])
def test_both_ways_say_the_same(name: str, file: str) -> None:
    """With --spec the verb runs through Typer; its report differs in the lines about the specification alone."""
    path = GENERATED / name / file
    alone, with_spec = stiction("verify", path), stiction("verify", path, "--spec", GENERATED / f"../specs/{name}.yaml")
    of_spec = {
        f"  {name}.yaml has the SHA-256 stated",
        "  the SHA-256 of the specification, which was not given (--spec)",
    }
    assert alone.code == with_spec.code and alone.err == with_spec.err
    assert [x for x in alone.out.splitlines() if x not in of_spec] == [
        x for x in with_spec.out.splitlines() if x not in of_spec
    ]


UNREADABLE = [("no.json",), ("empty",), ("",), ("text.json",), ("-x",), ("a.json", "b.json"), ()]


@pytest.mark.parametrize("words", slow_except(UNREADABLE, UNREADABLE[::2]))  # two processes for each
def test_what_cannot_be_read_is_said_by_the_verb(words: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "text.json").write_text("no JSON")
    before = contents(tmp_path)
    result = process("verify", *words, cwd=tmp_path)
    usage = words in [("-x",), ("a.json", "b.json"), ()]
    assert "Traceback" not in result.err and contents(tmp_path) == before
    assert are_messages(result) and ("[CALL004]" in result.err) == usage


def test_a_forged_certificate_is_refused(tmp_path: Path) -> None:
    certificate = json.loads((GENERATED / "one_mass" / "certificate.json").read_text())
    certificate["decay_rate"] = "1000"
    (tmp_path / "certificate.json").write_text(json.dumps(certificate))
    result = process("verify", "certificate.json", cwd=tmp_path)
    assert result.code == 3 and result.out.startswith("refused: certificate.json: ") and result.err == ""


def test_a_reader_that_goes_away_sees_no_traceback() -> None:
    command = [sys.executable, "-u", "-c", "from codegen.app.cli import main; main()", "verify", "generated/chain"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=GENERATED.parent) as run:
        assert run.stdout is not None and run.stderr is not None
        run.stdout.close()
        assert run.stderr.read() == b""
    assert run.returncode == 1
