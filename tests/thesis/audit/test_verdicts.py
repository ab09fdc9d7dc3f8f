"""Verdicts come from computation: another printed form gets another verdict; counterexamples are what they claim."""

from __future__ import annotations

import numpy as np
import pytest

from codegen.base.errors import BadInput, Place
from codegen.thesis.audit.derivation import evaluate, inequalities
from codegen.thesis.audit.judge import derivations_of
from tests.thesis.audit.printed import claim, claims, findings, reprinted

MUTATIONS = [
    ("2.8", "", "k_F*mu*abs(v)**(mu - 1)*(w - F_hat)*sgn(v)", "k_F*mu*abs(v)**mu*(w - F_hat)*sgn(v)"),
    ("2.13", "", None, "k_F*mu*abs(v)**(mu - 1)*e_a + a_v*v_dot"),
    ("2.18", "", None, "-k_2*e_F + F_dot"),
    ("3.19", "", None, [["-k_v", "-1"], ["k_F", "0"]]),
    ("3.24", "", None, [["-k_v", "1"], ["-k_1 - k_2*k_v", "0"]]),
    ("4.17", "", None, "-K_1*v - K_2*M_inv*(g + F_hat)"),
    ("4.22", "", None, "M_inv*K_2*e_F + F_dot"),
    ("4.32", "where U", None, "K_F*S_hat*U_T*K_v*e_v"),
    ("4.54", "", None, [["I_1", "I_2"], ["I_2", "I_2"]]),
    (
        "4.55",
        "",
        None,
        ["-m_2*l_1*b_2*(omega_1 + omega_2)*omega_2*sin(theta_2)", "m_2*l_1*b_2*omega_1**2*sin(theta_2)"],
    ),
    ("5.9", "", None, "B*U*F_bar"),
    ("6.21", "", None, "k_f2*a*e_f + k_f2*f*e_a + k_f2*e_a*e_f + xi - xi_1_hat"),
    ("6.31", "", None, "-k_a*(v*(k_f1 + k_f2*k_v) + k_v*(f - e_f))*e_v"),
    ("6.33", "", None, ["D_1*(f - 1)", "D_2*f", "D_1*(f + 1)"]),
    ("7.28", "", None, "-(K_f1 - K_f2*K_v)*e_v + xi - xi_hat"),
    ("8.7", "", None, "-k_1*omega_hat - k_2*(w + F_hat)"),
    ("A.37", "M", None, "T_T*M_bar*T"),
    ("A.60", "", None, "q_dot_T*T_q_T*M*T_q"),
    ("A.66", "", None, "T_q_T*g_x + T_q_T*M*T_q_dot*q_dot"),
    ("B.1", "", None, [["A*X_1", "A*X_2", "-A*X_3"]]),
]


@pytest.mark.parametrize(("equation", "part", "_", "mutant"), MUTATIONS)
def test_a_mutated_formula_is_wrong(equation, part, _, mutant):
    original = claim(equation, part)
    assert reprinted(original, original.entry.printed).verdict == "holds"
    assert reprinted(original, mutant).verdict == "wrong"


@pytest.mark.parametrize(
    ("equation", "part", "conditions", "verdict"),
    [
        ("3.4.1.1", "conditions", ["k_v > 0"], "insufficient"),
        ("3.4.1.1", "conditions", ["k_v > 1", "k_F > 0"], "unnecessary"),
        ("2.4.2", "condition", ["k_2 > 0"], "insufficient"),
        ("3.4.2.1", "conditions", ["k_v > 0", "k_1 < 0"], "insufficient"),
        ("2.15", "", ["a_4 - a_2*a_3 <= -a_2*a_3*exp(-a_3*abs(v)) < a_4 - a_2"], "wrong"),
    ],
)
def test_mutated_conditions_are_caught(equation, part, conditions, verdict):
    assert reprinted(claim(equation, part), conditions).verdict == verdict


def counterexamples():
    return [f for f in findings() if f.kind in ("hurwitz", "negative_definite") and f.counterexample]


@pytest.mark.slow
def test_counterexamples_by_numpy():
    assert len(counterexamples()) >= 6
    for finding in counterexamples():
        entry = finding.claim.entry
        name, _, quantity = entry.against.partition(".")
        ours = derivations_of(name)
        numbers = {k: v for k, v in finding.counterexample.items() if k != "eigenvalue"}
        symbols = {s.name: s for s in ours.derived[quantity].value.free_symbols}
        matrix = ours.derived[quantity].value.subs({symbols[k]: v for k, v in numbers.items() if k in symbols})
        matrix = np.array(matrix.evalf().tolist(), dtype=float) if not matrix.atoms(abs) else None
        if finding.kind == "negative_definite":
            matrix = (matrix + matrix.T) / 2
        largest = max(np.linalg.eigvals(matrix).real)
        assert largest == pytest.approx(finding.counterexample["eigenvalue"], rel=1e-4)
        assert (largest > 0) == (finding.verdict == "insufficient")
        printed = [pair for text in entry.printed for pair in inequalities(text, ours.names, finding.claim.place)]
        values = [float(e.subs({s: numbers[s.name] for s in e.free_symbols})) for e, _ in printed]
        assert all(v > 0 for v in values) == (finding.verdict == "insufficient")


@pytest.mark.slow
def test_wrong_formulas_differ_at_their_point():
    shown = [f.counterexample for f in findings() if f.verdict == "wrong" and f.counterexample and f.kind == "equal"]
    assert len(shown) > 15
    assert all(numbers["printed"] != numbers["derived"] for numbers in shown)


def test_no_verdict_in_the_claims():
    """The claims hold what is printed and how to derive it; never what comes out."""
    for c in claims():
        assert set(type(c.entry).model_fields) == {
            "equation", "part", "printed", "against", "test", "given", "constant_U", "scan", "note"
        }  # fmt: skip


@pytest.mark.parametrize(
    "text", ["__import__('os')", "x.y", "x if y else z", "[x for x in y]", "x(1)", "lambda: 1", "'s'"]
)
def test_text_is_never_evaluated(text):
    with pytest.raises(BadInput):
        evaluate(text, {}, Place("test"))
