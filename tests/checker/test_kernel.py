"""The kernel proves what is shipped from the C that is shipped, and refuses every forgery."""

from __future__ import annotations

import json
import math
import random
import subprocess
import sys
from fractions import Fraction
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from codegen.app.generate import generated_program
from codegen.cancellation import with_cancellation
from codegen.certify.certify import Certificate
from codegen.certify.kernel_form import NotCovered, proof_text
from codegen.checker import counterexamples, kernel
from codegen.observers import observer_of
from codegen.program import build_program
from codegen.replay.twin import load_twin
from codegen.spec import parse_spec, read_spec

ROOT = Path(__file__).parents[2]
GENERATED = ROOT / "generated"
PROVED = (
    "belt_axis",
    "emps",
    "one_mass",
    "one_mass_cfo_semi_implicit",
    "one_mass_domain",
    "rig",
    "rig_to",
    "two_mass",
    "two_mass_cancellation",
    "two_mass_gto",
)
LEFT = {
    "one_mass_dfo_implicit": "depends on the operating point",
    "seven_joint_arm": "depends on the operating point",
    "two_link_arm": "depends on the operating point",
}


def spec_path(name: str) -> Path:
    return next(p for folder in ("", "thesis") if (p := ROOT / "specs" / folder / f"{name}.yaml").exists())


@cache
def proof(name: str) -> str:
    """The proof of a shipped certificate."""
    spec = read_spec(spec_path(name))
    observer = observer_of(spec)
    content = json.loads((GENERATED / name / "certificate.json").read_text("utf-8"))
    return proof_text(observer, build_program(with_cancellation(spec, observer), spec.code).places, content)


def prove(name: str, content: Any, folder: Path = GENERATED) -> tuple[bool, list[str]]:
    return kernel.prove(content, folder / name)


@pytest.mark.parametrize("name", [*PROVED, pytest.param("chain", marks=pytest.mark.slow)])
def test_what_is_shipped_is_proved_of_its_c(name: str) -> None:
    content = json.loads(proof(name))
    certificate = json.loads((GENERATED / name / "certificate.json").read_text("utf-8"))
    whole, said = prove(name, content)
    h, alpha = Fraction(certificate["sample_time"]), Fraction(certificate["decay_rate"])
    assert whole == (name != "one_mass_domain")
    assert said[0] == f"{name}: proved" + ", in its domain" * (not whole)
    assert content["lyapunov_matrix"] == certificate["lyapunov_matrix"]
    assert len(content["reversals"]) == len(certificate["reversals"])
    units = ", ".join(error["unit"] for error in certificate["error"])
    assert f"  V falls to {1 - 2 * alpha * h} a sample; errors in {units}" in said


def test_all_that_has_a_certificate_is_proved_or_named_as_left() -> None:
    certified = {path.parent.name for path in GENERATED.glob("*/certificate.json")}
    assert certified == {*PROVED, "chain", *LEFT}


@pytest.mark.slow
def test_a_matrix_that_depends_on_the_signs_is_proved_for_all_of_them(tmp_path: Path) -> None:
    """With a full K_F the level of one contact follows the other's slip, by the product of their signs."""
    text = spec_path("two_mass").read_text("utf-8").replace("K_F: [500, 700]", "K_F: [[500, 20], [30, 700]]")
    spec = parse_spec(text, Path("two_mass.yaml"))
    program, files, outcome = generated_program(spec)
    assert isinstance(outcome, Certificate)
    for end in "ch":
        (tmp_path / f"two_mass.{end}").write_text(files[f"two_mass.{end}"], "utf-8")
    made = proof_text(observer_of(spec), program.places, outcome.content)
    assert "sign.between * sign.ground" in made
    assert kernel.prove(json.loads(made), tmp_path)[0]
    with pytest.raises(ValueError, match="does not move the errors"):
        kernel.prove(json.loads(made.replace("(sign.between * sign.ground)", "(1)")), tmp_path)
    with pytest.raises(ValueError, match="not positive semidefinite"):
        kernel.prove(json.loads(made) | {"decay_rate": "5"}, tmp_path)


@pytest.mark.parametrize("name", LEFT)
def test_what_the_kernel_has_no_words_for_is_said(name: str) -> None:
    with pytest.raises(NotCovered, match=LEFT[name]):
        proof(name)


# The machines as the specs' sources print them, typed here by hand: mass matrix and force over true quantities.
MACHINES = {
    "one_mass": ([["m"]], ["w - s_rail*a_rail"]),
    "belt_axis": ([["m"]], ["kf*u - b*v - s_guide*a_guide"]),
    "emps": ([["M"]], ["gtau*u - Fv*v - offset - s_rail*a_rail"]),
    "rig_to": ([["J"]], ["w - F_theta"]),
    "two_mass": (
        [["m1", "0"], ["0", "m2"]],
        ["-(eta2 + eta3)*x1 + eta3*x2 - s_between*a_between",
         "eta3*x1 - (eta1 + eta3)*x2 + w + s_between*a_between - s_ground*a_ground"],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MACHINES)
def test_the_machine_of_a_proof_is_the_spec_s(name: str) -> None:
    content, dice = json.loads(proof(name)), random.Random(name)
    spec = read_spec(spec_path(name))
    values: dict[str, Any] = {p.name: Fraction(str(p.value)) for p in spec.parameters}
    for place in [*content["positions"], *content["positions"].values(), *content["signs"]]:
        values[place.split(".")[1] if "sign" not in place else f"s_{place[5:]}"] = Fraction(dice.randrange(-99, 99))
    free = {x: kernel.term(dice.randrange(-99, 99)) for x in ("inputs.w", "inputs.u")}
    for error in content["errors"]:
        free.setdefault(error["truth"], kernel.term(values.get(error["truth"][5:], Fraction(dice.randrange(1, 99)))))
    names = free | {f"parameters.{p}": kernel.term(x) for p, x in values.items()}
    names |= {f"inputs.{p}": kernel.term(x) for p, x in values.items()}
    names |= {f"sign.{p[2:]}": kernel.term(x) for p, x in values.items() if p.startswith("s_")}
    plain = {x.split(".")[1]: p for x, p in free.items()} | {p: kernel.term(x) for p, x in values.items()}
    mass, force = MACHINES[name]
    claimed, typed = kernel.Text(names, {}), kernel.Text(plain, {})
    assert [claimed.value(f) for f in content["force"]] == [typed.value(f) for f in force]
    assert [[claimed.value(x) for x in row] for row in content["mass_matrix"]] == [
        [typed.value(x) for x in row] for row in mass
    ]


@pytest.mark.parametrize("name", ["one_mass", "rig_to", "two_mass", "one_mass_domain", "rig_dfoa", "two_mass_gdfo"])
def test_the_c_is_read_as_the_twin_computes(name: str) -> None:
    """The kernel's reading of the C, on numbers, beside the generated Python."""
    twin, dice = load_twin((GENERATED / name / "__init__.py").read_text("utf-8"), name), random.Random(name)
    _, before, _, good = kernel.matched(kernel.SOURCE, GENERATED / name / f"{name}.c")
    parameters = twin.Parameters()
    for _ in range(5):
        state, inputs, outputs = twin.State(), twin.Inputs(), twin.Outputs()
        for record in (state, inputs):
            for field in record.__slots__:
                setattr(record, field, 0.0 if field == "waiting" else dice.uniform(-2, 2))
        records = {"parameters": parameters, "state": state, "inputs": inputs}
        names = {
            f"{kind}.{field}": kernel.term(Fraction(getattr(record, field)))
            for kind, record in records.items()
            for field in record.__slots__
        }
        code = kernel.Text(names, {}, f"{name}_sign")
        writable = {f"state.{x}" for x in state.__slots__} | {f"outputs.{x}" for x in outputs.__slots__}
        code.run(before, set())
        code.run(good, writable)
        twin.step(state, parameters, inputs, outputs)
        assert outputs.fault == 0
        for kind, record in (("state", state), ("outputs", outputs)):
            for field in set(record.__slots__) - {"waiting", "fault"}:
                found = float(code.names[f"{kind}.{field}"].constant())
                assert math.isclose(found, getattr(record, field), rel_tol=1e-9, abs_tol=1e-9), field


@pytest.mark.parametrize("case", counterexamples.CASES, ids=lambda case: case.why.replace(" ", "-"))
def test_what_is_refused_and_why(case: counterexamples.Case) -> None:
    text = (
        proof("one_mass") if case.file == "p" else (GENERATED / "one_mass" / f"one_mass.{case.file}").read_text("utf-8")
    )
    assert case.old in text
    answer = counterexamples.answer(case, GENERATED / "one_mass", proof("one_mass"))
    assert answer != "proved" and case.answer in answer


def test_the_counterexamples_are_changes_of_what_is_proved() -> None:
    nothing = counterexamples.Case("", "c", "", "", "")
    assert counterexamples.answer(nothing, GENERATED / "one_mass", proof("one_mass")) == "proved"
    assert len({case.why for case in counterexamples.CASES}) >= 40


def forged(tmp_path: Path, name: str, *pairs: tuple[str, str, str]) -> Any:
    """The proof's JSON, after each (file, old, new), its C being in tmp_path / name."""
    texts = {end: (GENERATED / name / f"{name}.{end}").read_text("utf-8") for end in "ch"} | {"p": proof(name)}
    for file, old, new in pairs:
        assert old in texts[file]
        texts[file] = texts[file].replace(old, new)
    (tmp_path / name).mkdir()
    for end in "ch":
        (tmp_path / name / f"{name}.{end}").write_text(texts[end], "utf-8")
    return json.loads(texts["p"])


AXIS = (
    ("h", "    double z_rail; /* N", "    double z_y; /* m */\n    double z_rail; /* N"),
    ("c", "        state->z_v = z_v_next;", "        state->z_v = z_v_next;\n        state->z_y = 7.13 * state->z_y;"),
)


@pytest.mark.parametrize(
    ("claimed", "words"),
    [
        ("", "may grow"),
        (',\n  "state.z_y": "1"', "does not move"),
        (',\n  "state.z_y": "inputs.x"', "does not move"),
        (',\n  "state.z_y": "outputs.v_hat"', "not an error for each state"),
    ],
)
def test_an_unstable_axis_is_refused(tmp_path: Path, claimed: str, words: str) -> None:
    last = "outputs.a_hat_rail"
    content = forged(tmp_path, "one_mass", *AXIS, ("p", f' + {last}"\n', f' + {last}"{claimed}\n'))
    with pytest.raises(ValueError, match=words):
        prove("one_mass", content, tmp_path)


def test_an_unstable_axis_at_rest_is_a_condition(tmp_path: Path) -> None:
    """Where it is zero it stays so: true, said, and no proof without conditions."""
    last = "outputs.a_hat_rail"
    content = forged(tmp_path, "one_mass", *AXIS, ("p", f' + {last}"\n', f' + {last}",\n  "state.z_y": "0"\n'))
    whole, said = prove("one_mass", content, tmp_path)
    assert not whole and said[0] == "one_mass: proved, in its domain"


def test_a_memory_of_one_sample_is_no_error() -> None:
    content = json.loads(proof("one_mass_domain"))
    assert "state.x_predicted" not in content["states"]


@pytest.mark.parametrize("speed", ["300.0", "5.0", "0.1"])
def test_another_law_below_a_speed_is_proved_only_above_it(tmp_path: Path, speed: str) -> None:
    old = "z_v_next = state->z_v +"
    law = ("c", old, f"{old} (1.0 - one_mass_sign(fabs(v_hat) - {speed})) * v_hat +")
    domain = ("p", '"domain": []', f'"domain": ["sign.rail*outputs.v_hat - {speed}"]')
    whole, said = prove("one_mass", forged(tmp_path, "one_mass", law, domain), tmp_path)
    assert not whole and said[0].endswith("in its domain")
    assert f'  domain: ["sign.rail*outputs.v_hat - {speed}"]' in said


def test_no_file_is_no_proof(tmp_path: Path) -> None:
    with pytest.raises(OSError):
        prove("one_mass", json.loads(proof("one_mass")), tmp_path)


def test_mutants_that_are_proved_are_true() -> None:
    """The judge is floating point: the matrix is the code's, and P, rate, growth and dwell may be changed."""
    dice, kept, genuine = random.Random(0), 0, json.loads(proof("two_mass"))
    phi = np.array([[float(Fraction(x)) for x in row] for row in genuine["matrix"]])
    for _ in range(30):
        content = json.loads(proof("two_mass"))
        where, factor = dice.randrange(4), 1 + Fraction(dice.randrange(-9, 10), dice.choice([20, 200, 2000]))
        if where == 0:
            i, j = dice.randrange(4), dice.randrange(4)
            content["lyapunov_matrix"][i][j] = content["lyapunov_matrix"][j][i] = str(
                Fraction(content["lyapunov_matrix"][i][j]) * factor
            )
        elif where == 1:
            content["decay_rate"] = str(Fraction(content["decay_rate"]) * factor)
        elif where == 2:
            content["reversals"][0]["growth"] = str(Fraction(content["reversals"][0]["growth"]) * factor)
        else:
            content["reversals"][1]["dwell"] = str(int(Fraction(content["reversals"][1]["dwell"]) * factor))
        try:
            prove("two_mass", content)
        except ValueError:
            continue
        kept += 1
        P = np.array([[float(Fraction(x)) for x in row] for row in content["lyapunov_matrix"]])
        fall = 1 - 2 * float(Fraction(content["decay_rate"])) * 0.001
        root = np.linalg.inv(np.linalg.cholesky(P))
        assert np.linalg.eigvalsh(root @ phi.T @ P @ phi @ root.T).max() <= fall + 1e-9
        for k, turn in enumerate(content["reversals"]):
            J = np.diag([-1.0 if i == 2 + k else 1.0 for i in range(4)])
            growth = float(Fraction(turn["growth"]))
            assert np.linalg.eigvalsh(root @ J @ P @ J @ root.T).max() <= growth * (1 + 1e-9)
            assert growth * fall ** int(turn["dwell"]) <= 1 + 1e-9
    assert 3 <= kept <= 27


def test_positive_is_what_eigenvalues_say() -> None:
    dice = np.random.default_rng(0)
    for _ in range(200):
        n = int(dice.integers(1, 5))
        B = dice.integers(-3, 4, (n, int(dice.integers(1, n + 1))))
        A = B @ B.T - int(dice.integers(0, 2)) * np.diag(dice.integers(0, 2, n))
        exact = [[Fraction(int(x)) for x in row] for row in A]
        low = np.linalg.eigvalsh(A.astype(float)).min()
        assert kernel.positive(exact) == (low > -1e-9)
        assert kernel.positive(exact, definite=True) == (low > 1e-9)


def test_bernstein_s_form_is_the_polynomial() -> None:
    text, ends = "x*x*y - 3*x*y*y + 2*x - 7/3", {"x": (Fraction(-1), Fraction(2)), "y": (Fraction(1, 3), Fraction(5))}
    p = kernel.Text({x: kernel.term(1, x) for x in ends}, {}).value(text)
    table = {k: kernel.bernstein(p, ends, {"x": (k[0], 2), "y": (k[1], 2)}) for k in product(range(3), repeat=2)}
    for t, u in product([Fraction(0), Fraction(1, 7), Fraction(1, 2), Fraction(1)], repeat=2):
        x, y = -1 + 3 * t, Fraction(1, 3) + Fraction(14, 3) * u
        shape = [[math.comb(2, k) * s**k * (1 - s) ** (2 - k) for k in range(3)] for s in (t, u)]
        mixed = sum(b * shape[0][k] * shape[1][m] for (k, m), b in table.items())
        assert mixed == x * x * y - 3 * x * y * y + 2 * x - Fraction(7, 3)


def claim(text: str, cover: Any, ends: tuple[int, int] = (0, 1)) -> None:
    """That a polynomial in x is not negative."""
    p = kernel.Text({"x": kernel.term(1, "x")}, {}).value(text)
    kernel.semidefinite([[p]], {"x": (Fraction(ends[0]), Fraction(ends[1]))}, cover)


def test_a_cover_proves_what_one_cell_does_not() -> None:
    close = "(x - 1/2)*(x - 1/2) + 1/100"
    with pytest.raises(ValueError, match="not positive semidefinite"):
        claim(close, "")
    claim(close, ["x", "1/2", ["x", "3/8", "", ""], ["x", "5/8", "", ""]])
    with pytest.raises(ValueError, match="not positive semidefinite"):
        claim("(x - 1/2)*(x - 1/2) - 1/10000", ["x", "1/2", ["x", "3/8", "", ""], ["x", "5/8", "", ""]])


@pytest.mark.parametrize(
    "cover", [["x", "0", "", ""], ["x", "1", "", ""], ["y", "1/2", "", ""], ["x", "1/2", ""], None, 0]
)
def test_what_is_no_cover_is_refused(cover: Any) -> None:
    with pytest.raises((ValueError, KeyError, TypeError)):
        claim("1", cover)


def test_a_matrix_needs_more_than_its_entries() -> None:
    names = kernel.Text({"x": kernel.term(1, "x")}, {})
    A = [[names.value(x) for x in row] for row in (["2", "x"], ["x", "2"])]
    kernel.semidefinite(A, {"x": (Fraction(-2), Fraction(2))}, "")
    with pytest.raises(ValueError, match="not positive semidefinite"):
        kernel.semidefinite(A, {"x": (Fraction(-2), Fraction(3))}, "")
    with pytest.raises(ValueError, match="without a range"):
        kernel.semidefinite(A, {}, "")


def test_it_runs_alone_and_prints_no_traceback() -> None:
    script = str(Path(kernel.__file__))
    for text, status, words in (
        (proof("one_mass"), 0, "one_mass: proved\n"),
        (
            proof("one_mass").replace('"domain": []', '"domain": ["inputs.w"]'),
            4,
            "one_mass: proved, in its domain\n",
        ),
        ("{", 1, "refused"),
        ("[]", 1, "refused"),
        ("[" * 100_000, 1, "refused"),
        (proof("one_mass").replace('"279/25"', '"12"'), 1, "refused"),
    ):
        command = [sys.executable, "-I", script, str(GENERATED / "one_mass")]
        done = subprocess.run(command, input=text, capture_output=True, text=True)
        assert done.returncode == status
        assert (done.stdout + done.stderr).startswith(words)


def test_a_sceptic_reads_it_in_one_sitting() -> None:
    text = Path(kernel.__file__).read_text("utf-8")
    assert len(text.splitlines()) < 300
    assert [f"LEMMA {k}." in text for k in range(1, 9)] == [True] * 8
    imported = {line.split()[1].split(".")[0] for line in text.splitlines() if line.startswith(("import ", "from "))}
    assert imported <= sys.stdlib_module_names
