"""``stiction generate``: what it writes, when it is current, and what it refuses."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from codegen.app import derived
from codegen.checker import verify as checker
from codegen.emit.header import manifest_text
from tests.slow_cases import slow_except

from .command import SPECS, contents, is_one_message, process, stiction

NAMES = {"one_mass.h", "one_mass.c", "one_mass.mk", "CMakeLists.txt", "example_main.c", "__init__.py"}
PROOFS = {"certificate.json", "proof.json", "ellipsoid.json", "limit.json"}
NAMES |= PROOFS | {"manifest.json", "README.md"}
UNSTABLE = (SPECS / "one_mass.yaml").read_text().replace("K_F: 10, K_v: 100", "K_F: 10, K_v: 3000")


OUTCOMES = {}


@pytest.fixture(autouse=True)
def certified_once(monkeypatch):
    """The search for a certificate depends on spec and code alone: what this file asks again is answered as before."""
    search = vars(derived.Derived)["outcome"].func

    def outcome(machine):
        key = (machine.spec.sha256, *machine.sources.items())
        if key not in OUTCOMES:
            OUTCOMES[key] = search(machine)
        return OUTCOMES[key]

    monkeypatch.setattr(derived.Derived, "outcome", property(outcome))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(SPECS / "one_mass.yaml", tmp_path / "one_mass.yaml")
    return tmp_path


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    here = tmp_path_factory.mktemp("made")
    result = stiction("generate", SPECS / "one_mass.yaml", "-o", here / "one_mass")
    assert result.code == 0 and result.err == ""
    return here / "one_mass"


@pytest.fixture
def generated(folder, made):
    """As the command writes it there: the same bytes from everywhere is a test below."""
    return shutil.copytree(made, folder / "generated" / "one_mass")


def test_every_file_and_its_path_is_told(folder):
    result = stiction("generate", "one_mass.yaml")
    assert set(contents(folder / "generated" / "one_mass")) == NAMES
    for name in NAMES:
        assert f"generated/one_mass/{name}\n" in result.out
    assert {p.name for p in folder.iterdir()} == {"one_mass.yaml", "generated"}


def test_same_bytes_again_and_from_elsewhere(generated, folder, monkeypatch):
    first = contents(generated)
    assert stiction("generate", "one_mass.yaml").code == 0
    assert contents(generated) == first
    (folder / "else").mkdir()
    result = process("generate", folder / "one_mass.yaml", "-o", "here", cwd=folder / "else")
    assert result.code == 0
    assert contents(folder / "else" / "here") == first


def test_no_path_and_no_date(generated, folder):
    for name, data in contents(generated).items():
        text = data.decode()
        text = text.replace("Mentzelopoulou 1994", "")
        assert str(folder) not in text and "/tmp" not in text and "/work" not in text and "/home" not in text, name
        assert not re.search(r"\b20[2-9]\d-\d\d|\b(19|20)\d\d\b(?![0-9a-f])", re.sub(r'"-?\d+(/\d+)?"', "", text)), name


def test_nothing_else_in_the_folder_is_touched(folder):
    target = folder / "generated" / "one_mass"
    target.mkdir(parents=True)
    (target / "notes.txt").write_text("mine")
    assert stiction("generate", "one_mass.yaml").code == 0
    assert set(contents(target)) == {*NAMES, "notes.txt"}
    assert (target / "notes.txt").read_text() == "mine"


def test_check_is_current(generated):
    before = contents(generated)
    result = stiction("generate", "one_mass.yaml", "--check")
    assert (result.code, result.out) == (0, "current: generated/one_mass\n")
    assert contents(generated) == before


def test_check_of_nothing(folder):
    result = stiction("generate", "one_mass.yaml", "--check")
    assert result.code == 4 and result.out.startswith("stale: ")
    assert list(contents(folder)) == ["one_mass.yaml"]


EDITS = [(edit, name) for edit in ("append", "delete", "binary", "cut") for name in sorted(NAMES)]
EACH = [EDITS[k % 4 * len(NAMES) + k] for k in range(len(NAMES))]
"""Each file with one of the edits."""


@pytest.mark.parametrize(("edit", "name"), slow_except(EDITS, EACH, several=True))
def test_check_sees_every_edit(generated, name, edit):
    path = generated / name
    if edit == "append":
        path.write_text(path.read_text() + "\n")
    elif edit == "cut":
        path.write_text(path.read_text()[:-3])
    elif edit == "binary":
        path.write_bytes(b"\xff\x00")
    else:
        path.unlink()
    result = stiction("generate", "one_mass.yaml", "--check")
    assert result.code == 4 and name in result.out


@pytest.mark.parametrize("key", ["claim", "assumptions", "matrix", "error", "tool"])
def test_check_sees_a_certificate_of_something_else(generated, key):
    path = generated / "certificate.json"
    content = json.loads(path.read_text())
    changes = {
        "claim": "the machine is safe",
        "assumptions": [],
        "matrix": [["-1", "0"], ["0", "-1"]],
        "error": [{"name": n, "meaning": "", "unit": ""} for n in "ab"],
        "tool": {"name": "x", "version": "y", "command": "z"},
    }
    path.write_text(json.dumps(content | {key: changes[key]}))
    assert stiction("generate", "one_mass.yaml", "--check").code == 4


def test_check_accepts_other_digits_of_the_solver(generated):
    """Another run of a solver may give another P and rate; what follows from them must follow from them."""
    names = ("certificate.json", "proof.json", "README.md", "manifest.json")
    files = {name: (generated / name).read_text() for name in names}
    made = json.loads(files["certificate.json"])
    rate = checker.Fraction(made["decay_rate"])
    changed = dict(files)
    for a, b in [(made["decay_rate"], str(rate / 2)), (f"{float(rate):.6g} 1/s", f"{float(rate) / 2:.6g} 1/s")]:
        changed = {name: text.replace(a, b) for name, text in changed.items()}
    changed["certificate.json"] = re.sub(r'"dwell_samples": \d+', '"dwell_samples": 9999', changed["certificate.json"])
    changed["proof.json"] = re.sub(r'"dwell": "\d+"', '"dwell": "9999"', changed["proof.json"])
    (generated / "certificate.json").write_text(changed["certificate.json"])
    assert stiction("verify", generated / "certificate.json").code == 0
    stale = stiction("generate", "one_mass.yaml", "--check").out
    assert "README.md, proof.json, manifest.json" in stale  # the kernel's proof is of the certificate beside it
    for name in names[:3]:
        old, new = (hashlib.sha256(text[name].encode()).hexdigest() for text in (files, changed))
        changed["manifest.json"] = changed["manifest.json"].replace(old, new)
    changed["manifest.json"] = manifest_text(json.loads(changed["manifest.json"]))
    for name, text in changed.items():
        (generated / name).write_text(text)
    assert stiction("generate", "one_mass.yaml", "--check").code == 0


def test_check_sees_an_edited_spec(generated, folder):
    spec = folder / "one_mass.yaml"
    spec.write_text(spec.read_text().replace("a: 50", "a: 51"))
    assert stiction("generate", "one_mass.yaml", "--check").code == 4
    spec.write_text(spec.read_text().replace("a: 51", "a: 50") + "# a remark\n")
    assert stiction("generate", "one_mass.yaml", "--check").code == 4


def test_manifest(generated, folder):
    manifest = json.loads((generated / "manifest.json").read_text())
    files = {name: hashlib.sha256(data).hexdigest() for name, data in contents(generated).items()}
    del files["manifest.json"]
    assert manifest["files"] == files
    assert manifest["spec"] == {
        "file": "one_mass.yaml",
        "sha256": hashlib.sha256((folder / "one_mass.yaml").read_bytes()).hexdigest(),
    }


def test_refused_gains_write_nothing(folder):
    (folder / "one_mass.yaml").write_text(UNSTABLE)
    result = stiction("generate", "one_mass.yaml")
    assert result.code == 3 and result.out.startswith("refused: ") and "nothing written" in result.out
    assert result.out.endswith("stable\n") and not result.out.endswith("\n\n")
    for verb in ("certify", "gains"):
        assert f"`stiction {verb} one_mass.yaml`" in result.out
    assert stiction("certify", "one_mass.yaml", "-o", "c.json").code == 3
    assert list(contents(folder)) == ["one_mass.yaml"]


def test_a_version_of_the_fmu_without_an_fmu_is_refused(folder):
    (folder / "one_mass.yaml").write_text(UNSTABLE)
    for given in (("2.0",), ("4.0",), ("3.0", "--target", "c")):
        result = stiction("generate", "one_mass.yaml", "--uncertified", "--fmi", *given)
        assert is_one_message(result) and "--target fmu" in result.err and "[CALL002]" in result.err
    assert list(contents(folder)) == ["one_mass.yaml"]


def test_the_readme_shows_the_bounds_of_its_file(generated):
    """Its figures are those of ellipsoid.json, rounded up."""
    text = (generated / "README.md").read_text()
    (*_, ball) = json.loads((generated / "ellipsoid.json").read_text())["sets"]
    noise = 1000 * 5e-6  # what that of the same sample adds
    (after,) = ball["after"]
    (steady,) = (bound for *row, bound in ball["rows"] if row == after["row"])  # the other row is that of the slip
    *stated, _ = after["bounds"]  # the last one serves the others, and is not stated
    for bound in (steady, *(b for _, b in stated)):
        exact = float(checker.Fraction(bound)) + noise
        assert any(exact <= float(x) < 1.0001 * exact for x in re.findall(r"([\d.]+) N\b", text)), exact


def test_a_proof_of_an_earlier_run_is_removed(generated):
    old, manifest = generated / "sliding.json", json.loads((generated / "manifest.json").read_text())
    old.write_text("{}")
    manifest["files"]["sliding.json"] = hashlib.sha256(b"{}").hexdigest()
    (generated / "manifest.json").write_text(manifest_text(manifest))
    assert "sliding.json" in stiction("generate", "one_mass.yaml", "--check").out
    assert stiction("generate", "one_mass.yaml").code == 0 and not old.exists()


def test_a_refused_dfo_has_its_regions_in_the_readme():
    made = SPECS.parent / "generated/rig_dfoa"
    said = (made / "README.md").read_text()
    said = said[said.index("## Stability") :]
    for name in ("sliding", "presliding", "weak", "passing", "recovery"):
        rate = float(checker.Fraction(json.loads((made / f"{name}.json").read_text())["decay_rate"]))
        (line,) = (line for line in said.splitlines() if line.startswith(f"- `{name}.json`: "))
        assert f"alpha = {rate:.6g} 1/s" in line and "The region: a_plates in [24, 36], f_plates_along in [" in line


@pytest.mark.parametrize(
    "made", sorted((SPECS.parent / "generated").glob("*/manifest.json")), ids=lambda p: p.parent.name
)
def test_every_file_is_in_the_readme(made):
    said = made.with_name("README.md").read_text()
    listed = set(json.loads(made.read_text())["files"]) - {"README.md"}
    assert not {name for name in listed if f"`{name}`" not in said}


@pytest.mark.parametrize("where", ["generated/one_mass", "c"])
def test_the_readme_says_the_import_of_either_place(generated, folder, where):
    """With -o c it said `from generated import one_mass` alone."""
    if where == "c":
        shutil.copytree(generated, folder / "c")
    (code,) = re.findall(r"```python\n(.*?)```", (folder / where / "README.md").read_text(), re.DOTALL)
    default, elsewhere, *calls = code.splitlines()
    line = default if where.startswith("generated") else elsewhere.replace("NAME_OF_THIS_FOLDER", "c")
    program = "\n".join([line, *calls, "print(outputs)"])
    done = subprocess.run([sys.executable, "-c", program], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "F_hat" in done.stdout, done.stderr


def test_uncertified(folder):
    (folder / "one_mass.yaml").write_text(UNSTABLE)
    assert stiction("generate", "one_mass.yaml", "--uncertified").code == 0
    target = folder / "generated" / "one_mass"
    assert set(contents(target)) == NAMES - PROOFS | {"refusal.json"}
    readme = (target / "README.md").read_text()
    assert "**No certificate**" in readme and "certificate.json" not in readme
    assert stiction("generate", "one_mass.yaml", "--check", "--uncertified").code == 0


PERIODIC = "{kind: cogging, on: x, parameters: {amplitude: 2, period: 0.1, phase: 0}}"
DELAYED = "{kind: input_delay, on: w, parameters: {T: 0.002}}"
WOBBLING = "{kind: encoder_eccentricity, on: x, parameters: {amplitude: 0.001, period: 0.3, phase: 0}}"


@pytest.mark.parametrize(
    ("effect", "status"),
    [(PERIODIC, 0), (DELAYED, 4), (WOBBLING, 5), ("", 0)],
    ids=["periodic", "delay", "sensor", "none"],
)
def test_generate_says_why_verify_will_bind_nothing_to_the_code(folder, effect, status):
    unbound = status == 5
    text = (folder / "one_mass.yaml").read_text()
    (folder / "one_mass.yaml").write_text(text.replace("effects: []", f"effects: [{effect}]", 1))
    done = stiction("generate", "one_mass.yaml")
    assert done.code == 0, done.err
    told = [line for line in done.out.splitlines() if "status 5" in line]
    assert len(told) == unbound
    verified = stiction("verify", "generated/one_mass/certificate.json")
    assert verified.code == status
    reason = json.loads(stiction("certify", "one_mass.yaml", "--json").out)["not_by_kernel"]
    assert all(reason in line for line in told) and bool(reason) == unbound


def test_verify_with_the_files_beside(generated, folder):
    certificate = generated / "certificate.json"
    passed = stiction("verify", certificate, "--spec", "one_mass.yaml", "--details")
    assert passed.code == 0 and "one_mass.c has the SHA-256 stated" in passed.out
    (generated / "one_mass.c").write_text((generated / "one_mass.c").read_text().replace("fabs", "tanh"))
    refused = stiction("verify", certificate)
    assert refused.code == 3 and "one_mass.c" in refused.out


def test_verify_against_another_spec(generated):
    assert stiction("verify", generated / "certificate.json", "--spec", SPECS / "two_mass.yaml").code == 3


def test_checker_alone(generated, tmp_path):
    script = shutil.copytree(Path(checker.__file__).parent, tmp_path / "alone") / "verify.py"
    command = [sys.executable, "-I", "-S", str(script), str(generated / "certificate.json")]
    done = subprocess.run(command, cwd="/", capture_output=True, text=True, check=False)
    assert done.returncode == 0 and done.stderr == "" and "verified for the C (exit status 0)\n" in done.stdout


def test_the_folder_of_another_machine_is_refused(generated, folder):
    before = contents(generated)
    shutil.copy(SPECS / "two_mass.yaml", folder / "two_mass.yaml")
    result = stiction("generate", "two_mass.yaml", "-o", str(generated))
    assert result.code == 2
    assert (
        is_one_message(result) and "[FILE004]" in result.err and "one_mass" in result.err and "two_mass" in result.err
    )
    assert contents(generated) == before


def test_lanes_are_no_other_machine(folder):
    """The header of the lanes in the manifest once was taken for another machine's."""
    for _ in range(2):
        assert stiction("generate", "one_mass.yaml", "-o", "made", "--target", "all").code == 0


@pytest.mark.parametrize("manifest", [None, "{}", '{"tool": {"name": "other"}, "files": {"README.md": ""}}', "\xff"])
def test_files_of_another_hand_are_kept(folder, manifest):
    target = folder / "project"
    target.mkdir()
    for name in ("README.md", "CMakeLists.txt", "notes.txt"):
        (target / name).write_text("mine")
    if manifest is not None:
        (target / "manifest.json").write_text(manifest, encoding="latin-1")
    before = contents(folder)
    result = stiction("generate", "one_mass.yaml", "-o", "project")
    assert result.code == 2 and len(result.err.splitlines()) == 1
    assert "README.md" in result.err and "CMakeLists.txt" in result.err and "notes.txt" not in result.err
    assert contents(folder) == before


def test_a_file_that_our_manifest_does_not_list_is_kept(folder):
    assert stiction("generate", "one_mass.yaml", "-o", "here", "--target", "c").code == 0
    (folder / "here" / "__init__.py").write_text("mine")
    result = stiction("generate", "one_mass.yaml", "-o", "here")
    assert result.code == 2 and all(word in result.err for word in ("[FILE004]", "__init__.py", "manifest.json"))
    (folder / "here" / "__init__.py").unlink()
    assert stiction("generate", "one_mass.yaml", "-o", "here").code == 0
    assert stiction("generate", "one_mass.yaml", "-o", "here", "--target", "c").code == 0


def test_an_edited_file_is_replaced_by_force_alone(generated, folder):
    source = generated / "one_mass.c"
    source.write_text(source.read_text().replace("/*", "/* mine", 1))
    (folder / "one_mass.yaml").write_text((folder / "one_mass.yaml").read_text().replace("v: [-5, 5]", "v: [-4, 4]"))
    before = contents(folder)
    result = stiction("generate", "one_mass.yaml")
    assert result.code == 2 and is_one_message(result) and contents(folder) == before
    assert (
        all(word in result.err for word in ("[FILE008]", "one_mass.c, edited", "--force"))
        and "one_mass.h" not in result.err
    )
    assert stiction("generate", "one_mass.yaml", "--force").code == 0
    assert "/* mine" not in source.read_text()
    assert stiction("generate", "one_mass.yaml").code == 0


def test_without_a_manifest_force_replaces_what_says_that_stiction_made_it(generated):
    """As where manifest.json is not under version control, or has the marks of a merge. Force once did not help."""
    before = contents(generated)
    for path in generated.iterdir():
        path.write_text(path.read_text() + "\n")
    (generated / "manifest.json").write_text("<<<<<<<\n" + before["manifest.json"].decode())
    (generated / "sliding.json").write_text((generated / "limit.json").read_text())
    edited = contents(generated)
    result = stiction("generate", "one_mass.yaml")
    assert result.code == 2 and is_one_message(result) and contents(generated) == edited
    assert "[FILE004]" in result.err and "--force, which replaces" in result.err
    assert not [name for name in before if name not in result.err], result.err
    assert stiction("generate", "one_mass.yaml", "--force").code == 0 and contents(generated) == before
    assert stiction("generate", "one_mass.yaml").code == 0


@pytest.mark.parametrize("file", ["one_mass.c", "README.md", "proof.json"])
def test_force_replaces_no_file_of_another_hand(file, generated):
    (generated / "manifest.json").unlink()
    (generated / file).write_text("mine")
    for force in ((), ("--force",)):
        result = stiction("generate", "one_mass.yaml", *force)
        assert result.code == 2 and "[FILE004]" in result.err and "move others away, or choose another -o" in result.err
        assert file in result.err and "--force" not in result.err
    assert (generated / file).read_text() == "mine"


def test_a_json_of_another_hand_is_not_removed(generated):
    """Of the names that a run without such a claim removes."""
    mine = generated / "sliding.json"
    mine.write_text('{"name": "one_mass", "bound": 3}\n')
    assert stiction("generate", "one_mass.yaml").code == 0 and mine.is_file()


def test_an_edited_proof_that_would_be_removed_is_kept(generated, folder):
    claim = generated / "ellipsoid.json"
    claim.write_text(claim.read_text() + "\n")
    text = (folder / "one_mass.yaml").read_text()
    (folder / "one_mass.yaml").write_text("".join(x for x in text.splitlines(True) if "v_dot" not in x))
    before = contents(folder)
    result = stiction("generate", "one_mass.yaml")
    assert result.code == 2 and "[FILE008]" in result.err and "ellipsoid.json" in result.err
    assert contents(folder) == before
    assert stiction("generate", "one_mass.yaml", "--force").code == 0 and not claim.exists()


def test_an_edit_that_would_be_written_anyway_is_no_edit(generated, folder):
    """As where a run was killed before it wrote the manifest of the new files."""
    manifest = (generated / "manifest.json").read_text()
    text = (folder / "one_mass.yaml").read_text()
    (folder / "one_mass.yaml").write_text(text.replace("v: [-5, 5]", "v: [-4, 4]"))
    assert stiction("generate", "one_mass.yaml").code == 0
    (generated / "manifest.json").write_text(manifest)
    assert stiction("generate", "one_mass.yaml").code == 0


def test_files_of_an_older_version_and_other_line_ends_are_no_edits(generated, folder):
    """What identifies a file of ours is its hash in the manifest beside it, whatever we write now."""
    manifest = json.loads((generated / "manifest.json").read_text())
    del manifest["sha256"]  # of an older version has none
    old = "/* as version 0.0.1 wrote it */\n"
    (generated / "one_mass.c").write_text(old)
    manifest["files"]["one_mass.c"] = hashlib.sha256(old.encode()).hexdigest()
    (generated / "manifest.json").write_text(json.dumps(manifest))
    for name in ("one_mass.h", "README.md"):
        (generated / name).write_bytes((generated / name).read_bytes().replace(b"\n", b"\r\n"))
    assert stiction("generate", "one_mass.yaml").code == 0
    assert b"\r" not in (generated / "one_mass.h").read_bytes()


def test_an_edited_manifest_is_replaced_by_force_alone(generated, folder):
    """With the hash of an edited file written into it, that edit once was replaced without a word."""
    source, manifest = generated / "one_mass.c", generated / "manifest.json"
    source.write_text(source.read_text().replace("/*", "/* mine", 1))
    content = json.loads(manifest.read_text())
    content["files"]["one_mass.c"] = hashlib.sha256(source.read_bytes()).hexdigest()
    manifest.write_text(json.dumps(content, indent=2) + "\n")
    before = contents(folder)
    result = stiction("generate", "one_mass.yaml")
    assert result.code == 2 and is_one_message(result) and contents(folder) == before
    assert all(word in result.err for word in ("[FILE008]", "manifest.json, edited", "--force"))
    assert stiction("generate", "one_mass.yaml", "--force").code == 0
    assert "/* mine" not in source.read_text()
    text = manifest.read_text()
    for same in (text.replace("\n", "\r\n"), json.dumps(json.loads(text))):  # line ends and layout are no edits
        manifest.write_text(same)
        assert stiction("generate", "one_mass.yaml").code == 0 and manifest.read_text() == text


def test_an_fmu_is_not_built_beside_edited_code(generated, folder):
    """It holds the code as generated: the edits were once left out of it without a word."""
    assert stiction("generate", "one_mass.yaml", "--target", "fmu").code == 0
    source = generated / "one_mass.c"
    source.write_text(source.read_text().replace("/*", "/* mine", 1))
    before = contents(folder)
    result = stiction("generate", "one_mass.yaml", "--target", "fmu")
    assert result.code == 2 and is_one_message(result) and contents(folder) == before
    assert all(word in result.err for word in ("[FILE008]", "one_mass.c, edited", "--force, which builds the FMU"))
    assert stiction("generate", "one_mass.yaml", "--target", "fmu", "--force").code == 0
    assert contents(folder) == before


@pytest.mark.parametrize("other", [b"mine", b"PK\x05\x06" + 18 * b"\0"])
def test_an_fmu_of_another_hand_is_kept(folder, other):
    (folder / "one_mass.fmu").write_bytes(other)
    result = stiction("generate", "one_mass.yaml", "--target", "fmu", "-o", ".", "--force")
    assert result.code == 2 and is_one_message(result) and "[FILE004]" in result.err
    assert (folder / "one_mass.fmu").read_bytes() == other


def test_diagnose_refuses_an_edited_file_before_any_work(generated, folder):
    source = generated / "one_mass.c"
    source.write_text(source.read_text() + "/* mine */")
    result = stiction("diagnose", "one_mass.yaml", "log.csv", "-o", ".")
    assert is_one_message(result) and "[FILE008]" in result.err and "--force" in result.err
