"""``import stiction``: each verb as a method and as a function gives what the command prints."""

from __future__ import annotations

import html.parser
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import stiction as api
from codegen.app import derived
from codegen.certify import certify as certify_module
from codegen.spec import read_spec
from tests.app.command import SPECS, stiction

ROOT = SPECS.parent
ONE, TWO = SPECS / "one_mass.yaml", SPECS / "two_mass.yaml"


@pytest.fixture(scope="module")
def one() -> api.Machine:
    return api.load(ONE)


class _Table(html.parser.HTMLParser):
    """The cells of an HTML table, and the elements that are still open."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.cells: list[str] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open[-1:] == ["td"]:
            self.cells.append(data)


def shows_itself(result: Any) -> None:
    """One short line in a console, and in a notebook a table of the same."""
    line = repr(result)
    assert len(line) < 250 and "\n" not in line
    words = {word.strip("<>:,") for label, value in result.summary.items() for word in f"{label} {value}".split()}
    words |= {type(result).__name__, "…", "more"}
    cut = {word.strip("<>:,") for word in line.split()} - words
    assert all("/" in word or word.replace(".", "").lstrip("-").isdigit() for word in cut), "no word is cut"
    table = _Table(result._repr_html_())
    assert table.open == [] and len(table.cells) == len(result.summary)


def test_every_name_that_is_offered_is_there() -> None:
    assert all(getattr(api, name) is not None for name in api.__all__)
    assert dir(api) == sorted(api.__all__)
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        _ = api.simulat


def test_every_verb_of_a_machine_is_a_function_too() -> None:
    methods = {name for name in vars(api.Machine) if callable(getattr(api.Machine, name)) and name in api.__all__}
    verbs = {"check", "derive", "gains", "certify", "generate", "simulate", "diagnose", "verify", "cancel", "replay"}
    verbs |= {"export", "watch"}
    assert methods == verbs


def test_the_import_alone_loads_nothing() -> None:
    """Not even what reads a spec, nor the errors."""
    script = "import sys; before = set(sys.modules); import stiction; print(*set(sys.modules) - before)"
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    loaded = done.stdout.split()
    assert {name for name in loaded if name.startswith("codegen")} == {"codegen"}
    assert not {"numpy", "sympy", "casadi", "typer", "rich", "pydantic", "jinja2"} & set(loaded)


@pytest.mark.parametrize(
    "script",
    [
        "import stiction; print(stiction.__version__)",
        "import runpy; sys.argv[1:] = ['--version']; runpy.run_module('stiction', None, '__main__')",
    ],
    ids=["import", "python -m"],
)
def test_a_codegen_in_the_working_directory_is_not_taken_for_ours(tmp_path: Path, script: str) -> None:
    """Both look into the working directory first."""
    (tmp_path / "codegen.py").write_text("raise SystemExit('the user's own')")
    script = f"import sys; sys.path.append({str(ROOT)!r}); {script}"
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, f"{api.__version__}\n"), done.stderr


def test_another_codegen_that_is_imported_already_is_said(tmp_path: Path) -> None:
    (tmp_path / "codegen.py").write_text("")
    script = f"import sys; import codegen; sys.path.append({str(ROOT)!r}); import stiction"
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert "ImportError: stiction needs its own package codegen" in done.stderr


def test_check_is_the_machine(one: api.Machine) -> None:
    from codegen.app.check import check_text

    assert one.check() is one
    assert check_text(one) == stiction("check", ONE).out
    shows_itself(one)
    with pytest.raises(api.BadInput, match="no_such"):
        api.check("no_such.yaml")


def test_derive(one: api.Machine) -> None:
    from codegen.app.derive import derive_text

    assert one.derive() is one.derive() is one.analysis
    assert derive_text(one.derive()) == derive_text(api.derive(ONE)) == stiction("derive", ONE).out
    shows_itself(one.derive())


def test_gains(one: api.Machine) -> None:
    found = one.gains()
    assert json.dumps(found.content, indent=1, ensure_ascii=False) == stiction("gains", ONE, "--json").out.rstrip()
    shows_itself(found)


def test_certify_verify_and_generate_hand_out_one_certificate(one: api.Machine, tmp_path: Path) -> None:
    found = one.certify()
    assert found.certificate is one.outcome
    assert json.loads(stiction("certify", ONE, "--json").out)["certificate"] == found.certificate.content
    assert one.certify(out=tmp_path / "c.json").outcome is one.outcome
    assert (tmp_path / "c.json").read_text("utf-8") == found.certificate.text
    made = one.generate(tmp_path / "one_mass")
    assert (made.folder / "certificate.json").read_text("utf-8") == found.certificate.text
    assert {path.name: path.read_text("utf-8") for path in made.folder.iterdir()} == dict(one.files)
    checked = one.verify()
    assert checked == one.verify(made.folder / "certificate.json") == api.verify(made.folder / "certificate.json", ONE)
    assert checked.report.proved and checked.report.facts
    said = stiction("verify", made.folder / "certificate.json", "--spec", ONE, "--details").out
    assert all(fact in said for fact in checked.report.facts)
    for result in (found, found.certificate, *found.bounds, made, checked):
        shows_itself(result)
    assert repr(found.bounds[0]) == "<ErrorBound: error e_a_rail, long after a reversal at most 1.79 N>"


def test_a_certificate_of_another_machine_is_refused(one: api.Machine) -> None:
    with pytest.raises(api.Refused):
        api.load(TWO).verify(ROOT / "generated" / "one_mass" / "certificate.json")


def test_a_claim_in_words_which_nobody_checks_is_not_shown_beside_verified(tmp_path: Path) -> None:
    """It was the only thing that a console showed: a forger's sentence, as verified."""
    shutil.copytree(ROOT / "generated" / "one_mass", tmp_path / "one_mass")
    path = tmp_path / "one_mass" / "certificate.json"
    forged = json.loads(path.read_text("utf-8")) | {"claim": "The friction error is zero."}
    path.write_text(json.dumps(forged), "utf-8")
    line = repr(api.verify(path))
    assert "error is zero" not in line and "status verified" in line and "at most 0.9787" in line


def test_verify_without_a_certificate_says_why(tmp_path: Path) -> None:
    path, text = tmp_path / "slow.yaml", ONE.read_text("utf-8")
    assert "sample_time: 0.001" in text
    path.write_text(text.replace("sample_time: 0.001", "sample_time: 0.1"), "utf-8")
    machine = api.load(path)
    shows_itself(machine.outcome)
    with pytest.raises(api.BadInput, match="no certificate"):
        machine.verify()


def test_cancel(one: api.Machine) -> None:
    found = one.cancel()
    assert json.dumps(found.content, indent=1, ensure_ascii=False) == stiction("cancel", ONE, "--json").out.rstrip()
    shows_itself(found)


def test_simulate_replay_and_diagnose(one: api.Machine, tmp_path: Path) -> None:
    log = one.simulate(tmp_path / "log.csv")
    stiction("simulate", ONE, "-o", tmp_path / "same.csv")
    assert log.path.read_bytes() == (tmp_path / "same.csv").read_bytes()
    replayed = one.replay(log.path, tmp_path / "estimates.csv")
    stiction("replay", ONE, log.path, "-o", tmp_path / "same_estimates.csv")
    assert (tmp_path / "estimates.csv").read_bytes() == (tmp_path / "same_estimates.csv").read_bytes()
    for result in (log, replayed):
        shows_itself(result)


def test_text_of_a_result_needs_no_options_and_is_what_the_command_prints(
    one: api.Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    log = one.simulate("log.csv").path
    slow = tmp_path / "slow.yaml"
    slow.write_text(ONE.read_text("utf-8").replace("sample_time: 0.001", "sample_time: 0.1"), "utf-8")
    calls: list[tuple[Any, tuple[object, ...]]] = [
        (api.simulate(ONE, "again.csv"), ("simulate", ONE, "-o", "again.csv")),
        (one.gains(), ("gains", ONE)),
        (one.certify(), ("certify", ONE)),
        (one.generate("made"), ("generate", ONE, "-o", "made")),
        (one.generate("made", check_only=True), ("generate", ONE, "-o", "made", "--check")),
        (one.generate("none", check_only=True), ("generate", ONE, "-o", "none", "--check")),
        (api.generate(slow, "made"), ("generate", slow, "-o", "made")),
        (api.generate(slow, "slow", uncertified=True), ("generate", slow, "-o", "slow", "--uncertified")),
        (api.generate_fmu(one, "made"), ("generate", ONE, "-o", "made", "--target", "fmu")),
        (api.generate_fmu(slow, "made"), ("generate", slow, "-o", "made", "--target", "fmu")),
        (one.watch(log), ("watch", ONE, "--log", log)),
        (one.cancel(), ("cancel", ONE)),
        (one.export("mjcf", "m.xml"), ("export", ONE, "--to", "mjcf", "-o", "m.xml")),
    ]
    for result, command in calls:
        assert result.text() == stiction(*command).out, command
        shows_itself(result)
    assert "12000 samples" in one.replay(log).text()


def test_the_units_of_estimates(one: api.Machine, tmp_path: Path) -> None:
    replayed = one.replay(one.simulate(tmp_path / "log.csv").path, tmp_path / "estimates.csv")
    assert set(replayed.units) == set(replayed.estimates) - {"fault"}
    assert (replayed.units["t"], replayed.units["v_hat"], replayed.units["F_hat_rail"]) == ("s", "m/s", "N")


@pytest.mark.parametrize("name", ["estimates.csv", "estimates.npy"])
def test_estimates_that_were_replaced_by_another_file(one: api.Machine, tmp_path: Path, name: str) -> None:
    replayed = one.replay(one.simulate(tmp_path / "log.csv").path, tmp_path / name)
    if name.endswith(".npy"):
        np.save(tmp_path / name, np.zeros((3, 2)))
    else:
        (tmp_path / name).write_text("mine\n")
    with pytest.raises(api.BadInput, match="expected the estimates that replay wrote"):
        _ = replayed.estimates


def test_progress_of_a_verb_without_a_callback_is_shown_on_standard_error() -> None:
    script = f"import stiction\nwith stiction.progress(lines=True): stiction.load({str(ONE)!r}).certify()"
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout == "" and "certificate ...\n" in done.stderr


@pytest.mark.slow
def test_diagnose_is_the_verb(one: api.Machine, tmp_path: Path) -> None:
    log = one.simulate(tmp_path / "log.csv").path
    found = one.diagnose(log, out=tmp_path / "by_method")
    said = stiction("diagnose", ONE, log, "-o", tmp_path / "by_command").out
    by_method, by_command = (tmp_path / f / "diagnosis.json" for f in ("by_method", "by_command"))
    assert by_method.read_bytes() == by_command.read_bytes()
    assert found.verdict == json.loads(by_method.read_text("utf-8"))["verdict"]
    assert said.endswith(found.text()[found.text().index("verdict: ") :].replace("by_method", "by_command"))
    assert f"{found.folder}/report.html" in found.text()
    for result in (found, found.diagnosis):
        shows_itself(result)


def test_what_is_derived_is_derived_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The system by one call and the observer by one, whatever is asked of a machine, in any order; `gains` tries other
    gains, which are specs of their own.
    """
    within = {"system_of": derived, "observer_of": derived, "_program": derived, "certify": certify_module}
    counts = dict.fromkeys(within, 0)

    def counted(name: str) -> Any:
        real = getattr(within[name], name)

        def call(*given: Any, **named: Any) -> Any:
            counts[name] += getattr(given[0], "spec", given[0]) is machine.spec
            return real(*given, **named)

        return call

    machine = api.load(ONE)
    for name in counts:
        monkeypatch.setattr(within[name], name, counted(name))
    for verb in (machine.check, machine.cancel, machine.derive, machine.certify, machine.verify, machine.gains):
        verb()
    assert counts == dict.fromkeys(counts, 1)


def test_free_gains_are_at_mid_range_for_what_does_not_depend_on_them(tmp_path: Path) -> None:
    path = tmp_path / "free.yaml"
    text = ONE.read_text("utf-8")
    assert "K_F: 10," in text
    path.write_text(text.replace("K_F: 10,", "K_F: {free: [1, 100]},"), "utf-8")
    machine = api.load(path)
    assert machine.check() is machine and machine.nominal.system is machine.system
    assert {str(s): float(v) for s, v in machine.nominal.observer.gains.items()} == {"K_F": 10.0, "K_v": 100.0}
    with pytest.raises(api.BadInput, match="the gain `K_F` is free"):
        _ = machine.observer
    assert api.load(ONE).nominal.spec.observer == read_spec(ONE).observer


def test_choices_of_the_command_change_the_code_and_share_the_mechanics(one: api.Machine) -> None:
    single = one.with_overrides(api.Overrides(precision="single"))
    assert single.system is one.system and one.with_overrides(None) is one
    assert "float x;" in single.sources["one_mass.h"] and "double x;" in one.sources["one_mass.h"]
    with pytest.raises(api.BadInput, match="`precision`"):
        one.generate(overrides=api.Overrides(precision="half"))


def test_a_result_of_diagnose_has_verdict_and_effects_itself() -> None:
    within: Any = SimpleNamespace(verdict="effect", effects=("cogging",))
    found = api.Diagnosed(within, Path("folder"), ())
    assert (found.verdict, found.effects) == (within.verdict, within.effects)
