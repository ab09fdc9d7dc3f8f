"""Specs to generate from: the shipped ones with other observers and effects, and a two-link arm."""

from __future__ import annotations

from pathlib import Path

SPECS = Path(__file__).parents[2] / "specs"

ARM = """name: arm
coordinates:
  q1: {velocity: p1, unit: rad}
  q2: {velocity: p2, unit: rad}
inputs:
  u1: {unit: N*m}
  u2: {unit: N*m}
parameters:
  A: {value: 0.35, unit: kg*m^2}
  B: {value: 0.12, unit: kg*m^2}
  C: {value: 0.09, unit: kg*m^2}
  G: {value: 2.3, unit: N*m}
  vs: {value: 0.1, unit: rad/s}
  H: {value: 0.6, unit: N*m}
mass_matrix:
  - [A + 2*C*cos(q2), B + C*cos(q2)]
  - [B + C*cos(q2), B]
force:
  - u1 + C*sin(q2)*(2*p1*p2 + p2**2) - G*cos(q1) - H/3*tanh(p1/vs)
  - u2 - C*sin(q2)*p1**2 - G/4*cos(q1 + q2)
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: shoulder, law: extended_coulomb, a1: 0.7, a2: 0.2, a3: 0.05, a4: 0.01, unit: N*m}
    - {name: elbow, law: coulomb, a: 0.3, unit: N*m}
effects: []
observer:
  kind: gcfo
  gains: {K_F: 3}
  sample_time: 0.001
envelope: {q1: [-1, 1], q2: [-1, 1], p1: [-2, 2], p2: [-2, 2], u1: [-3, 3], u2: [-3, 3]}
"""

GAINS = {
    "cfo": {"one_mass": "K_F: 10", "emps": "K_F: 4000", "belt_axis": "K_F: 250"},
    "gcfo": {
        "one_mass": "K_F: 10",
        "emps": "K_F: 4000",
        "belt_axis": "K_F: 250",
        "two_mass": "K_F: [500, 700]",
        "arm": "K_F: [[3, 0.2], [0.1, 2]]",
    },
    "to": {"one_mass": "K_1: 7, K_2: -10", "emps": "K_2: -4000", "belt_axis": "K_2: -250"},
    "gto": {
        "two_mass": "K_1: 3, K_2: [[-500, 20], [10, -700]]",
        "arm": "K_2: [[-3, -0.1], [-0.1, -2]]",
        "one_mass": "K_2: -10",
    },
    "mgto": {
        "two_mass": "K_1: [[1, 2], [3, 4]], K_2: [[-500, 20], [10, -700]]",
        "arm": "K_2: [-3, -2]",
        "emps": "K_2: -4000",
    },
}
_TIMES = {"two_mass": ", K_v: [10, 12]", "arm": ", K_v: [[40, 1], [2, 50]]"}
EFFECTS = {
    "one_mass": [
        "{kind: stribeck, on: rail, parameters: {delta: 7, v_s: 0.05}}",
        "{kind: coulomb_asymmetry, on: rail, parameters: {d: 3}}",
        "{kind: input_delay, on: w, parameters: {T: 0.0025}}",
        "{kind: saturation, on: w, parameters: {limit: 40}}",
        "{kind: friction_drift, on: rail, parameters: {delta: -9, T: 0.7}}",
        "{kind: position_dependent_friction, on: rail, parameters: {amplitude: 4, period: 0.03, phase: -1}}",
    ],
    "two_mass": [
        "{kind: quadratic_drag, on: x2, parameters: {c: 1.7}}",
        "{kind: viscous_asymmetry, on: ground, parameters: {d_b: 0.3}}",
        "{kind: viscous, on: between, parameters: {b: 2.5}}",
        "{kind: input_delay, on: w, parameters: {T: 0.003}}",
        "{kind: input_gain, on: w, parameters: {gain: 0.93}}",
        "{kind: actuator_lag, on: w, parameters: {tau: 0.004}}",
        "{kind: coupling, on: [x1, x2], parameters: {c: 1.3}}",
        "{kind: load_dependent_friction, on: ground, parameters: {mu: 0.06}}",
        "{kind: friction_drift, on: ground, parameters: {delta: 5, T: 3}}",
        "{kind: hardening_spring, on: x1, parameters: {k3: 70}}",
    ],
    "emps": [
        "{kind: cogging, on: x, parameters: {amplitude: 2.5, period: 0.01, phase: 0.4}}",
        "{kind: saturation, on: u, parameters: {limit: 3}}",
        "{kind: encoder_eccentricity, on: x, parameters: {amplitude: 0.0004, period: 0.02, phase: 0.9}}",
        "{kind: presliding, on: rail, parameters: {sigma: 8000}}",
        "{kind: compliance, on: x, parameters: {k: 2e6, c: 900, load_fraction: 0.6}}",
        "{kind: dead_zone, on: u, parameters: {width: 0.2}}",
        "{kind: input_gain, on: u, parameters: {gain: 1.07}}",
        "{kind: inertia_error, on: x, parameters: {delta: 1.3}}",
    ],
    "belt_axis": [
        "{kind: cogging, on: x, parameters: {amplitude: 3.4, period: 0.048, phase: 0.7}}",
        "{kind: stribeck, on: guide, parameters: {delta: 4, v_s: 0.02}}",
        "{kind: viscous_asymmetry, on: guide, parameters: {d_b: 3}}",
        "{kind: spring, on: x, parameters: {k: 20}}",
        "{kind: offset, on: x, parameters: {f0: -1.5}}",
        "{kind: drive_backdrive_friction, on: guide, parameters: {mu_drive: 0.05, mu_back: 0.11}}",
        "{kind: cogging_harmonics, on: x, parameters: {period: 0.3, sin_1: 1, cos_1: 2, sin_6: 0.5, cos_6: -0.7}}",
    ],
    "arm": [
        "{kind: stribeck, on: elbow, parameters: {delta: 0.2, v_s: 0.03}}",
        "{kind: quadratic_drag, on: q1, parameters: {c: 0.2}}",
        "{kind: viscous, on: elbow, parameters: {b: 0.11}}",
        "{kind: gravity_imbalance, on: q1, parameters: {G: 0.6, phase: 0.4}}",
        "{kind: input_delay, on: u1, parameters: {T: 0.0007}}",
        "{kind: input_delay, on: u2, parameters: {T: 0.002}}",
    ],
}


def spec_text(machine: str, kind: str = "", velocity: str = "estimated", effects: bool = False) -> str:
    """A machine's spec; with ``kind``, under another observer."""
    text = ARM if machine == "arm" else (SPECS / f"{machine}.yaml").read_text(encoding="utf-8")
    if kind:
        gains = GAINS[kind][machine] + (_TIMES.get(machine, ", K_v: 110") if velocity == "estimated" else "")
        head, _, tail = text.partition("\nobserver:")
        rest = tail[tail.index("\nenvelope:") :]
        section = f"{{kind: {kind}, velocity: {velocity}, gains: {{{gains}}}, sample_time: 0.001}}"
        text = f"{head}\nobserver: {section}{rest}"
    if effects:
        head, _, tail = text.partition("\neffects: []")
        text = head + "\neffects:\n  - " + "\n  - ".join(EFFECTS[machine]) + tail
    return text
