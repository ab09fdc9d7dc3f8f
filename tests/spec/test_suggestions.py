"""The name that a message suggests: near by single slips of the hand, or none."""

from __future__ import annotations

import random
import string

import pytest

from codegen.base.errors import nearest_name

CASES = [
    ("th", ("t", "x", "w"), None),  # half of the word is another
    ("th", ("t", "theta", "TH"), "TH"),
    ("x", ("y", "z"), None),
    ("X", ("y", "x"), "x"),
    ("vel", ("val", "v"), "val"),
    ("tiem", ("time", "item"), "time"),
    ("freind", ("friend", "trend"), "friend"),
    ("viscuos", ("viscous", "visc"), "viscous"),
    ("columb", ("coulomb", "column"), "column"),
    ("colulomb", ("coulomb", "column"), "coulomb"),
    ("semi-implicit", ("euler", "implicit", "semi_implicit"), "semi_implicit"),
    ("reset_integrator_", ("extended_reset_integrator", "reset_integrator"), "reset_integrator"),
    ("M", ("m", "J"), "m"),
    ("x", ("v1", "x1", "x2"), "x1"),
    ("x_12", ("v", "x"), "x"),
    ("1", ("2", "3"), None),
    ("kk", ("m", "k"), "k"),
    ("vell", ("vel_l", "vel"), "vel"),
    ("nothing_alike", ("mass", "force"), None),
    ("nc", ("m", "mc", "k"), "mc"),
    ("nc", ("mc", "tc"), None),  # either may be meant
    ("tol", ("value", "unit", "tolerance"), "tolerance"),
    ("tol", ("tolerance", "tolerated"), None),
    ("to", ("tolerance",), None),  # two letters begin too many names
    ("v1", ("x1", "x_dot"), None),  # a number alone is no likeness
    ("", ("a", "b"), None),
    ("a" * 10**6, ("a" * 10**6,), None),  # what no message prints
]


@pytest.mark.parametrize(("word", "known", "expected"), CASES)
def test_what_is_suggested(word: str, known: tuple[str, ...], expected: str | None) -> None:
    assert nearest_name(word, known) == expected


def test_one_slip_in_a_name_finds_it() -> None:
    """Each kind of slip is made at each place of names whose letters are all others."""
    dice = random.Random(1)
    for length in range(3, 13):
        letters = dice.sample(string.ascii_lowercase, length)
        name, others = "".join(letters), [letter for letter in string.ascii_lowercase if letter not in letters]
        known = ["".join(others[:length]), name]
        for k in range(length):
            other = letters[k] + others[0]
            slips = [letters[:k] + letters[k + 1 :], [*letters[:k], other, *letters[k + 1 :]]]
            slips += [[*letters[:k], others[0], *letters[k + 1 :]]]
            if k + 1 < length:
                slips += [[*letters[:k], letters[k + 1], letters[k], *letters[k + 2 :]]]
            for slip in slips:
                assert nearest_name("".join(slip), known) == name, slip
