"""A ball screw with a counterweight: π in the equations, and the small difference of two weights, in a certificate.

A lead of 10 mm in m/rad is written as the parameter `r` in mm/rev, or as `lead/(2*pi)`: the same machine twice.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import stiction
from codegen.checker import verify
from tests.slow_cases import slow_except

SPEC = """
name: lift
coordinates: {{z: {{velocity: vz, unit: m}}}}
inputs: {{T: {{unit: N*m}}}}
parameters:
  m_c: {{value: 12, unit: kg}}
  m_w: {{value: {counterweight}, unit: kg}}
  J: {{value: 1.4, unit: kg*cm^2}}
  {lead}
  g: {{value: 9.81, unit: m/s^2}}
mass_matrix: [["m_c + m_w + {inertia}"]]
force: ["{drive} - {weight}"]
friction:
  distribution: [[1]]
  contacts: [{{name: guide, law: coulomb, a: 40, unit: N}}]
observer: {{kind: gcfo, velocity: estimated, gains: {{K_F: 600, K_v: 200}}, sample_time: 1 ms}}
envelope: {{vz: [-0.3, 0.3], vz_dot: [-2, 2], z_noise: [-0.5 um, 0.5 um]}}
"""
FORMS = {
    "radians": {"lead": "r: {value: 10, unit: mm/rev}", "inertia": "J/r**2", "drive": "T/r"},
    "pi": {
        "lead": "lead: {value: 10, unit: mm}",
        "inertia": "J*(2*pi/lead)**2",
        "drive": "2*pi/lead*T",
    },
}


def lift(folder: Path, form: str, weight: str = "(m_c - m_w)*g", counterweight: str = "11.2") -> Any:
    path = folder / f"{form}.yaml"
    path.write_text(SPEC.format(**FORMS[form], weight=weight, counterweight=counterweight))
    return stiction.load(path)


def test_pi_in_the_equations_is_a_number_like_any_other(tmp_path: Path) -> None:
    """Rate and bound are those of the same machine with its lead in mm/rev, to the rounding of a double."""
    by_pi, by_radians = (lift(tmp_path, form, "0").certify() for form in ("pi", "radians"))
    assert by_pi.certificate is not None
    assert by_pi.certificate.content["variables"] == {}
    assert by_pi.certificate.decay_rate == pytest.approx(by_radians.certificate.decay_rate, rel=1e-3)
    (bound,), (other,) = by_pi.bounds, by_radians.bounds
    assert bound.steady == pytest.approx(other.steady, rel=1e-6)


@pytest.mark.parametrize("form", [*FORMS])
@pytest.mark.parametrize("counterweight", slow_except(["11.2", "11.99", "12"], ["11.2", "12"]))  # and in between
def test_the_c_of_a_balanced_axis_is_proved(tmp_path: Path, form: str, counterweight: str) -> None:
    """12 kg less 11.2 kg is 0.8000000000000007 kg in doubles: the rounding of the weights, not another value.

    Of 12 kg less 12 kg nothing is left.
    """
    made = lift(tmp_path, form, counterweight=counterweight).generate(tmp_path / "out")
    assert {"proof.json", "ellipsoid.json"} <= made.files.keys()
    stiction.verify(tmp_path / "out")


def test_another_weight_in_the_header_is_refused(tmp_path: Path) -> None:
    """A tenth digit of g (m_c - m_w) is not rounding."""
    proof, header = (lift(tmp_path, "radians").generate(tmp_path / "out").files[x] for x in ("proof.json", "lift.h"))
    source = (tmp_path / "out" / "lift.c").read_bytes()
    assert header.count("7.848000000000007,") == 1
    wrong = header.replace("7.848000000000007,", "7.848000001,").encode()
    with pytest.raises(verify.Refused, match=r"prepare gives others: parameters\.\w+ of the header"):
        verify.check(proof, sources={"lift.c": source, "lift.h": wrong})
