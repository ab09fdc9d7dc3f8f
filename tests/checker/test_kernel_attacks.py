"""C and proofs that were accepted under attack although what they say is false: each is refused."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from codegen.checker import ellipsoid, errors, frame, verify
from tests.checker.forged import POINT
from tests.slow_cases import slow_except

HERE = Path(__file__).parents[2] / "generated" / "one_mass"
RATE = "parameters->one_over_m * (inputs->w - F_hat_rail)"


def shipped() -> tuple[dict[str, Any], dict[str, str]]:
    proof = json.loads((HERE / "proof.json").read_text("utf-8"))
    return proof, {path.name: path.read_text("utf-8") for path in HERE.glob("one_mass.[ch]")}


def proved(proof: dict[str, Any], files: dict[str, str]) -> dict[str, Any]:
    found: dict[str, Any] = verify.by_kernel_alone(proof, {name: text.encode() for name, text in files.items()})
    return found


def with_rate(statements: str) -> dict[str, str]:
    """The C with other statements in place of that of v_dot_hat; E stands for the right rate."""
    _, files = shipped()
    old = f"const double v_dot_hat = {RATE};"
    assert files["one_mass.c"].count(old) == 1
    return files | {"one_mass.c": files["one_mass.c"].replace(old, statements.replace("E;", f"{RATE};"))}


def test_what_is_shipped_is_proved_and_a_loop_too() -> None:
    proof, files = shipped()
    assert errors.prove(proof, files)["whole"]
    looped = "double t[2]; for (int i = 0; i < 2; i++) { const double a = E; t[i] = a; } const double v_dot_hat = t[1];"
    assert errors.prove(proof, with_rate(looped))["whole"]


@pytest.mark.parametrize(
    "statements",
    [
        # C divides whole numbers otherwise: it reads t[2].
        "double t[4]; t[2] = 7.0 * E; t[3] = E; const double v_dot_hat = t[3/2*2];",
        # A local of a loop is gone behind it, whatever names stand outside.
        "const double t_0_ = 7.0 * E; for (int i = 0; i < 1; i++) { const double t = E; }"
        " const double v_dot_hat = t_0_;",
        # The second loop uses the outer t before it has its own.
        "const double t = 7.0 * E; double r[1]; for (int i = 0; i < 1; i++) { const double t = E; }"
        " for (int i = 0; i < 1; i++) { r[0] = t; const double t = 1.0 * E; } const double v_dot_hat = r[0];",
        # Doubles that are zero: 1e-400 by itself, and what strtod makes of a long row of zeros.
        "const double v_dot_hat = 1e-400 * 1e200 * 1e200 * E;",
        "const double v_dot_hat = 1e-308 * 1e-1 * 1e-99 * 1e99 * 1e309 * E;",
        f"const double v_dot_hat = E; const double t = 0.{'0' * 98}1e-300;",
        # Literals that doubles hold, products that they do not: zero, or infinite, and no number then.
        f"const double v_dot_hat = ({RATE}) * {' * '.join(['1e-99'] * 4)} * {' * '.join(['1e99'] * 4)};",
        f"const double v_dot_hat = ({RATE}) * {' * '.join(['1e99'] * 4)} * {' * '.join(['1e-99'] * 4)};",
        # Casts of a number look like calls; unsigned differences wrap round, here by 2147483648 m/s^2.
        "const double a = E; const double v_dot_hat = a + (0.5 * ((unsigned)(0.25) - (unsigned)(1.5))"
        " - 0.5 * (unsigned)(0.25) + 0.5 * (unsigned)(1.5));",
        # An int by a function of a double.
        "const double a = E; const double v_dot_hat = a + ilogb(0.0) - ilogb(0.0);",
        # Octal bounds: eight times, not ten; and an array of eight.
        f"double t[1]; t[0] = 0.0; for (int i = 0; i < 010; i++) {{ t[0] += 0.1 * ({RATE}); }}"
        " const double v_dot_hat = t[0];",
        "double t[010]; t[9] = E; const double v_dot_hat = t[9];",
        # An imaginary number, whose real part is zero, not 1.0 + 1.1.
        f"double t[1]; t[0] = 0.0; for (int i = 0; i < 2; i++) {{ t[0] += 1.i * ({RATE}); }}"
        " const double v_dot_hat = t[0] * (1.0 / 2.1);",
        # A macro, spelt with a digraph.
        "\n%:define fabs(u) (3.0 * (u))\nconst double v_dot_hat = E;",
    ],
)
def test_c_that_computes_something_else_is_refused(statements: str) -> None:
    proof, _ = shipped()
    with pytest.raises(ValueError, match=r"."):
        errors.prove(
            proof, with_rate(statements.replace("7.0 * E", f"7.0 * {RATE}").replace("1.0 * E", f"1.0 * {RATE}"))
        )


def test_macros_before_step_are_refused_in_any_spelling() -> None:
    proof, files = shipped()
    at = files["one_mass.c"].index("void one_mass_init(")
    at = files["one_mass.c"].index("{", at) + 1
    for line in (
        "%:define v_hat v_hat + 5.0",
        "%> double fabs(double u) <% return 3.0*u; %> static void rest(void) <%",
    ):
        other = files["one_mass.c"][:at] + f"\n{line}\n" + files["one_mass.c"][at:]
        with pytest.raises(ValueError, match="a comment from // on, % or not ASCII"):
            errors.prove(proof, files | {"one_mass.c": other})


def test_a_true_level_is_no_sign_and_an_error_has_just_its_fields() -> None:
    proof, files = shipped()
    level = next(e["truth"] for e in proof["errors"] if e["truth"].startswith("true.a_"))
    with pytest.raises(ValueError, match="not so named"):
        errors.prove(proof | {"signs": proof["signs"] | {level: "outputs.a_hat_rail"}}, files)
    noted = [proof["errors"][0] | {"note": "x"}, *proof["errors"][1:]]
    with pytest.raises(verify.Refused, match="fields"):
        proved(proof | {"errors": noted}, files)


@pytest.mark.parametrize("name", ["true.v", "sign.rail", "outputs.v_hat", "state.z_v", "inputs.x"])
def test_no_variable_has_the_name_of_the_t_of_an_angle(name: str) -> None:
    """It would count as at most 1 in the size of the sum `check`."""
    proof, files = shipped()
    text, (kind, field) = json.dumps(proof), name.split(".")
    assert name in text
    with pytest.raises((ValueError, SyntaxError), match=r"not so named|not an error|invalid syntax"):
        errors.prove(json.loads(text.replace(name, f"{name} t")), files)
    if kind not in ("true", "sign"):
        header = re.sub(rf"\bdouble {field};", f"double {field} t;", files["one_mass.h"])
        with pytest.raises(ValueError, match="no fields of doubles"):
            frame.read("one_mass", files | {"one_mass.h": header})


def test_a_set_that_does_not_shrink_bounds_nothing() -> None:
    """With f = 1 and no disturbance an error stays where it is, inside the set or out."""
    proof, files = shipped()
    claim = json.loads((HERE / "ellipsoid.json").read_text("utf-8"))
    still = claim | {kind: dict.fromkeys(claim[kind], "0") for kind in ("noise", "drift")}
    for ball in still["sets"]:
        ball["weights"][0] = "1"
    with pytest.raises(ValueError, match="weights"):
        ellipsoid.bounded(proof, still, errors.prove(proof, files))


@pytest.mark.parametrize("alike", slow_except([True, False], [True]))
def test_many_rows_of_many_samples_are_more_work_than_the_limit(alike: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frame, "SECONDS", 0.3)
    proof, files = shipped()
    claim = json.loads((HERE / "ellipsoid.json").read_text("utf-8"))
    claim["sets"][0]["samples"] = "10000"
    row = claim["sets"][0]["rows"][0]
    claim["sets"][0]["rows"] = (
        [row] * 200_000 if alike else [[str(k + 1), *row[1:]] for k in range(ellipsoid.MOST_ROWS - 10)]
    )
    with pytest.raises(ValueError, match="more work than the limit"):
        ellipsoid.bounded(proof, claim, errors.prove(proof, files))


def test_a_bound_beyond_floating_point_is_one_line(tmp_path: Path) -> None:
    claim = json.loads((HERE / "ellipsoid.json").read_text("utf-8"))
    claim["sets"][0]["rows"][0][-1] = "1e400"
    done = run_alone(folder_with(tmp_path, "ellipsoid.json", lambda path: path.write_text(json.dumps(claim))))
    assert done.returncode == 3 and done.stdout.startswith("refused: ") and "Traceback" not in done.stderr


def test_an_error_that_stands_twice_covers_no_second_state() -> None:
    """z_q doubles what it is off z_v in every sample, and both were said to show the velocity's error."""
    proof, files = shipped()
    header, source = (files[f"one_mass.{end}"] for end in "hc")
    header = header.replace("    double z_rail;", "    double z_q;\n    double z_rail;", 1)
    keep = "        state->z_v = z_v_next;\n"
    source = source.replace(keep, f"        state->z_q = z_v_next + 2.0 * (state->z_q - state->z_v);\n{keep}", 1)
    first, second = proof["errors"]
    (a, b), (c, d) = proof["matrix"]
    (p, q), (_, r) = proof["lyapunov_matrix"]
    twice = proof | {
        "errors": [first, first, second],
        "states": proof["states"] | {"state.z_q": proof["states"]["state.z_v"]},
        "matrix": [["0", a, b], ["0", a, b], ["0", c, d]],
        "lyapunov_matrix": [["1/1000", "0", "0"], ["0", p, q], ["0", q, r]],
        "decay_rate": "5",
        "reversals": [],
    }
    with pytest.raises(ValueError, match="not so named"):
        errors.prove(twice, {"one_mass.h": header, "one_mass.c": source})


@pytest.mark.parametrize(
    ("field", "value", "why"),
    [
        ("box", {"sign.rail": ["1", "1"]}, "a box of no free variable"),
        ("rest", ["true.v - outputs.v_hat", "0"], "outputs.v_hat is nothing that is known"),
        ("rest", ["state.z_v", "0"], "nothing that is known"),
        ("rest", [], "argument 2 is shorter"),
    ],
)
def test_a_box_of_a_sign_and_a_rest_that_follows_an_error_are_refused(field: str, value: Any, why: str) -> None:
    proof, files = shipped()
    with pytest.raises(ValueError, match=why):
        errors.prove(proof | {field: value}, files)


def test_a_disturbance_of_the_code_s_own_is_said_and_takes_the_status() -> None:
    """Gravity that the machine has not: a rest says it, and nothing is then proved without conditions, nor of noise."""
    proof, _ = shipped()
    heavy = proof | {"rest": ["9.81*parameters.sample_time/parameters.m", "0"]}
    files = shipped()[1]
    source = files["one_mass.c"].replace("inputs->w - F_hat_rail", "inputs->w - 9.81 - F_hat_rail", 1)
    files |= {"one_mass.c": source}
    assert not errors.prove(heavy, files)["whole"]
    claim = json.loads((HERE / "ellipsoid.json").read_text("utf-8"))
    with pytest.raises(ValueError, match="have a rest"):
        ellipsoid.bounded(heavy, claim, errors.prove(heavy, files))


@pytest.mark.parametrize(
    ("local", "rate"),
    [
        # In C this t is its own start, of no value; the kernel read that of prepare.
        ("t", f"const double t = (t - 1.0) + {RATE}; const double v_dot_hat = t;"),
        # A global of math.h, 0, behind a local of prepare.
        ("signgam", f"const double v_dot_hat = signgam * ({RATE});"),
    ],
)
def test_a_local_of_prepare_is_not_there_in_step(local: str, rate: str) -> None:
    proof, _ = shipped()
    files, first = with_rate(rate), "parameters->one_over_m = 1.0 / parameters->m;"
    assert files["one_mass.c"].count(first) == 1
    source = files["one_mass.c"].replace(first, f"{first}\n    const double {local} = 1.0;")
    with pytest.raises(ValueError, match=f"{local} is nothing that is known"):
        errors.prove(proof, files | {"one_mass.c": source})


@pytest.mark.parametrize("macro", ["STICTION_ONE_MASS_H", "__REGISTER_PREFIX__"])
def test_a_parameter_that_a_macro_makes_nothing_is_refused(macro: str) -> None:
    """C has no such field, and each value moves to the next: the mass was 0.001 kg, and printed as 1 kg."""
    proof, files = shipped()
    header = files["one_mass.h"].replace(
        "typedef struct {\n    double", f"typedef struct {{\n    double {macro};\n    double", 1
    )
    header = header.replace("    { \\\n", "    { \\\n        0.001, \\\n", 1)
    assert header.count("0.001") == files["one_mass.h"].count("0.001") + 1
    with pytest.raises(ValueError, match="no fields of doubles"):
        errors.prove(proof, files | {"one_mass.h": header})


@pytest.mark.parametrize("size", ["18446744073709551617", "{ 18446744073709551617 }"])
def test_a_whole_number_that_c_cuts_is_no_value(size: str) -> None:
    """gcc makes 1 of 2^64 + 1, and warns."""
    proof, files = shipped()
    header = files["one_mass.h"].replace("        50.0, /* rail_a */", f"        {size}, /* rail_a */")
    assert header != files["one_mass.h"]
    if size.startswith("{"):
        header = header.replace("double rail_a;", "double rail_a[1];")
        files["one_mass.c"] = files["one_mass.c"].replace("parameters->rail_a", "parameters->rail_a[0]")
    with pytest.raises(ValueError, match="not as their fields"):
        errors.prove(proof, files | {"one_mass.h": header})


WRONG_WAY = {
    # |sign.q| is 1; read as -1, it makes right friction of wrong.
    "a sign of itself turned round": ({"sign.q": "-sign.q"}, "fabs(sign.q)"),
    "signs of each other": ({"sign.q": "-sign.r", "sign.r": "sign.q"}, "fabs(sign.q)*fabs(sign.r)"),
    "a sign of a product with itself": ({"sign.q": "-sign.q*inputs.x*inputs.x"}, "fabs(sign.q*inputs.x*inputs.x)"),
    "a sign of zero": ({"sign.q": "inputs.x - inputs.x"}, "1"),
    "a sign of zero by a parameter": ({"sign.q": "(parameters.m - 1)*inputs.x"}, "1"),
    "a sign of what is never below zero": ({"sign.q": "fabs(fabs(inputs.x)) - fabs(inputs.x)"}, "1"),
}


@pytest.mark.parametrize("kind", WRONG_WAY)
def test_a_sign_that_none_is_proves_nothing(kind: str) -> None:
    """Of no machine are these the signs, so anything follows: friction that pushes was proved to brake."""
    proof, files = shipped()
    signs, one = WRONG_WAY[kind]
    if one != "1":
        files["one_mass.c"] = files["one_mass.c"].replace("inputs->w - F_hat_rail", "inputs->w + F_hat_rail")
        level = "-true.a_rail*sign.rail"
        for place, keys in (("force", [0]), ("acceleration", ["true.v"])):
            for key in keys:
                proof[place][key] = proof[place][key].replace(level, f"{level}*{one}")
    with pytest.raises(ValueError, match=r"no sign of a slip|nothing that is known"):
        errors.prove(proof | {"signs": proof["signs"] | signs}, files)


def test_a_range_takes_the_status() -> None:
    """V falls where each variable of the box is in its range, and nothing is said of elsewhere: a condition."""
    proof, files = shipped()
    assert errors.prove(proof, files)["whole"]
    assert not errors.prove(proof | {"box": {"true.v": ["0", "1"]}}, files)["whole"]


REMARK = "|e| falls tenfold a sample"


@pytest.mark.parametrize(
    "change",
    [
        lambda p: p["reversals"][0].update({"claim": REMARK}),
        lambda p: p.update({"force": {p["force"][0]: REMARK}}),
        lambda p: p.update({"matrix": [dict.fromkeys(p["matrix"][0], "0"), p["matrix"][1]]}),
        lambda p: p.update({"rest": {"0": REMARK, "0*1": REMARK}}),
        lambda p: p.update({"box": {"true.v": {"0": REMARK, "1": REMARK}}}),
        lambda p: p.update({"domain": {"inputs.w": REMARK}}),
    ],
)
def test_a_remark_is_not_read_as_proved(change: Any) -> None:
    """What was read of an object in place of a list were its keys."""
    proof, files = shipped()
    change(proof)
    with pytest.raises(verify.Refused, match=r"fields are not so named|expected is a list"):
        proved(proof, files)


@pytest.mark.parametrize("name", ["sign.q", "true.q,\u2028and of every machine"])
def test_a_truth_of_any_name_is_refused(name: str) -> None:
    """A free level that is printed as sign(q)."""
    text = json.dumps(shipped()[0]).replace("true.a_rail", name)
    with pytest.raises(ValueError, match=r"not so named|is no expression"):
        errors.prove(json.loads(text), shipped()[1])


TWICE = (
    ('"decay_rate": "213/20"', '"decay_rate": "100", "decay_rate": "213/20"'),
    ('"sign.rail": "outputs.v_hat"', '"sign.rail": "inputs.w", "sign.rail": "outputs.v_hat"'),
    ('"growth": "3190351/1000000"', '"growth": "1", "growth": "3190351/1000000"'),
)


@pytest.mark.parametrize(("old", "new"), TWICE)
def test_a_field_that_stands_twice_is_refused(old: str, new: str, tmp_path: Path) -> None:
    """Who reads the file sees the first; JSON takes the last."""
    text = (HERE / "proof.json").read_text("utf-8")
    assert old in text
    text = text.replace(old, new)
    folder = folder_with(tmp_path, "proof.json", lambda path: path.write_text(text))
    done = run_alone(folder)
    assert done.returncode == 3 and "a key appears twice" in done.stdout
    sources = {path.name: path.read_bytes() for path in HERE.glob("one_mass.[ch]")}
    with pytest.raises(verify.Refused, match="twice"):
        verify.check(text, None, None, sources)
    certificate = (HERE / "certificate.json").read_text("utf-8")
    everything = {path.name: path.read_bytes() for path in HERE.iterdir() if path.is_file()}
    report = verify.check(certificate, None, None, everything | {"proof.json": text.encode()})
    assert not report.proved and "twice" in report.unproved


def test_a_field_of_a_set_that_stands_twice_is_refused() -> None:
    claim = (HERE / "ellipsoid.json").read_text("utf-8")
    assert '"1/200000"' in claim
    claim = claim.replace('"inputs.x": "1/200000"', '"inputs.x": "1", "inputs.x": "1/200000"')
    everything = {path.name: path.read_bytes() for path in HERE.iterdir() if path.is_file()} | {
        "ellipsoid.json": claim.encode()
    }
    with pytest.raises(verify.Refused, match="twice"):
        verify.check((HERE / "proof.json").read_text("utf-8"), None, None, everything)


def run_alone(folder: Path) -> Any:
    """verify.py on the folder's proof.json."""
    command = [sys.executable, "-I", verify.__file__, folder / "proof.json"]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=20)


def folder_with(tmp_path: Path, file: str, made: Any) -> Path:
    """The shipped files, one of them replaced."""
    for path in HERE.glob("*"):
        if path.is_file() and path.name != file:
            (tmp_path / path.name).write_bytes(path.read_bytes())
    made(tmp_path / file)
    return tmp_path


def sparse(path: Path) -> None:
    """A file of 10 GB that takes no room."""
    with path.open("wb") as file:
        file.truncate(10**10)


MADE = {
    "a pipe": os.mkfifo,
    "a folder": Path.mkdir,
    "ten gigabytes": sparse,
    "the zero device": lambda p: p.symlink_to("/dev/zero"),
}


@pytest.mark.parametrize("kind", MADE)
@pytest.mark.parametrize("file", slow_except(["one_mass.c", "one_mass.h", "other.c"], ["one_mass.h", "other.c"]))
def test_only_the_files_of_the_proof_are_read_and_only_regular_ones(kind: str, file: str, tmp_path: Path) -> None:
    folder = folder_with(tmp_path, file, MADE[kind])
    done = run_alone(folder)
    if file == "other.c":
        assert done.returncode == 0, done.stderr
    else:
        assert done.returncode == 2 and done.stdout == ""
        assert done.stderr.startswith("error: ") and done.stderr.count("\n") == 1 and file[:-1] in done.stderr


def test_an_empty_proof_s_folder_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "proof.json").write_bytes((HERE / "proof.json").read_bytes())
    done = run_alone(tmp_path)
    assert done.returncode == 3 and "one_mass.c" in done.stdout and done.stdout.count("\n") == 1


def test_carriage_returns_are_refused_alone_too(tmp_path: Path) -> None:
    """C takes one as a blank, Python's reader of text for the end of a line: a macro's line would go on."""
    source = (HERE / "one_mass.c").read_bytes().replace(b"#endif\n\nvoid", b"#endif\r\nvoid").replace(b"\n\n", b"\n\r")
    folder = folder_with(tmp_path, "one_mass.c", lambda path: path.write_bytes(source))
    done = run_alone(folder)
    assert done.returncode == 3 and "control characters" in done.stdout


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("box", {"true.v": ["0", "4"]}, "ranges"),
        ("box", {"inputs.w": ["-5", "5"]}, "ranges"),
    ],
)
def test_a_proof_over_less_than_the_certificate_says_is_none_of_it(field: str, value: Any, words: str) -> None:
    proof = shipped()[0] | {field: value, "witness": POINT}
    everything = {path.name: path.read_bytes() for path in HERE.iterdir() if path.is_file()}
    report = verify.check(
        (HERE / "certificate.json").read_text("utf-8"),
        None,
        None,
        everything | {"proof.json": json.dumps(proof).encode()},
    )
    assert (
        not report.proved and not report.whole and "is not its proof: " in report.unproved and words in report.unproved
    )


def test_a_box_is_printed_as_a_condition_and_not_as_every_state() -> None:
    proof, files = shipped()
    bounded = json.dumps(proof | {"box": {"true.v": ["0", "4"]}, "witness": POINT})
    report = verify.check(bounded, None, None, {k: v.encode() for k, v in files.items()})
    assert "only where v is in [0, 4]" in report.proved and not report.whole
