"""Forgeries over genuine generated files: each was accepted once, and is refused or has an exit status of its own."""

from __future__ import annotations

import ast
import hashlib
import io
import json
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from codegen.checker import binding, files, newtons, subset, verify
from codegen.checker.verify import Refused

from .test_binding import GENERATED, REPLAYED, certificate, check, forged, sources

TWIN = "__init__.py"
LAW = "v_dot_hat = parameters.one_over_m * (inputs.w - F_hat_rail)"
NEXT = "    state.z_v = z_v_next\n"


def changed(name: str, *pairs: tuple[str, str]) -> tuple[Any, dict[str, bytes]]:
    """A genuine certificate over a twin of which these texts are others, with that twin's hash."""
    files = sources(name)
    text = files[TWIN].decode()
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    return forged(certificate(name), files, text)


def other_law(limit: str) -> tuple[tuple[str, str], ...]:
    """Below this velocity the step turns it round and makes it larger, so that its signs never stay."""
    slow = f"    slow = 0.5 - 0.5 * _sign(abs(v_hat) - {limit})\n    check = "
    return ("    check = z_v_next", f"{slow}z_v_next"), (NEXT, "    state.z_v = z_v_next - slow * 1000.0 * v_hat\n")


# What is written into the twin of one_mass, in place of what.
UNREAD = {
    "a helper redefined": ("return 1.0 if u > 0.0", "return 7.0 if u > 300.0"),
    "a helper with a default": ("def _sign(u: float)", "def _sign(u: float, k: float = 2.0)"),
    "a step defined twice": (
        "def step(",
        "def step(state, parameters, inputs, outputs=None):\n    return 1\n\n\ndef step(",
    ),
    "step through globals": ("def prepare(", 'globals()["step"] = print\n\n\ndef prepare('),
    "globals in a function": (NEXT, NEXT + '    globals()["step"] = abs\n'),
    "setattr in a step": (NEXT, NEXT + '    setattr(parameters, "K_F", 0.0)\n'),
    "an import": ("import math\n", "import math\nimport os\n"),
    "a name from elsewhere": ("import math\n", "import math\nfrom os import abort as abs\n"),
    "a decorator": ("def step(", "@print\ndef step("),
    "a class decorator": ("@dataclass(slots=True)\nclass State", "@print\n@dataclass(slots=True)\nclass State"),
    "a base class": ("class State:", "class State(dict):"),
    "a method": ("class State:", "class State:\n    def __getattr__(self, name):\n        return 0.0\n"),
    "abs redefined": ("def prepare(", "def abs(u: float) -> float:\n    return 0.0\n\n\ndef prepare("),
    "abs as a local": (NEXT, NEXT + "    abs = _sign\n"),
    "a branch": (NEXT, "    if v_hat < 5.0:\n        z_v_next = 0.0\n" + NEXT),
    "a comparison": (LAW, LAW + " * (1.0 if v_hat < 5.0 else 2.0)"),
    "a comparison as a number": (LAW, LAW + " * (1.0 + (v_hat < 5.0))"),
    "a lambda": (LAW, LAW + " + (lambda u: u)(0.0)"),
    "a comprehension": (LAW, LAW + " + sum([u for u in [0.0]])"),
    "a delete": (NEXT, NEXT + "    del inputs\n"),
    "a try": (NEXT, "    try:\n        pass\n    except ValueError:\n        pass\n" + NEXT),
    "an output that is remembered": (NEXT, "    state.z_v = z_v_next + 0.0 * outputs.v_hat\n"),
    "a parameter that is changed": (NEXT, NEXT + "    parameters.K_F = 2.0 * parameters.K_F\n"),
    "a guard that always holds": ("LARGEST = 1e+150", "LARGEST = 1e-150"),
    "another guard": ("not abs(check) <= LARGEST:\n        given", "not abs(check) <= 5.0:\n        given"),
    "a guard of a product": ("    check = z_v_next", "    check = 1e149 * z_v_next"),
    "another restart": ("        fresh = init(parameters, inputs)", "        fresh = State()"),
    "a statement between": ("def init(", "print(1)\n\n\ndef init("),
    "an assertion": ("def prepare(", "assert 1\n\n\ndef prepare("),
}


@pytest.mark.parametrize("case", UNREAD)
def test_a_twin_with_more_than_a_twin_has_is_refused(case: str) -> None:
    with pytest.raises(Refused, match="cannot be read as one: line"):
        check(*changed("one_mass", UNREAD[case]))


@pytest.mark.parametrize("path", sorted(GENERATED.glob("*/__init__.py")), ids=lambda p: p.parent.name)
def test_what_is_generated_is_read(path: Path) -> None:
    subset.require_twin(ast.parse(path.read_text("utf-8")))


@pytest.mark.parametrize("limit", ["300.0", "5.0", "0.1"])
def test_another_law_for_slow_slips_is_refused(limit: str) -> None:
    with pytest.raises(Refused, match="another law for slow slips"):
        check(*changed("one_mass", *other_law(limit)))


def test_another_law_for_fast_slips_is_refused() -> None:
    fast = "    fast = 0.5 + 0.5 * _sign(abs(v_hat) - 5000.0)\n    check = z_v_next"
    pairs = ("    check = z_v_next", fast), (NEXT, "    state.z_v = z_v_next + fast * v_hat\n")
    with pytest.raises(Refused, match="another law for slow slips than for fast ones"):
        check(*changed("one_mass", *pairs))


def test_a_variable_that_is_not_the_plain_quantity_is_refused() -> None:
    """omega1 is 100000 times the estimate, so that the proof covers a range 100000 times narrower."""
    content = certificate("two_link_arm")
    text = json.dumps(content["parameters"]).replace('"omega1"', '["*", "1/100000", "omega1"]')
    content["parameters"] = json.loads(text)
    content["code"]["variables"]["omega1"] = ["*", "100000", "outputs.omega1_hat"]
    verify.check(json.dumps(content))
    with pytest.raises(Refused, match="omega1 has the range of the code's own omega1, and is not shown as that"):
        check(content, sources("two_link_arm"))
    content["code"]["variables"]["omega1"] = "outputs.omega2_hat"
    with pytest.raises(Refused, match="omega1 has the range of the code's own omega1, and is not shown as that"):
        check(content, sources("two_link_arm"))


AXIS = "    z_y: float = 1.0  # m/s: observer state\n"
GROWS = "    state.z_y = 7.13 * state.z_y\n"


@pytest.mark.parametrize("name", ["z_y", "memory", "direction_y"])
def test_an_unstable_axis_that_no_error_covers_is_refused(name: str) -> None:
    field, grows = AXIS.replace("z_y", name), GROWS.replace("z_y", name)
    rail = "    z_rail: float = 0.0"
    with pytest.raises(
        Refused, match=r"the code has 3 states, and the certificate 2 errors|covered by no error|is no direction"
    ):
        check(*changed("one_mass", (rail, field + rail), (NEXT, NEXT + grows)))


def test_a_state_that_two_errors_do_not_tell_apart_is_refused() -> None:
    """The estimate of the level shows the velocity's state too, and none its own."""
    content, files = changed(
        "one_mass", ("a_hat_rail = state.z_rail - ", "a_hat_rail = state.z_v - 0.0 * state.z_rail - ")
    )
    with pytest.raises(Refused, match=r"is not what outputs\.a_hat_rail shows"):
        check(content, files)


@pytest.mark.parametrize(
    ("errors", "words"),
    [
        (["outputs.v_hat", "outputs.v_hat"], "is not the estimate of which e_a_rail is the lag"),
        (["outputs.v_hat", ["*", "100000", "outputs.a_hat_rail"]], "is not the lag of an output"),
        (["outputs.v_hat", ["+", "outputs.a_hat_rail", "1"]], "is not the lag of an output"),
        (["outputs.v_hat", "inputs.x"], "is not the lag of an output"),
        (["outputs.v_hat"], "where the twin shows every error"),
    ],
)
def test_errors_are_the_lags_of_their_own_outputs(errors: Any, words: str) -> None:
    content = certificate("one_mass")
    content["code"]["errors"] = errors
    with pytest.raises(Refused, match=words):
        check(content, sources("one_mass"))


def test_a_unit_is_the_code_s() -> None:
    content, files = certificate("one_mass"), sources("one_mass")
    content["error"][1]["unit"] = "mN"
    with pytest.raises(Refused, match="e_a_rail is stated in mN, and the code shows it in N"):
        check(content, files)
    bound = json.loads(files["bound.json"])
    bound["bounds"][0]["unit"] = "mN"
    text = json.dumps(content).encode()
    bound["certificate"]["sha256"] = hashlib.sha256(text).hexdigest()
    with pytest.raises(newtons.Refused, match="e_a_rail is stated in mN"):
        newtons.check(json.dumps(bound), sources=files | {"certificate.json": text})
    bare = json.dumps(content | {"code": {"errors": [], "variables": {}, "motion": {}}}).encode()
    bound["certificate"]["sha256"] = hashlib.sha256(bare).hexdigest()
    report = newtons.check(json.dumps(bound), sources=files | {"certificate.json": bare})
    assert not report.bound and not any("mN" in fact for fact in report.facts)
    assert newtons.UNITS in report.open


def points(name: str, content: Any, source: bytes) -> list[tuple[Any, Any]]:
    top, twin = verify.parsed(json.dumps(content)), binding.Twin(source.decode())
    return [pair for pair, _ in zip(binding.alike(top, twin), range(3), strict=False)]


@pytest.mark.parametrize("name", ["emps", "two_link_arm", "belt_axis", "chain"])
def test_points_lie_inside_the_envelope(name: str) -> None:
    content, twin = certificate(name), sources(name)[TWIN]
    ends = binding.Twin(twin.decode()).envelope
    seen = 0
    for pair in points(name, content, twin):
        for now in pair:
            for text in {place for both in content["code"]["motion"].items() for place in both}:
                if (plain := binding.plain_name(text)) in ends:
                    low, high = map(Fraction, ends[plain])
                    assert low <= binding.read(text, now)[0] <= high
                    seen += 1
    assert seen >= 6


def test_points_are_of_the_files_and_not_of_the_certificate_s_text() -> None:
    content, twin = certificate("one_mass"), sources("one_mass")[TWIN]
    first = points("one_mass", content, twin)
    other = content | {"tool": content["tool"] | {"version": "9.9"}, "claim": "another"}
    assert points("one_mass", other, twin) == first
    assert points("one_mass", content, twin + b"# one more comment\n") != first


def run(module: str, path: Path) -> tuple[int, str]:
    script = Path(verify.__file__).with_name(module)
    done = subprocess.run([sys.executable, "-I", str(script), str(path)], capture_output=True, text=True)
    assert done.stderr == ""
    return done.returncode, done.stdout


def edited(content: Any, case: str) -> Any:
    if case == "no files":
        return content | {"subject": content["subject"] | {"files": {}}}
    if case == "no C":
        files = {name: digest for name, digest in content["subject"]["files"].items() if not name.endswith(".c")}
        return content | {"subject": content["subject"] | {"files": files}}
    if case == "an invented matrix":
        matrix = [["-50", "0"], ["0", "-50"]]
        more = {"lyapunov_matrix": [["1", "0"], ["0", "1"]], "decay_rate": "10", "reversals": []}
        return content | more | {"matrix": matrix, "code": {"errors": [], "variables": {}, "motion": {}}}
    return content


@pytest.mark.parametrize("case", ["", "no files", "no C", "an invented matrix", "no twin here", "no C here"])
def test_what_is_bound_to_no_code_has_an_exit_status_of_its_own(case: str, tmp_path: Path) -> None:
    folder = tmp_path / "one_mass"
    shutil.copytree(GENERATED / "one_mass", folder)
    text = json.dumps(edited(certificate("one_mass"), case))
    (folder / "certificate.json").write_text(text)
    if case.endswith("here"):
        (folder / (TWIN if case == "no twin here" else "one_mass.c")).unlink()
    bound = json.loads((folder / "bound.json").read_text())
    bound["certificate"]["sha256"] = hashlib.sha256(text.encode()).hexdigest()
    (folder / "bound.json").write_text(json.dumps(bound))
    runs = [run("verify.py", folder / "certificate.json")]
    runs += [run("newtons.py", folder / "bound.json")] if case != "an invented matrix" else []
    for status, out in runs:
        assert status == (5 if case else 0), out
        assert ("one_mass\nverified:\n" in out) == (not case)
        assert ("verified, of the C by the kernel alone" in out) == (case == "no twin here")
        assert ("verified, but bound to no code" in out) == (case not in ("", "no twin here"))
        assert ("proved of one_mass.c itself" in out) == (case in ("", "no twin here"))


def test_a_twin_that_the_replay_cannot_follow_is_bound_to_no_code() -> None:
    content, files = changed("one_mass", (LAW, LAW + " * _sqrt(4.0)"), ("def prepare(", SQRT + "def prepare("))
    report = check(content, files)
    assert not report.bound and REPLAYED not in report.facts


SQRT = "def _sqrt(u: float) -> float:\n    return math.sqrt(u) if not u < 0.0 else math.nan\n\n\n"


@pytest.mark.parametrize("path", sorted(GENERATED.glob("*/sliding.json")), ids=lambda p: p.parent.name)
def test_a_region_that_no_twin_shows_is_bound_to_no_code(path: Path) -> None:
    report = verify.check(path.read_text("utf-8"), path.parent)
    assert not report.bound and "the range of" in " ".join(report.open)


def directions_shown(name: str) -> list[list[Fraction]]:
    """The errors at the points of this run."""
    content = certificate(name)
    pairs = points(name, content, sources(name)[TWIN])
    return [[binding.estimate(raw, before)[1] for raw in content["code"]["errors"]] for before, _ in pairs]


SCRIPT = """
import json, sys
from checker.test_attacks import directions_shown
print(json.dumps([[str(x) for x in row] for row in directions_shown("two_mass")]))
"""


def test_no_author_knows_the_points_of_the_next_run() -> None:
    """With four errors and three known directions a matrix of another rate moved them as the twin does."""
    tests = Path(__file__).parents[1]
    path = f"import sys; sys.path[:0] = {[str(tests), str(tests.parent)]!r}\n"
    done = subprocess.run([sys.executable, "-c", path + SCRIPT], capture_output=True, text=True, check=True)
    known = [[Fraction(x) for x in row] for row in json.loads(done.stdout)]
    normal = cross(known)
    assert any(normal) and all(sum(a * b for a, b in zip(normal, row, strict=True)) == 0 for row in known)
    content = certificate("two_mass")
    largest = max(map(abs, normal))
    content["matrix"][0] = [
        str(Fraction(entry) + x / largest / 10**9) for entry, x in zip(content["matrix"][0], normal, strict=True)
    ]
    verify.check(json.dumps(content))
    with pytest.raises(Refused, match="`matrix` is not how the twin moves its error"):
        check(content, sources("two_mass"))


def cross(rows: list[list[Fraction]]) -> list[Fraction]:
    """What is at right angles to three vectors of four."""

    def minor(k: int) -> Fraction:
        (a, b, c), (d, e, f), (g, h, i) = ([x for j, x in enumerate(row) if j != k] for row in rows)
        return (-1) ** k * (a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))

    return [minor(k) for k in range(4)]


@pytest.mark.parametrize("unit", ["\N{MICRO SIGN}N", "mN\N{MIDDLE DOT}m", "\N{FULLWIDTH LATIN CAPITAL LETTER N}", "N?"])
def test_a_unit_of_other_letters_is_compared_too(unit: str) -> None:
    content = certificate("one_mass")
    content["error"][1]["unit"] = unit
    with pytest.raises(Refused, match="e_a_rail is stated in"):
        check(content, sources("one_mass"))


HUGE = ["^", ["^", ["^", ["^", ["^", "2", "64"], "64"], "64"], "64"], "64"]


@pytest.mark.parametrize("power", [["^", "2", "999999999"], ["^", "2", "-999999999"], ["^", "2", "1/2"], HUGE])
def test_a_power_without_end_is_refused(power: Any) -> None:
    for change in ("variables", "parameters"):
        content = certificate("two_link_arm")
        if change == "variables":
            content["code"]["variables"]["s_elbow"] = power
        else:
            content["parameters"][0]["expression"] = power
        with pytest.raises(Refused, match="power"):
            check(content, sources("two_link_arm"))


def beyond(what: str, limit: str) -> tuple[tuple[str, str], ...]:
    """Where this is larger the step doubles its velocity."""
    far = f"    far = 0.5 + 0.5 * _sign({what} - {limit})\n    check = z_v_next"
    return ("    check = z_v_next", far), (NEXT, "    state.z_v = z_v_next + far * v_hat\n")


@pytest.mark.parametrize("limit", ["100.0", "20000.0"])
@pytest.mark.parametrize("what", ["inputs.w", "inputs.x", "a_hat_rail"])
def test_another_law_where_what_is_no_variable_is_large_is_refused(what: str, limit: str) -> None:
    with pytest.raises(Refused, match=r"moves its error otherwise where what is no variable|another law for slow"):
        check(*changed("one_mass", *beyond(what, limit)))


@pytest.mark.parametrize(
    "grows",
    [
        "    state.q = 0.5 * state.q + 0.00001 * state.q * state.q\n",
        "    state.q = state.q + (1.0 + _sign(abs(state.q) - 500.0)) * state.q\n",
    ],
)
def test_a_state_that_grows_where_it_is_large_is_refused(grows: str) -> None:
    rail = "    z_rail: float = 0.0"
    with pytest.raises(Refused, match="state q is covered by no error"):
        check(*changed("one_mass", (rail, "    q: float = 0.0\n" + rail), (NEXT, NEXT + grows)))


def test_slips_that_a_guard_hides_are_said() -> None:
    """A parameter named slip_speed takes slow slips out of the replay, in a twin that has no guard too."""
    gain = "    K_F: float = 10.0"
    content, files = changed("one_mass", (gain, f"    slip_speed: float = 4.0\n{gain}"), *other_law("4.0"))
    assert any("slips slower than slip_speed 4" in gap for gap in check(content, files).open)


def test_another_c_than_that_of_the_subject_binds_nothing() -> None:
    content, files = certificate("one_mass"), sources("one_mass") | {"other.c": b""}
    kept = {TWIN: content["subject"]["files"][TWIN], "other.c": hashlib.sha256(b"").hexdigest()}
    content["subject"]["files"] = kept
    report = check(content, files)
    assert not report.bound and "C: one_mass.c is not named" in report.open


@pytest.mark.parametrize("module", ["verify.py", "newtons.py"])
def test_a_name_with_an_escape_does_not_reach_the_screen_as_it_stands(module: str, tmp_path: Path) -> None:
    script = Path(verify.__file__).with_name(module)
    for name in ("\x1b[31m", "a\nverified:"):
        for options in ([name], [GENERATED / "rig" / "certificate.json", "--spec", tmp_path / f"{name}.yaml"]):
            (tmp_path / f"{name}.yaml").write_text("another")
            done = subprocess.run([sys.executable, "-I", script, *options], capture_output=True, text=True, check=False)
            said = done.stdout + done.stderr
            assert done.returncode in (2, 3) and said.count("\n") == 1 and said[:-1].isprintable()


def test_a_device_that_has_nothing_to_read_yet_is_unreadable(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Waiting(io.BytesIO):
        def read(self, size: int | None = -1) -> Any:
            return None

        def fileno(self) -> int:
            return handle.fileno()

    (tmp_path / "log").write_text("")
    with (tmp_path / "log").open("rb") as handle:
        monkeypatch.setattr("builtins.open", lambda *_, **__: Waiting())
        with pytest.raises(OSError, match="nothing to read"):
            files.read(tmp_path / "log")
