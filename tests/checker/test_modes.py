"""How the C enters, counts and leaves its modes: what is shipped is as it must be, and forgeries of it are refused."""

from __future__ import annotations

import errno
import hashlib
import itertools
import json
import os
import shutil
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from codegen.checker import frame, verify
from codegen.checker.verify import Refused
from tests.twin import load_twin

from .forged import certificate, changed, check

GENERATED = Path(__file__).parents[2] / "generated"
SHIPPED = sorted(path.parent.name for path in GENERATED.glob("*/manifest.json"))
RESUMED = "    state->mode = ONE_MASS_RUNNING;\n    state->invalid_samples = 0u;\n}\n\n/* Handle"
FULL = "if (state->invalid_samples >= 8u) {"
STARTED = "        state->mode = ONE_MASS_STARTING;\n"
ZERO = "    state->z_v = -(parameters->K_v * inputs->x);\n"
PREDICTED = "    state->z_v = state->z_v - parameters->sample_time * parameters->K_v * outputs->v_hat;\n"
CHECK = "const double check = z_v_next + z_rail_next;"
BEGUN = "const double check = fabs(inputs->x) + fabs(inputs->w) + fabs(state->z_v) + fabs(state->z_rail);"
GIVEN = "given = fabs(inputs->x) + fabs(inputs->w);"
LAST = "    outputs->fault = 1;\n"
# File, what stands there, what a forger writes.
FORGED = {
    "modes redefined": ("h", "    ONE_MASS_HOLDING,", "    ONE_MASS_HOLDING = 0,"),
    "modes in another order": ("h", "    ONE_MASS_RUNNING,", "    ONE_MASS_IDLE, ONE_MASS_RUNNING,"),
    "a macro for a mode": ("c", "#include <math.h>\n", "#include <math.h>\n#define ONE_MASS_HOLDING 0\n"),
    "a local for a mode": (
        "c",
        "    const double given =",
        "    const int ONE_MASS_HOLDING = 7;\n    const double given =",
    ),
    "a mode that is a double": ("h", "one_mass_mode mode;", "double mode;"),
    "a count that is negative from 128 on": ("h", "unsigned char invalid", "signed char invalid"),
    "a count without end": ("c", FULL, "if (state->invalid_samples > 255u) {"),
    "a count to what it never is": ("c", FULL, "if (state->invalid_samples >= 800u) {"),
    "a count that overflows": ("c", "state->invalid_samples++;", "state->invalid_samples += 100;"),
    "a count in every mode": ("c", "    if (state->mode == ONE_MASS_RUNNING) {\n        if", "    {\n        if"),
    "a count that goes on after valid samples": ("c", "outputs->fault == 0)", "outputs->fault == 2)"),
    "holding for ever": ("c", RESUMED, RESUMED.replace("    state->mode = ONE_MASS_RUNNING;\n", "")),
    "counting on": ("c", RESUMED, RESUMED.replace("    state->invalid_samples = 0u;\n", "")),
    "starting for ever": ("c", STARTED + "    }\n", "    }\n" + STARTED),
    "a return before the mode is set": ("c", RESUMED, f"    return;\n{RESUMED}"),
    "a branch before the mode is set": ("c", RESUMED, f"    if (state->z_v > 0.0)\n{RESUMED}"),
    "a mode that is not listed": ("c", STARTED, STARTED.replace("ONE_MASS_STARTING", "7")),
    "a mode that is not listed, besides": ("c", LAST, f"    state->mode = 7;\n{LAST}"),
    "a mode that is not listed, through a cast": (
        "c",
        "    const double given =",
        "    *(int *)((char *)state + 16) = 7;\n    const double given =",
    ),
    "a mode that is not listed, through another function": (
        "c",
        "void one_mass_init(",
        "static void one_mass_idle(one_mass_state *state) { state->mode = 7; }\nvoid one_mass_init(",
    ),
    "only some modes are left": (
        "c",
        "} else {\n        /* first",
        "} else if (state->mode == ONE_MASS_STARTING) {\n        /*",
    ),
    "invalid samples leave the start": ("c", "state->mode != ONE_MASS_STARTING", "state->mode != ONE_MASS_HOLDING"),
    "resumed in each mode": (
        "c",
        "else if (state->mode == ONE_MASS_HOLDING)",
        "else if (state->mode != ONE_MASS_HOLDING)",
    ),
    "no sample is valid": ("c", "given = fabs(inputs->x)", "given = 1e200 + fabs(inputs->x)"),
    "each sample is valid": ("c", "if (!(fabs(given) <= 1e+150))", "if (!(fabs(given) <= 1e+999))"),
    "no start is valid": ("c", "const double check = fabs(inputs->x)", "const double check = 1e200 + fabs(inputs->x)"),
    "a parameter that init changes": ("c", ZERO, f"    ((double *)parameters)[6] = -0.001;\n{ZERO}"),
    "a parameter that init changes, through a local": (
        "c",
        ZERO,
        f"    double *p = parameters;\n    p[6] = -0.001;\n{ZERO}",
    ),
    "held estimates that are overwritten": ("c", PREDICTED, f"    ((double *)outputs)[1] = 1e9;\n{PREDICTED}"),
    "a loop without end": ("c", PREDICTED, f"    for (;;) ;\n{PREDICTED}"),
    "a trap": ("c", PREDICTED, f"    __builtin_trap();\n{PREDICTED}"),
    "a check of nothing": ("c", CHECK, "const double check = 0.0;"),
    "a check without a state": ("c", CHECK, "const double check = z_rail_next - z_rail_next + inputs->w;"),
    "a check of one state twice": ("c", CHECK, "const double check = z_rail_next + z_rail_next;"),
    "no sample is invalid": ("c", GIVEN, "given = 0.0;"),
    "a large input that its magnitude hides": ("c", GIVEN, "given = inputs->x + fabs(inputs->x) + fabs(inputs->w);"),
    "one magnitude": ("c", GIVEN, "given = fabs(inputs->x) + inputs->w;"),
    "a magnitude of both": ("c", GIVEN, "given = fabs(inputs->x + inputs->w);"),
    "a start that is never invalid": ("c", BEGUN, "const double check = 0.0;"),
    "a start with one invalid input": ("c", BEGUN, BEGUN.replace("fabs(inputs->x) + ", "")),
    "an array that a start overruns": (
        "c",
        "    if (!(fabs(check) <= 1e+150)) {\n",
        "    if (!(fabs(check) <= 1e+150)) {\n        double t[1];\n"
        "        for (int i = 0; i < 20; i++) {\n            t[i] = 0.0;\n        }\n",
    ),
    "fault 0 though the estimates are held": ("c", LAST, "    outputs->fault = 0;\n"),
}


def texts(name: str) -> dict[str, str]:
    return {f"{name}.{end}": (GENERATED / name / f"{name}.{end}").read_text("utf-8") for end in "ch"}


@pytest.mark.parametrize("name", SHIPPED)
def test_what_is_shipped_is_accepted(name: str) -> None:
    frame.detects(frame.read(name, texts(name)))


@pytest.mark.parametrize("case", FORGED)
def test_forged_modes_are_refused(case: str) -> None:
    end, old, new = FORGED[case]
    files = texts("one_mass")
    assert old in files[f"one_mass.{end}"]
    files[f"one_mass.{end}"] = files[f"one_mass.{end}"].replace(old, new, 1)
    sources = {name: text.encode() for name, text in files.items()}
    proof = verify.theorem.read((GENERATED / "one_mass" / "proof.json").read_text("utf-8"))
    with pytest.raises(Refused, match="the kernel does not prove"):
        verify.theorem.proved(proof, sources)


@pytest.mark.parametrize("of", ["sign", "exp"])
@pytest.mark.parametrize("added", [" + inputs->u", ""])
def test_an_input_whose_infinity_no_next_state_shows_is_in_the_check(of: str, added: str) -> None:
    """sign(NaN) is 0 in the C, exp(-inf) too: an input in these alone was invalid in samples with fault 0."""
    code, model = {
        "sign": ("one_mass_sign(inputs->u)", "sgn(inputs.u)"),
        "exp": ("exp(-inputs->u * inputs->u)", "exp(-inputs.u*inputs.u)"),
    }[of]
    _, files = changed(
        "one_mass",
        ("inputs->w - F_hat_rail", f"inputs->w * {code} - F_hat_rail"),
        ("fabs(inputs->x) + fabs(inputs->w)", "fabs(inputs->x) + fabs(inputs->w) + fabs(inputs->u)"),
        (CHECK, CHECK.replace(";", f"{added};")),
    )
    field = b"double w; /* N: input */"
    files["one_mass.h"] = files["one_mass.h"].replace(field, field + b" double u; /* 1: input */")
    proof = certificate("one_mass", "proof.json")
    force = proof["force"][0].replace("inputs.w", f"inputs.w*{model}")
    proof |= {"force": [force], "acceleration": {"true.v": f"({force})/parameters.m"}}
    if added:
        assert check(proof, files).whole
    else:
        with pytest.raises(Refused, match="does not see all inputs"):
            check(proof, files)


@pytest.mark.parametrize(
    "hidden",
    ["double seen = inputs->u;\n    seen = 0.0;", "double both[2];\n    both[0] = inputs->u;\n    both[1] = 0.0;"],
    ids=["set again", "another element"],
)
def test_an_input_that_is_in_the_check_by_name_alone_is_not_seen(hidden: str) -> None:
    """A local that held the input once, or has it in another element, passes on no NaN of it."""
    local = "seen" if "seen" in hidden else "both[1]"
    _, files = changed(
        "one_mass",
        ("inputs->w - F_hat_rail", "inputs->w * one_mass_sign(inputs->u) - F_hat_rail"),
        ("fabs(inputs->x) + fabs(inputs->w)", "fabs(inputs->x) + fabs(inputs->w) + fabs(inputs->u)"),
        (CHECK, f"{hidden}\n    {CHECK.replace(';', f' + {local};')}"),
    )
    field = b"double w; /* N: input */"
    files["one_mass.h"] = files["one_mass.h"].replace(field, field + b" double u; /* 1: input */")
    proof = certificate("one_mass", "proof.json")
    force = proof["force"][0].replace("inputs.w", "inputs.w*sgn(inputs.u)")
    proof |= {"force": [force], "acceleration": {"true.v": f"({force})/parameters.m"}}
    with pytest.raises(Refused, match="does not see all inputs"):
        check(proof, files)


def test_the_genuine_files_are_proved() -> None:
    """So that what is refused above is refused for its change."""
    proof = verify.theorem.read((GENERATED / "one_mass" / "proof.json").read_text("utf-8"))
    assert verify.theorem.proved(proof, {n: t.encode() for n, t in texts("one_mass").items()})["whole"]


def follow(twin: ModuleType, mode: int, valid: tuple[bool, ...]) -> list[int]:
    """The modes of one_mass over samples that are valid or not, from any value of its mode."""
    state, outputs = twin.State(z_v=0.5, z_rail=40.0, mode=mode), twin.Outputs()
    found = []
    for good in valid:
        twin.step(state, twin.Parameters(), twin.Inputs(0.0 if good else float("nan"), 0.0), outputs)
        assert state.invalid_samples <= 8
        found.append(state.mode)
    return found


def test_the_modes_of_the_twin_are_those_of_the_table() -> None:
    """Over all runs of up to twelve samples: a count by hand, in place of the twin's."""
    twin = load_twin((GENERATED / "one_mass" / "__init__.py").read_text("utf-8"), "one_mass")
    for mode in (twin.RUNNING, twin.HOLDING, twin.STARTING, 7):
        for valid in itertools.product((True, False), repeat=12):
            row, now, expected = 0, mode, []
            for good in valid:
                row = 0 if good else row + 1
                if good:
                    now = twin.RUNNING
                elif now == twin.RUNNING and row == 8:
                    now = twin.HOLDING
                expected.append(now)
            assert follow(twin, mode, valid) == expected


@pytest.mark.parametrize(
    "index", ["2147483647 + 1 - 2147483648", "1 - 1 + 99999 - 99999", "70000 * 70000 - 4900000000"]
)
def test_an_index_that_an_int_cannot_hold_is_refused(index: str) -> None:
    """Python would read t[0]; in C the sum overflows."""
    files = texts("one_mass")
    old, new = (
        "    const double v_hat = state->z_v + parameters->K_v *",
        "state->z_v + t[INDEX] *".replace("INDEX", index),
    )
    assert old in files["one_mass.c"]
    begun = "    double t[2];\n    t[0] = parameters->K_v;\n    t[1] = 1.0;\n    const double v_hat = "
    files["one_mass.c"] = files["one_mass.c"].replace(old, begun + new, 1)
    proof = verify.theorem.read((GENERATED / "one_mass" / "proof.json").read_text("utf-8"))
    with pytest.raises(Refused, match="the kernel does not prove"):
        verify.theorem.proved(proof, {name: text.encode() for name, text in files.items()})


OTHERS = ["math.h", "Math.H", "features.h", "stdc-predef.h", "bits/math-vector.h", "one_mass.h.gch", "x/one_mass.h.gch"]
OTHERS += ["module.modulemap", "x/module.map", "cmath", "__config"]  # of Clang's modules, and headers of C++
OTHERS += ["tr1/gamma.tcc", "TR1/Gamma.TCC", "x.inl"]  # g++ from C++17 on: <cmath> has <bits/specfun.h>, and that this


@pytest.mark.parametrize("name", OTHERS)
def test_another_header_beside_the_code_is_refused(name: str, tmp_path: Path) -> None:
    """The generated README, CMake and make files give the folder to the compiler by -I."""
    for file, text in texts("one_mass").items():
        (tmp_path / file).write_text(text, encoding="utf-8")
    for file in ("proof.json", "certificate.json"):
        (tmp_path / file).write_bytes((GENERATED / "one_mass" / file).read_bytes())
        assert verify.main([str(tmp_path / file)]) == 0
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text("#define fabs(x) (-(x))\n", encoding="utf-8")
    for file in ("proof.json", "certificate.json"):
        assert verify.main([str(tmp_path / file)]) == 3


def test_what_is_no_header_may_lie_beside_the_code(tmp_path: Path) -> None:
    folder = shutil.copytree(GENERATED / "one_mass", tmp_path / "one_mass")
    (folder / "Makefile").write_text("all:\n", encoding="utf-8")
    (folder / "one_mass.map").write_text(".text\n", encoding="utf-8")
    (folder / "build").mkdir()
    (folder / "build" / "Makefile").write_text("all:\n", encoding="utf-8")
    (folder / "run").write_bytes(b"\x7fELF\x02\x01")
    assert verify.main([str(folder / "certificate.json")]) == 0


def test_the_lanes_of_a_code_may_lie_beside_it(tmp_path: Path) -> None:
    """`generate --target all` writes one_mass_lanes.h, and `verify` refused the folder for it."""
    folder = shutil.copytree(GENERATED / "one_mass", tmp_path / "one_mass")
    (folder / "one_mass_lanes.h").write_text("typedef double one_mass_lanes;\n", encoding="utf-8")
    for file in ("proof.json", "certificate.json"):
        assert verify.main([str(folder / file)]) == 0
    (folder / "below").mkdir()
    (folder / "one_mass_lanes.h").rename(folder / "below" / "one_mass_lanes.h")
    assert verify.main([str(folder / "certificate.json")]) == 3


def test_a_certificate_without_its_code_is_not_judged_by_other_folders(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A colleague's folder held the certificate, and below it the code of others: "refused", for their headers."""
    shutil.copytree(GENERATED / "two_mass", tmp_path / "two_mass")
    shutil.copy(GENERATED / "one_mass" / "certificate.json", tmp_path / "of_one_mass.json")
    assert verify.main([str(tmp_path / "of_one_mass.json")]) == verify.NO_CODE
    shutil.copy(GENERATED / "one_mass" / "one_mass.c", tmp_path)
    capsys.readouterr()
    assert verify.main([str(tmp_path / "of_one_mass.json")]) == 3
    found = capsys.readouterr().out
    assert f"beside the code: {Path('two_mass', 'two_mass.h')}; expected" in found and "move" in found


def test_a_link_to_a_folder_of_headers_is_refused(tmp_path: Path) -> None:
    """<math.h> includes <bits/mathcalls.h>: with -I FOLDER the one behind the link."""
    folder = shutil.copytree(GENERATED / "one_mass", tmp_path / "one_mass")
    assert verify.main([str(folder / "certificate.json")]) == 0
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "mathcalls.h").write_text("#define fabs(x) (-(x))\n", encoding="utf-8")
    (folder / "bits").symlink_to(tmp_path / "elsewhere")
    for file in ("proof.json", "certificate.json"):
        assert verify.main([str(folder / file)]) == 3


def test_a_header_that_the_certificate_names_itself_is_refused(tmp_path: Path) -> None:
    """Its hash says nothing of what it defines."""
    folder = shutil.copytree(GENERATED / "one_mass", tmp_path / "one_mass")
    other = b"#define fabs(x) (-(x))\n"
    (folder / "math.h").write_bytes(other)
    top = json.loads((folder / "certificate.json").read_text("utf-8"))
    top["subject"]["files"]["math.h"] = hashlib.sha256(other).hexdigest()
    (folder / "certificate.json").write_text(json.dumps(top), encoding="utf-8")
    assert verify.main([str(folder / "certificate.json")]) == 3


def test_the_code_s_own_name_is_that_of_a_system_s_header_too(tmp_path: Path) -> None:
    """With -I FOLDER, <math.h> reads bits/floatn.h; beside an observer called floatn nobody looked at it."""
    for file in ("one_mass.c", "one_mass.h", "proof.json"):
        text = (GENERATED / "one_mass" / file).read_text("utf-8")
        renamed = text.replace("one_mass", "floatn").replace("ONE_MASS", "FLOATN")
        (tmp_path / file.replace("one_mass", "floatn")).write_text(renamed, encoding="utf-8")
    assert verify.main([str(tmp_path / "proof.json")]) == 0
    (tmp_path / "bits").mkdir()
    (tmp_path / "bits" / "floatn.h").write_text("#include_next <bits/floatn.h>\n#define h_K_F K_v\n", encoding="utf-8")
    assert verify.main([str(tmp_path / "proof.json")]) == 3


def test_a_folder_that_cannot_be_listed_may_hold_headers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one of mode 311 a compiler finds bits/floatn.h, and no list shows it. Root may list any: simulated."""
    folder = shutil.copytree(GENERATED / "one_mass", tmp_path / "one_mass")
    (folder / "bits").mkdir()
    listed = os.scandir

    def scandir(path: Any = ".") -> Any:
        if Path(path).name == "bits":
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return listed(path)

    monkeypatch.setattr(os, "scandir", scandir)
    for file in ("proof.json", "certificate.json"):
        assert verify.main([str(folder / file)]) == 3
        assert "cannot be listed: Permission denied" in capsys.readouterr().out
