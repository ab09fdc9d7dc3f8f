"""C that no run executes, but that a compiler reads: it was not looked at, and changed what the rest means.

``__STRING`` of <sys/cdefs.h>, which <math.h> includes, makes a string without quotes. So a declaration in a loop that
is never passed through gave the function ``sin`` the assembler's name ``cos``: of two_link_arm.c, whose kernel proof
was accepted, gcc -O0 made an object that calls ``cos`` alone.
"""

from __future__ import annotations

import pytest

from codegen.checker import verify
from tests.checker.forged import changed, check

UNREAD = "extern double sin(double) __asm__(__STRING(cos));"
PREPARE = "    parameters->constant_1 = "
SUM = "const double given = fabs(inputs->theta1) + fabs(inputs->theta2) + fabs(inputs->w1) + fabs(inputs->w2);"


@pytest.mark.parametrize("ends", ["1; i < 1", "2; i < 0"])
def test_a_loop_without_a_pass_is_refused(ends: str) -> None:
    content, files = changed("two_link_arm", (PREPARE, f"    for (int i = {ends}; i++) {{ {UNREAD} }}\n{PREPARE}"))
    with pytest.raises(verify.Refused, match="a loop without a pass"):
        check(content, files)


@pytest.mark.parametrize("added", ["_Pragma(__STRING(GCC optimize __STRING(fast-math))) 0.0", "sqrt(-1.0)"])
def test_a_sum_with_a_loop_without_a_pass_is_refused(added: str) -> None:
    loop = f"{SUM.removeprefix('const ')} for (int i = 0; i < 0; i++) {{ given += {added}; }}"
    content, files = changed("two_link_arm", (SUM, loop))
    with pytest.raises(verify.Refused, match="a loop without a pass"):
        check(content, files)


def test_the_end_of_a_loop_in_octal_digits_is_refused() -> None:
    """016 is 14 in C: `given` had no x[14] and x[15], and a NaN in one of them reset the observer as a valid sample."""
    old = "given = fabs(inputs->w);\n    for (int i = 0; i < 16; i++)"
    content, files = changed("chain", (old, old.replace("16", "016")))
    with pytest.raises(verify.Refused, match="is no part of a sum"):
        check(content, files)


def test_an_array_that_hides_a_number_is_refused() -> None:
    """The difference of two arrays is a whole number of elements between them: v_hat was 1 m/s at all times."""
    sum_, shows = "    const double check = z_v_next", "outputs->v_hat = v_hat;"
    numbers = f"    const double p = v_hat + v_hat;\n    const double q = v_hat;\n{sum_}"
    assert verify.status(check(*changed("one_mass", (sum_, numbers), (shows, "outputs->v_hat = p - q;")))) == 0
    hidden = changed("one_mass", (sum_, numbers), (shows, "double p[9]; double q[1]; outputs->v_hat = p - q;"))
    with pytest.raises(verify.Refused, match="p is declared twice"):
        check(*hidden)
