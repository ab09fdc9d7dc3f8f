"""Verbs called wrongly, outputs that cannot be written, pipes that close, and words that must come out as they are."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from unittest.mock import patch

import pytest

import stiction as api
from codegen.checker import verify as checker
from tests.slow_cases import slow_except

from .command import COMMAND, SPECS, contents, is_one_message, process, stiction

ONE = SPECS / "one_mass.yaml"
GENERATED = SPECS.parent / "generated"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("verb", ["check", "derive", "certify", "generate"])
@pytest.mark.parametrize(("file", "words"), [("none.yaml", "no such file"), (".", "a folder")])
def test_spec_that_is_no_file(folder, verb, file, words):
    result = stiction(verb, file)
    assert is_one_message(result) and words in result.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("chek", ONE), "(did you mean 'check'?)"),
        (("--nope",), "--nope; expected `stiction [OPTIONS] COMMAND"),
        (("check",), "'SPEC'; expected `stiction check [OPTIONS]"),
        (("check", ONE, "more"), "(more)"),
        (("check", ONE, "--jso"), "(did you mean '--json'?)"),
        (("check", ONE, "--json", "--nope"), "--nope"),
        (("check", ONE, "--json=3"), "'--json'"),
        (("gains", ONE, "-o"), "stiction gains: option '-o' requires an argument; expected a call as `stiction gains"),
        (("--effects",), "stiction: option '--effects' requires an argument; expected a call as `stiction --help`"),
    ],
)
def test_a_call_that_cannot_be_read_has_a_code(arguments, words):
    """Typer printed three lines of its own, without a code, and no JSON with --json."""
    result = stiction(*arguments)
    assert is_one_message(result) and words in result.err and "[CALL004]" in result.err


def test_derive_prints_latex_or_json():
    """With both, JSON without LaTeX was printed."""
    result = stiction("derive", ONE, "--json", "--latex")
    assert result.code == 2 and json.loads(result.out)["errors"][0]["code"] == "CALL002"


@pytest.mark.parametrize(
    "arguments",
    [
        ("certify", ONE, "-o", "file/c.json"),
        ("certify", ONE, "-o", "folder"),
        ("generate", ONE, "-o", "file"),
        ("generate", ONE, "-o", "file/deeper"),
        ("generate", ONE, "-o", "/proc/none"),  # in which even root cannot write
        ("gains", ONE, "-o", "/proc/none"),
        ("cancel", ONE, "-o", "/proc/none"),
        ("certify", ONE, "-o", "/proc/none.json"),
        ("simulate", ONE, "-o", "/proc/none.csv"),
        ("generate", ONE, "-o", "/proc/none", "--target", "fmu"),
        ("export", ONE, "-o", "/proc/none.xml", "--to", "mjcf"),
        ("export", ONE, "-o", "/proc/none", "--to", "arduino"),
        ("simulate", ONE, "-o", "folder"),
        ("simulate", ONE, "-o", "file/log.csv"),
    ],
    ids=lambda a: "-".join((a[0], *a[3:])),
)
def test_output_that_cannot_be_written(folder, arguments):
    (folder / "file").write_text("kept\n")
    (folder / "folder").mkdir()
    result = stiction(*arguments)
    assert is_one_message(result) and "cannot be written" in result.err
    assert contents(folder) == {"file": b"kept\n"}


@pytest.mark.parametrize("arguments", [("diagnose", ONE, "none.csv"), ("simulate", "none.yaml")])
def test_a_place_that_cannot_be_written_is_told_before_a_file_is_read(folder, arguments):
    """The logs were read first, which takes long."""
    result = stiction(*arguments, "-o", "/proc/none" + ".csv" * (arguments[0] == "simulate"))
    assert result.code == 2 and "/proc/none" in result.err and "no such file" not in result.err


@pytest.fixture
def mine(folder):
    """A folder with the user's own files under names that the verbs write."""
    for name in ("one.yaml", "spec.yaml", "log.csv", "cancellation.json"):
        (folder / name).write_text(ONE.read_text() + f"# mine: {name}\n")
    return folder


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("gains", "spec.yaml", "-o", "."), "spec.yaml: the spec itself; expected another file"),
        (("gains", "one.yaml", "-o", "."), "spec.yaml, which no gains.json lists"),
        (("simulate", "one.yaml", "-o", "one.yaml"), "one.yaml: the spec itself"),
        (("simulate", "one.yaml", "-o", "./spec.yaml"), "the ending `.yaml`; expected a file ending in .csv"),
        (("simulate", "one.yaml", "-o", "x.npy"), "the ending `.npy`; expected a file ending in .csv"),
        (("simulate", "one.yaml", "-o", "x"), "a name without an ending; expected a file ending in .csv"),
        (("simulate", "log.csv", "-o", "log.csv"), "the spec itself"),
        (("simulate", "one.yaml", "-o", "/dev/full"), "/dev/full: cannot be written (a device or a pipe of"),
        (("certify", "one.yaml", "-o", "one.yaml"), "one.yaml: the spec itself"),
        (("certify", "one.yaml", "-o", "spec.yaml"), "the ending `.yaml`; expected a file ending in .json"),
        (("certify", "one.yaml", "-o", "/dev/full"), "a device"),
        (("cancel", "cancellation.json", "-o", "."), "cancellation.json: the spec itself"),
        (("replay", "one.yaml", "log.csv", "-o", "log.csv"), "the log itself"),
        (("diagnose", "spec.yaml", "log.csv", "-o", "."), "spec.yaml: the spec itself"),
        (("diagnose", "one.yaml", "log.csv", "-o", "."), "spec.yaml, which no diagnosis.json lists"),
        (("generate", "one.yaml", "-o", ""), "-o: an empty name"),
        (("simulate", "one.yaml", "-o", ""), "-o: an empty name"),
        (
            ("gains", "one.yaml", "-o", "log.csv/deeper"),
            "log.csv: cannot be written (a file of that name exists); expected a folder",
        ),
        (
            ("generate", "one.yaml", "-o", "log.csv"),
            "log.csv: cannot be written (a file of that name exists); expected",
        ),
    ],
    ids=lambda a: " ".join(a) if isinstance(a, tuple) else "",
)
def test_what_is_not_ours_is_not_replaced(mine, arguments, words):
    """And it is said before any work is done: the solvers and the plant are not reached."""
    before = contents(mine)
    with (
        patch("codegen.app.gains.assess", side_effect=AssertionError),
        patch("codegen.app.simulate.simulate_plant", side_effect=AssertionError),
        patch("codegen.app.derived.Derived.outcome", property(AssertionError)),
    ):
        result = stiction(*arguments)
    assert is_one_message(result) and words in result.err, result
    assert contents(mine) == before


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (("gains", ONE, "-o", "."), "gains.json"),
        (("cancel", ONE, "-o", "."), "cancellation.json"),
    ],
)
def test_a_result_that_the_command_does_not_name_replaces_nothing_of_mine(folder, arguments, name):
    """Not a file of that name that is a log."""
    log = json.dumps([{"t": k / 1000, "x": 0.001 * k, "w": 60.0} for k in range(100)])
    (folder / name).write_text(log)
    result = stiction(*arguments)
    assert is_one_message(result) and f"{name}: a file that stiction did not write" in result.err, result
    assert contents(folder) == {name: log.encode()}


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (("gains", ONE, "-o", "."), "gains.png"),
        (("audit", "-o", "audit.md"), "audit.md"),
    ],
)
def test_a_page_replaces_nothing_of_mine(folder, arguments, name):
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).write_text("# My notes\n")
    with patch("codegen.thesis.audit.judge.run_audit", return_value=[]):
        result = stiction(*arguments)
    assert is_one_message(result) and "[FILE004]" in result.err and name in result.err, result
    assert contents(folder) == {name: b"# My notes\n"}


@pytest.mark.parametrize(
    ("asked", "meant"),
    [(("laws", "stribek"), "stribeck"), (("effects", "coging"), "cogging"), (("errors", "LOG3"), "")],
)
def test_an_unknown_name_is_told_which_command_lists_them(asked, meant):
    told = stiction(*asked)
    assert is_one_message(told) and f"`stiction {asked[0]}` lists" in told.err
    assert f"(did you mean '{meant}'?)" in told.err or not meant


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_folder_without_permission(folder):
    (folder / "shut").mkdir(mode=0o555)
    assert is_one_message(stiction("generate", ONE, "-o", "shut"))


@pytest.mark.parametrize(
    "arguments",
    [("unknown",), ("check",), ("check", ONE, "--latex"), ("simulate", ONE), ("generate",), ("diagnose", ONE)],
)
def test_unknown_verbs_and_options(folder, arguments):
    result = stiction(*arguments)
    assert is_one_message(result) and result.out == "" and "[CALL004]" in result.err
    assert not contents(folder)


def test_no_arguments_is_help(folder):
    result = stiction()
    assert "Usage" in result.out + result.err
    for verb in ("check", "derive", "certify", "verify", "generate", "simulate", "diagnose", "demo"):
        assert verb in result.out + result.err


def test_the_list_of_verbs_fits_a_terminal_of_80_columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    verbs = stiction("--help").out.split("Commands:")[1].splitlines()
    assert len(verbs) > 20 and not [line for line in verbs if line.endswith("...") or len(line) > 80]


def test_the_same_spec_again(folder):
    result = stiction("generate", ONE, ONE)
    assert is_one_message(result) and "the same spec again" in result.err
    assert not contents(folder)


def test_messages_say_what_they_mean(folder):
    assert "a device or a pipe; expected a spec file" in stiction("check", "/dev/null").err
    assert "or fmu alone" in stiction("generate", ONE, "--target", "rust").err
    for text in ("{", "hello: junk", ""):
        (folder / "text.json").write_text(text)
        for more in ((), ("--json",)):
            told = stiction("verify", "text.json", *more)
            assert is_one_message(told) and told.code == 2
            assert told.err == "error: text.json:1: text that is not JSON; expected a certificate (JSON) [CALL003]\n"
    for more in ((), ("--json",)):
        told = stiction("verify", ONE, *more)
        assert is_one_message(told) and told.code == 2 and "a certificate (JSON); this is a spec" in told.err
        assert f"`stiction generate {ONE.name}`" in told.err
    (folder / "meta.yaml").write_text("")
    (folder / "log.csv").write_text("t,x,w\n")
    told = stiction("replay", ONE, "log.csv", "-d", "meta.yaml").err
    assert "meta.yaml:1: nothing; expected a mapping such as `columns: {x: qm}`" in told


def test_spec_and_log_in_the_other_order(folder):
    (folder / "log.csv").write_text("t,x,w\n0,0,0\n")
    order = "A command takes the spec first, then the log"
    assert order in stiction("diagnose", "log.csv", ONE).err
    (folder / "spec.yaml").write_text(ONE.read_text())
    assert order in stiction("diagnose", ONE, "spec.yaml").err
    told = stiction("diagnose", ONE, "log.csv", "-c", "x=qm").err
    assert "the option is for every log of a command" in told


def test_several_specs_and_one_folder(folder):
    result = stiction("generate", ONE, SPECS / "two_mass.yaml", "-o", "x")
    assert is_one_message(result) and "-o" in result.err
    assert not contents(folder)


def test_certificate_that_cannot_be_read(folder):
    (folder / "text.json").write_text("{")
    for name in ("none.json", "text.json", "."):
        result = stiction("verify", name)
        assert result.code == 2 and result.out == "" and len(result.err.splitlines()) == 1
    told = stiction("verify", "none.json").err
    assert told == "error: none.json: no such file; expected a certificate (JSON) [FILE001]\n"


def test_a_file_that_is_not_there_is_proposed_as_the_one_alike_with_its_ending(folder):
    for name in ("stage.yaml", "stages.csv", "run_7.csv", "certificate.json"):
        (folder / name).write_text("")
    assert "(did you mean 'stage.yaml'?)" in stiction("check", "stagw.yaml").err
    assert "(did you mean 'certificate.json'?)" in stiction("verify", "certificte.json").err
    assert f"(did you mean '{folder / 'stage.yaml'}'?)" in stiction("check", folder / "stgae.yaml").err
    assert "(did you mean 'run_7.csv'?)" in stiction("replay", ONE, "runs_7.csv").err
    for name in ("axis.yaml", "stages.json", "elsewhere/stage.yaml"):
        assert "did you mean" not in stiction("check", name).err


@pytest.mark.parametrize("data", [b"t,x\n" + b"0.25,1.5\n" * 60_000, b"MATLAB 5.0\xff\xfe"])
def test_a_long_or_binary_log_in_place_of_the_spec_is_asked_for(folder, data):
    """A log below 500 kB of text was asked about, and a longer one had too many bytes for a spec."""
    (folder / "run.log").write_bytes(data)
    told = stiction("diagnose", "run.log", ONE)
    assert is_one_message(told) and "is this the log? A command takes the spec first" in told.err
    (folder / "run.yaml").write_bytes(data)
    assert "is this the log" not in stiction("check", "run.yaml").err


def test_the_folder_of_a_certificate_is_its_certificate(folder):
    generated = SPECS.parent / "generated" / "one_mass"
    named = stiction("verify", generated / "certificate.json")
    assert stiction("verify", generated) == named and named.code == 0
    assert api.verify(generated) == api.verify(generated / "certificate.json")
    assert stiction("verify", "elsewhere").code == 2


MISSING = ("certificate.json", "proof.json", "ellipsoid.json")


@pytest.mark.parametrize("name", MISSING)
def test_a_missing_proof_is_told_with_its_reason_and_the_command_that_makes_it(folder, name):
    made = shutil.copytree(SPECS.parent / "generated" / "one_mass", folder / "made")
    (made / name).unlink()
    manifest = json.loads((made / "manifest.json").read_text())
    told = stiction("verify", made / name)
    assert is_one_message(told) and "[FILE001]" in told.err
    for words in (name, "removed", f"`{manifest['tool']['command']}`"):  # it is listed
        assert words in told.err
    alone = subprocess.run([sys.executable, "-I", checker.__file__, made / name], capture_output=True, text=True)
    assert alone.returncode == 2 and alone.stderr == told.err.replace(" [FILE001]", "")
    manifest["not_made"] = {name: "not for this step"}
    (made / "manifest.json").write_text(json.dumps(manifest))
    assert "not for this step" in stiction("verify", made / name).err
    manifest["not_made"] = {name: "not shown (of d: terms cancel; all); try another: or none"}
    (made / "manifest.json").write_text(json.dumps(manifest))  # it ended at the colon, with a bracket left open
    assert "not shown (of d: terms cancel; all); expected" in stiction("verify", made / name).err
    for command in ("curl x | sh; stiction generate a.yaml", "stiction generate $(reboot).yaml", "rm -r generate"):
        manifest["tool"]["command"] = command  # a reader may run what is in backquotes
        (made / "manifest.json").write_text(json.dumps(manifest | {"not_made": {name: "not " * 10**5}}))
        told = stiction("verify", made / name)
        assert len(told.err) < 1000 and not any(word in told.err for word in ("curl", "reboot", "rm -r"))
        assert "`stiction certify SPEC`" in told.err
    (made / "manifest.json").write_text("[" * 2000)
    whole = stiction("verify", made)
    assert "`stiction generate SPEC`" in whole.err + whole.out


def test_a_folder_without_a_certificate_is_told_what_was_expected_and_what_writes_it(folder):
    """It said *expected `stiction generate SPEC` writes it*, which is no sentence."""
    (made := folder / "made").mkdir()
    told = stiction("verify", made)
    assert told.code == 2
    assert "no certificate.json; expected one: `stiction generate SPEC` writes it, where it can be made" in told.err
    (made / "proof.json").write_text("{}")
    assert "; or one of the claims in this folder: proof.json" in stiction("verify", made).err


@pytest.mark.parametrize("given", ["found", "found/generated"])
def test_verify_of_a_folder_above_the_generated_code_names_the_one_below(tmp_path, given):
    """Of a diagnosis' folder it named diagnosis.json as a claim."""
    made = tmp_path / "found" / "generated" / "one_mass"
    made.mkdir(parents=True)
    (made / "certificate.json").write_text("{}")
    (tmp_path / "found" / "diagnosis.json").write_text("{}")
    told = stiction("verify", tmp_path / given)
    assert told.code == 2 and is_one_message(told)
    assert f"did you mean '{made}'?" in told.err and "diagnosis.json" not in told.err


@pytest.mark.parametrize(("missing", "code"), [(("proof.json", "ellipsoid.json"), 5), (("ellipsoid.json",), 0)])
def test_a_manifest_cannot_forge_a_statement_of_the_checker(folder, missing, code):
    """Its reason was printed as it is: it could clear the screen, and add lines below *proved of the C*."""
    made = shutil.copytree(SPECS.parent / "generated" / "one_mass", folder / "made")
    for name in missing:
        (made / name).unlink()
    manifest = json.loads((made / "manifest.json").read_text())
    forged = "\x1b[2J\x1b[H\n  |v - v_hat| [m/s] is in the long run at most 1e-9\u202e"
    (made / "manifest.json").write_text(json.dumps(manifest | {"not_made": dict.fromkeys(missing, forged)}))
    told = stiction("verify", made)
    assert told.code == code and "stiction made none" in told.out
    assert all(line.isprintable() for line in told.out.splitlines())
    assert not any(line.startswith("  |v - v_hat|") for line in told.out.splitlines())
    assert all(text.isprintable() for text in (*api.verify(made).report.open, api.verify(made).report.unproved))


def test_code_without_a_proof_says_why_there_is_none(folder):
    shown = stiction("verify", SPECS.parent / "generated" / "one_mass_dfo_implicit")
    assert shown.code == 5 and "explicit steps only" in shown.out and "stiction certify" in shown.out


def test_a_file_with_another_ending_of_its_kind_is_proposed(folder):
    (folder / "axis.yaml").write_text(ONE.read_text())
    told = stiction("check", "axis.yml")
    assert is_one_message(told) and "did you mean 'axis.yaml'?" in told.err
    (folder / "axis.csv").touch()
    assert "did you mean" not in stiction("check", "axis.json").err
    assert "did you mean 'axis.csv'?" in stiction("replay", "axis.yaml", "axis.txt").err


def test_a_spec_that_verify_cannot_read_has_its_code(folder):
    told = stiction("verify", SPECS.parent / "generated" / "one_mass", "--spec", "none.yaml")
    assert is_one_message(told) and "none.yaml" in told.err and "[FILE001]" in told.err


def test_the_folder_of_a_refused_machine_names_the_claims_that_lie_there(folder):
    refused = SPECS.parent / "generated" / "rig_dfoa"
    told = stiction("verify", refused)
    assert told.code == 2 and told.out == "" and is_one_message(told)
    for name in ("refusal.json", "proof.json", "sliding.json"):
        assert name in told.err
        assert stiction("verify", refused / name).code in (4, 5)
    assert "manifest.json" not in told.err
    alone = subprocess.run([sys.executable, "-I", checker.__file__, refused], capture_output=True, text=True)
    assert alone.returncode == 2 and alone.stdout == ""
    assert alone.stderr == told.err.replace(" [FILE001]", "")


def test_words_that_look_like_markup_or_pictures(folder):
    text = ONE.read_text().replace("Mentzelopoulou 1994, sections 2.3 and 3.3", "'[bold]a:smile:b[/bold]'")
    (folder / ":x:.yaml").write_text(text)
    shown = stiction("check", ":x:.yaml")
    assert shown.code == 0 and "[bold]a:smile:b[/bold]" in shown.out
    assert ":x:/one_mass.c" in stiction("generate", ":x:.yaml", "-o", ":x:").out
    assert stiction("check", "[red]:x:").err.startswith("error: [red]:x:: no such file")


@pytest.mark.parametrize("verb", [("check",), ("derive",), ("derive", "--json"), ("derive", "--latex"), ("certify",)])
def test_every_verb_on_shipped_specs(folder, verb):
    """Certificates of the others are found again in tests/compiled/test_goldens.py."""
    for name in ("one_mass",) if verb == ("certify",) else ("one_mass", "two_mass", "emps", "belt_axis"):
        result = stiction(verb[0], SPECS / f"{name}.yaml", *verb[1:])
        assert result.code == 0 and result.out.strip() and result.err == ""
    assert not contents(folder)


def test_ascii_terminal(folder):
    result = process("derive", ONE, cwd=folder, env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert "Traceback" not in result.err and result.code == 0


SAID = [
    ("derive", ONE),
    ("verify", GENERATED / "one_mass_dfo"),
    ("check", SPECS / "no_such.yaml"),
    ("--help",),
    ("derive", ONE, "--json"),
    ("verify", GENERATED / "one_mass/certificate.json"),
    ("verify", GENERATED / "one_mass_dfo/sliding.json", "--json"),
    ("effects",),
    ("verify", "--help"),
    ("no_such_verb",),
]


CLOSED = [(one, closed) for one in SAID for closed in ("stdout", "stderr")]
WRITTEN_TO = [(one, "stdout") for one in (SAID[0], SAID[1], SAID[3])] + [(SAID[1], "stderr"), (SAID[2], "stderr")]
"""Verbs that write to what is closed, and one that does not."""


@pytest.mark.parametrize(("arguments", "closed"), slow_except(CLOSED, WRITTEN_TO, several=True))
def test_reader_that_goes_away(arguments, closed, folder):
    """As of `stiction ... | head -0`: nothing is said of it, whatever the verb had to say."""
    command = subprocess.Popen(
        [*COMMAND, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=SPECS.parent
    )
    one, other = (command.stdout, command.stderr) if closed == "stdout" else (command.stderr, command.stdout)
    one.close()
    said = other.read()
    assert command.wait(60) in ((1, 2) if closed == "stdout" else (0, 1, 2, 5))
    assert not any(words in said for words in ("BrokenPipe", "Exception", "internal", "cannot be written"))


def test_interrupt(folder):
    with patch("codegen.app.simulate.simulate", side_effect=KeyboardInterrupt):
        result = stiction("simulate", ONE, "-o", "log.csv")
    assert (result.code, result.err) == (130, "interrupted\n")


@pytest.mark.parametrize("step", ["euler", "implicit"])
def test_derive_names_the_limit_of_explicit_euler_as_what_it_is(folder, step):
    text = ONE.read_text().replace("sample_time: 0.001", f"sample_time: 0.001\n  integration: {step}", 1)
    (folder / "one.yaml").write_text(text)
    said = stiction("derive", "one.yaml").out
    assert ("explicit Euler is stable below" in said) == (step == "euler")
    assert ("explicit Euler, not used here," in said) == (step == "implicit")


def test_verify_says_which_file_it_wrote(tmp_path):
    shipped = SPECS.parent / "generated/one_mass/certificate.json"
    result = stiction("verify", shipped, "--smt", tmp_path / "one.smt2")
    assert result.code == 0
    assert result.out.splitlines()[-1] == str(tmp_path / "one.smt2")
    assert (tmp_path / "one.smt2").exists()
    for given in ((), ("--json",)):  # a name that cannot be written is told before what was found, not behind it
        for name in ("one.txt", "."):
            assert is_one_message(stiction("verify", shipped, "--smt", tmp_path / name, *given))


def test_an_interrupt_while_libraries_are_loaded():
    """As Ctrl-C in the first seconds: no traceback, and 130."""
    script = (
        "import builtins, signal; load = builtins.__import__\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a job in the background starts with it ignored
        "def slow(name, *rest):\n"
        "    if name == 'sympy': signal.raise_signal(signal.SIGINT)\n"
        "    return load(name, *rest)\n"
        "builtins.__import__ = slow\n"
        "import sys; sys.argv = ['stiction', 'check', 'specs/one_mass.yaml']\n"
        "from stiction import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=SPECS.parent, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_verify_prints_claim_bounds_conditions_and_gaps_and_the_rest_with_details() -> None:
    """It printed 55 lines, most of them hashes and assumptions; the script without the tool prints all of it."""
    folder = GENERATED / "one_mass"
    short = stiction("verify", folder).out.splitlines()
    full = stiction("verify", folder, "--details").out.splitlines()
    assert len(short) <= 25 < 50 <= len(full)
    assert {*short[1:-1]} <= {*full} and short[-1].startswith("more: `stiction verify --details`")
    words_of_all = "is in the long run at most", "error bounds, assuming", "sign(rail) is 1 or -1", "that the model"
    for words in (*words_of_all, "by the kernel, with the values of one_mass.h:"):
        assert any(words in line for line in short), words
    alone = subprocess.run([sys.executable, checker.__file__, folder], capture_output=True, text=True, check=True)
    assert alone.stdout.splitlines() == full
    under = stiction("verify", GENERATED / "one_mass_domain").out
    conditions = [
        x for x in stiction("verify", GENERATED / "one_mass_domain", "--details").out.splitlines() if "only where" in x
    ]
    assert conditions and all(line in under.splitlines() for line in conditions)
    loose = stiction("verify", GENERATED / "one_mass_dfo_implicit").out
    assert "it was not bound to code:" in loose and "V is multiplied by at most" in loose
    assert "The operating point stays within" in loose  # of the claim, which is printed there as the tool wrote it
