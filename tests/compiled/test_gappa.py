"""Gappa: a step of the generated C is off by no more than `stiction certify` says that rounding adds to each state.

Gappa (Debian) proves bounds of floating-point programs by interval arithmetic and rewriting of its own. It is given the
statements of the shipped C, operation by operation, and the same expressions in exact arithmetic.
"""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from functools import cache

import pytest

from codegen.app.derived import derived_from
from codegen.app.rounding_bound import JUST_ABOVE, Rounding, rounding_bounds
from codegen.certify.bound.bounds import DomainBound
from codegen.certify.certify import Certificate
from tests.slow_cases import slow_except

from .shipped import SPECS, sources
from .toolchain import need

FORMATS = {"double": "float<ieee_64,ne>", "single": "float<ieee_32,ne>"}
STATEMENT = re.compile(r"const double (\w+) = ([^;]+);")
NAME = re.compile(r"\b[A-Za-z_]\w*\b")
VALUES = {"K_v": "100", "K_F": "10", "m": "1", "sample_time": "1/1000", "one_over_m": "1", "h_K_F": "1/100"}
VALUES |= {"a_low_rail": "40", "a_high_rail": "60", "constant_1": "50"}
"""Of the parameters, as specs/one_mass_domain.yaml has them: x is within 10 m, v within 5 m/s and w within 150 N."""
UNIT = {"double": 2.0**-53, "single": 2.0**-24}
SLIDING = ("a_read_rail", "a_hat_rail", "F_hat_rail", "v_dot_hat", "z_v_next", "z_rail_next")
"""What a step computes of the velocity estimate, in its order."""
ERRORS = ("read", "F_hat_rail", "z_v_next", "z_rail_next")
"""What has an error that `certify` states."""


@cache
def stated() -> tuple[dict[str, Rounding], DomainBound]:
    """What `certify` says of the shipped spec."""
    machine = derived_from(SPECS / "one_mass_domain.yaml")
    assert isinstance(machine.outcome, Certificate) and not isinstance(machine.outcome.bounds, str)
    bound = machine.outcome.bounds[0]
    found = rounding_bounds(machine.spec, machine.analysis, machine.outcome, bound)
    assert not isinstance(found, str) and isinstance(bound.domain, DomainBound)
    return found, bound.domain


def script(precision: str, way: int, share: float, names: Sequence[str]) -> str:
    """That these errors of a sliding step are below a share of those stated; in Gappa's language."""
    rounding, domain = stated()
    statements = dict(
        STATEMENT.findall(sources("one_mass_domain", "double")["one_mass_domain.c"].partition("_step(")[2])
    )
    fixed = {"sign_rail": str(way), "direction_rail": str(way), "step_1": str(way), "learning": "1"}
    lines = [f"@rnd = {FORMATS[precision]};"]
    for name, value in VALUES.items():
        lines += [f"M{name} = {value};", f"{name} = rnd(M{name});"]
    lines += [f"{name} = rnd({name}_);" for name in ("x", "z_v", "z_rail", "v_hat")]
    lines += ["w = rnd(Mw);", *(f"M{name} = {name};" for name in ("x", "z_v", "z_rail", "v_hat"))]

    def written(text: str, exact: bool) -> str:
        text = re.sub(r"(parameters|state|inputs)->", "", " ".join(text.split()))
        text = re.sub(r"fabs\(([^()]*)\)", r"|\1|", text.replace("abs_v_hat", "fabs(v_hat)"))
        return NAME.sub(lambda found: fixed.get(found[0], ("M" if exact else "") + found[0]), text)

    lines += ["read rnd= z_v + K_v * x;", "Mread = Mz_v + MK_v * Mx;"]
    for name in SLIDING:
        lines += [f"{name} rnd= {written(statements[name], False)};", f"M{name} = {written(statements[name], True)};"]
    fastest, level = 5.0 + domain.velocity, 60.0 + domain.everywhere
    ends = sorted((way * JUST_ABOVE, way * fastest))  # above the slip_speed of 1 m/s
    ranges = {"x": [-10, 10], "z_v": [-fastest - 1000, fastest + 1000], "v_hat": ends, "Mw": [-150, 150]}
    ranges |= {"z_rail": [-level - 10 * fastest, level + 10 * fastest], "Ma_hat_rail": [-level, level]}
    found = rounding[precision]
    position = (found.position - UNIT[precision] * 10) * 100  # of v_hat, K_v times that of x; x itself is rounded apart
    errors = {"read": position, "F_hat_rail": found.output}
    errors |= {f"{name}_next": error for name, error in found.states.items()}
    assert set(errors) == set(ERRORS)
    asked = [f"|{name} - M{name}| <= {share * errors[name]!r}" for name in names]
    known = [f"{name} in [{low!r},{high!r}]" for name, (low, high) in ranges.items()]
    return "\n".join([*lines, "{ " + " /\\ ".join(known), "  -> " + " /\\ ".join(asked) + " }", ""])


def proves(text: str) -> bool:
    """Whether Gappa proves it; if not, it says so and nothing else."""
    done = subprocess.run(["gappa"], input=text, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done
    return done.returncode == 0


CASES = [(precision, way) for precision in FORMATS for way in (1, -1)]


@pytest.mark.parametrize(  # in double precision it takes a second
    ("precision", "way"), slow_except(CASES, [case for case in CASES if case[0] == "single"], several=True)
)
def test_gappa_proves_what_rounding_adds_to_a_step(precision: str, way: int) -> None:
    need("gappa")
    assert proves(script(precision, way, 1.0, ERRORS))


@pytest.mark.parametrize(
    ("precision", "way", "name"),
    slow_except([(*case, name) for case in CASES for name in ERRORS], [("single", -1, "z_v_next")], several=True),
)
def test_gappa_does_not_prove_a_hundredth_of_it(precision: str, way: int, name: str) -> None:
    """Of each error alone: it searches for a second or more before it gives up."""
    need("gappa")
    assert not proves(script(precision, way, 0.01, [name]))
