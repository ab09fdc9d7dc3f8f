"""What ../shared/errata.md knows is found again by computation, with the right form; and what we found beside it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.slow_cases import slow_except
from tests.thesis.audit.printed import claim, findings, of, reprinted

KNOWN = [
    ("3.2", "the section's", "wrong", "F_hat + u"),
    ("4.31", "", "wrong", "M_inv*(g - g_hat) - M_inv*U*(S*a - S_hat*(a - e_a)) - K_v*e_v"),
    ("4.7.1", "GCFO", "wrong", "+ w)*sgn(v_hat2)/m_2"),
    ("5.13", "", "wrong", "B_wide_T*BB_T_inv*F"),
    ("6.22", "", "wrong", "k_a*(-e_f + f + k_f2*v)*(a*e_f - e_a*e_f + e_a*f)"),
    ("6.23", "", "wrong", "a*k_a*(f + k_f2*v), f*k_a*(f + k_f2*v)]"),
    ("6.4.3", "the three", "insufficient", "f*k_a*xi_f*(f + k_f2*v) > 0"),
    ("7.19", "", "wrong", "K_f2*M_inv*U*diag_f;"),
    ("8.4", "", "wrong", "-(k_F*abs(omega_hat) - z_F)*sgn(omega_hat)"),
    ("8.5", "", "wrong", "k_F*(-F_hat + w)*sgn(omega_hat)"),
    ("8.3", "section", "insufficient", "-k_F > 0"),
]
FOUND = [
    ("1.1.1", "Tustin", "wrong"),
    ("1.1.1", "Bo", "wrong"),
    ("1.1.2.2", "reset", "wrong"),
    ("2.4.1", "conditions", "unnecessary"),
    ("2.4.1", "conditions 1 to 3", "insufficient"),
    ("3.21", "", "wrong"),
    ("4.12", "as printed", "wrong"),
    ("4.12", "where U", "holds"),
    ("4.19", "as printed", "wrong"),
    ("4.19", "where U", "holds"),
    ("4.27", "rate, U of x", "wrong"),
    ("4.32", "as printed", "wrong"),
    ("4.32", "where U", "holds"),
    ("4.61", "", "wrong"),
    ("4.7.1", "GTO, K_1", "wrong"),
    ("5.3.1", "third", "insufficient"),
    ("5.3.2", "(5.12)", "insufficient"),
    ("6.17", "second line", "wrong"),
    ("6.4.1", "conditions", "unnecessary"),
    ("6.4.3", "condition 3 for the Dahl", "wrong"),
    ("6.6.1", "conditions, as printed", "insufficient"),
    ("6.6.1", "conditions, as conditions", "holds"),
    ("6.6.2", "conditions, as printed", "insufficient"),
    ("6.6.2", "conditions, as conditions", "holds"),
    ("6.6.3", "the three conditions, as conditions", "insufficient"),
    ("6.6.3", "the three conditions, as printed", "insufficient"),
    ("6.6.3", "Ψ", "holds"),
    ("7.3.1", "dz_a/dt, U of x", "wrong"),
    ("7.17", "", "wrong"),
    ("7.18", "where U", "wrong"),
    ("7.18", "as printed", "wrong"),
    ("7.26", "", "wrong"),
    ("7.27", "as printed", "wrong"),
    ("7.6.1", "Ψ", "wrong"),
    ("7.37", "", "wrong"),
    ("7.38", "", "wrong"),
    ("8.10", "dz_a/dt", "wrong"),
    ("8.13", "dz_a/dt", "wrong"),
    ("8.13", "dz_f/dt", "wrong"),
    ("A.9", "entries", "wrong"),
    ("A.17", "", "wrong"),
    ("A.18", "", "wrong"),
    ("A.19", "", "wrong"),
    ("A.33", "", "wrong"),
    ("A.44", "", "wrong"),
    ("A.56", "for ψ", "wrong"),
    ("A.56", "where", "holds"),
    ("A.69", "the display", "wrong"),
]


@pytest.mark.parametrize(("equation", "part", "verdict", "right"), KNOWN)
def test_known_errata_are_found_again(equation, part, verdict, right):
    (finding,) = of(equation, part)
    assert finding.verdict == verdict
    assert right in finding.derived


LONG = ("4.61", "7.26", "A.69")
"""Equations whose derivation takes one to three seconds."""


@pytest.mark.parametrize(
    ("equation", "part", "verdict"), slow_except(FOUND, [one for one in FOUND if one[0] not in LONG], several=True)
)
def test_what_else_was_found(equation, part, verdict):
    assert next(f.verdict for f in of(equation, part)) == verdict


@pytest.mark.slow
def test_nothing_else_is_called_wrong():
    """A new verdict is looked at before it is believed: what is in no list above holds."""
    listed = [(e, p) for e, p, *_ in [*KNOWN, *FOUND]] + [("7.19", "at n = 1"), ("7.6.1", "at n = 1")]
    for finding in [f for f in findings() if f.verdict != "holds"]:
        entry = finding.claim.entry
        assert any(entry.equation == e and entry.part.startswith(p) for e, p in listed), (entry.equation, entry.part)


RIGHT = [
    ("3.2", "the section's", "u + F_hat"),
    ("3.21", "", "q_2 + a_v*v_dot*sgn_v"),
    ("4.12", "as printed", "K_F*D*S*(U_T*M_inv*(g - U*S*a_hat) + U_dot_T*v)"),
    ("4.31", "", "M_inv*(g - g_hat) - M_inv*U*(S*a - S_hat*(a - e_a)) - K_v*e_v"),
    ("4.61", "", "M_inv*(w - F_c - F_g - F_hat) - K_omega*omega_hat"),
    ("5.13", "", "B_wide_T*BB_T_inv*F"),
    ("6.22", "", "k_a*(f + k_f2*v - e_f)*(a*e_f + f*e_a - e_a*e_f)"),
    ("6.23", "", [["k_f2*a + xi_f", "k_f2*f"], ["k_a*a*(f + k_f2*v)", "k_a*f*(f + k_f2*v)"]]),
    ("8.4", "", "(z_F - k_F*abs(omega_hat))*sgn(omega_hat)"),
    ("8.5", "", "k_F*(w - F_hat)*sgn(omega_hat)"),
    ("A.33", "", [["0", "0", "0", "1"]]),
]


@pytest.mark.parametrize(("equation", "part", "right"), RIGHT)
def test_the_right_form_holds_in_the_place_of_the_printed_one(equation, part, right):
    assert reprinted(claim(equation, part), right).verdict == "holds"


def test_the_errata_point_of_6_22():
    """k_a = 10, k_f2 = 0.1, a = 50, f = v = 1, ξ_f = −0.01 meets the printed conditions and has an eigenvalue +16."""
    import numpy as np

    from codegen.thesis.audit.derivations.one import one_dynamic

    ours = one_dynamic()
    point = {"k_a": 10, "k_f2": 0.1, "a": 50, "f": 1, "v": 1, "xi_f": -0.01}
    psi = ours.derived["jacobian"].value.subs({ours.names[k]: v for k, v in point.items()})
    assert max(np.linalg.eigvals(np.array(psi, dtype=float)).real) == pytest.approx(16, abs=0.1)


def test_printed_conditions_are_right_with_the_right_inequalities():
    """q + b + a k_f2 < 0 and b q > 0 with b = k_a f (f + k_f2 v), which with ξ_f < 0 is b < 0: errata.md's form."""
    found = reprinted(
        claim("6.4.3", "the three"), ["k_a*f*(f + k_f2*v) < 0", "a*k_f2 < -xi_f - k_a*f*(f + k_f2*v)", "xi_f < 0"]
    )
    assert found.verdict == "unnecessary"  # for ξ_f < 0 they are both; ξ_f > 0 can be stable as well
    with_slope = claim("6.4.3", "the three")
    entry = with_slope.entry.model_copy(update={"given": ["a > 0", "xi_f < 0"]})
    right = ["k_a*f*(f + k_f2*v) < 0", "a*k_f2 < -xi_f - k_a*f*(f + k_f2*v)"]
    assert reprinted(replace(with_slope, entry=entry), right).verdict == "holds"
