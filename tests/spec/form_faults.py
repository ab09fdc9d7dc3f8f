"""Ways to spoil a topology, constraints or a Lagrangian: (what to replace, by what, words, nearest, line's words)."""

from __future__ import annotations

HEAD = """\
name: machine
coordinates: {x1: {velocity: v1, unit: m}, x2: {velocity: v2, unit: m}}
inputs: {w: {unit: N}}
parameters:
  m1: {value: 2, unit: kg}
  m2: {value: 3, unit: kg}
  J: {value: 1, unit: kg*m^2}
  k: {value: 9, unit: N/m}
  l: {value: 0.5, unit: m}
"""
OBSERVER = "observer: {kind: gcfo, gains: {K_F: 5}, sample_time: 0.001}\n"
TOPOLOGY = f"""\
{HEAD}topology:
  bodies:
    top: {{mass: m1, x: x1}}
    bottom: {{mass: m2, x: x2}}
force: [w, -k*x2]
friction:
  contacts:
    - {{name: between, bodies: [top, bottom], a: 1, unit: N}}
    - {{name: floor, bodies: [bottom], a: 1, unit: N}}
{OBSERVER}"""
CONSTRAINTS = f"""\
{HEAD}constraints:
  bodies:
    block: {{mass: m1, x: x1}}
    wheel: {{mass: m2, inertia: J, x: x2, y: l, angle: x2/l}}
  force:
    block: {{x: w}}
  equations:
    - wheel_y - l
    - wheel_x - l*wheel_angle
friction:
  contacts:
    - {{name: between, bodies: [block, wheel], a: 1, unit: N}}
    - {{name: axle, bodies: wheel, along: angle, a: 1, unit: N*m}}
{OBSERVER}"""
LAGRANGIAN = f"""\
{HEAD}lagrangian:
  kinetic: [m1*v1**2/2, m2*v2**2/2]
  potential: k*x2**2/2
force: [w, 0]
friction:
  distribution: [[1, 0], [-1, 1]]
  contacts:
    - {{name: between, a: 1, unit: N}}
    - {{name: floor, a: 1, unit: N}}
{OBSERVER}"""

BODIES = "    top: {mass: m1, x: x1}\n    bottom: {mass: m2, x: x2}\n"
WHEEL = "x: x1}\n    wheel: {mass: m2, inertia: J, x: x2, y: l, angle: x2/l}\n"
ALIKE = WHEEL.replace("x1}", "x1 + x2}").replace("x2,", "x1 + x2,").replace("x2/l", "(x1 + x2)/l")
Fault = tuple[str, str, str, str, str | None]
WITH_U = "friction:\n  distribution: "

FAULTS: dict[str, Fault] = {
    # how many ways
    "none": (TOPOLOGY, "topology:\n  bodies:\n    top: {mass: m1, x: x1}\n    bottom: {mass: m2, x: x2}\n", "",
             "SPEC003 `mass_matrix` `mass_matrix:` `force:` `topology:`", None),
    "two": (TOPOLOGY, "force: [", "mass_matrix: [[m1, 0], [0, m2]]\nforce: [",
            "SPEC005 `topology` `mass_matrix`", None),
    "two forms": (LAGRANGIAN, "force: [", "topology: {bodies: {a: {mass: m1, x: x1}}}\nforce: [",
                  "SPEC005 `lagrangian` `topology`", None),
    "no force": (TOPOLOGY, "force: [w, -k*x2]\n", "", "SPEC003 `force`", None),
    "no distribution": (LAGRANGIAN, "  distribution: [[1, 0], [-1, 1]]\n", "",
                        "SPEC003 `friction.distribution`", None),
    "bodies without any": (LAGRANGIAN, "between, a", "between, bodies: top, a", "SPEC004 `bodies`", None),
    # bodies
    "no body": (TOPOLOGY, "    top: {mass: m1, x: x1}\n    bottom: {mass: m2, x: x2}\n", "    {}\n", "SPEC003", None),
    "a body called ground": (TOPOLOGY, "    top: {", "    ground: {", "SPEC009 `ground`", None),
    "a misspelt key": (TOPOLOGY, "top: {mass", "top: {mas", "SPEC004 `mas`", "mass"),
    "no position": (TOPOLOGY, "mass: m1, x: x1", "mass: m1", "SPEC003", None),
    "no mass": (TOPOLOGY, "mass: m1, x: x1", "x: x1", "SPEC003", None),
    "inertia without angle": (TOPOLOGY, "mass: m1,", "mass: m1, inertia: J,", "SPEC003", None),
    "inertia for mass": (TOPOLOGY, "mass: m1", "mass: J", "SPEC014 `J` kg*m^2", None),
    "an angle in m": (TOPOLOGY, "mass: m1, x: x1", "inertia: J, angle: x1", "SPEC014 `x1`", None),
    "a mass that moves": (TOPOLOGY, "mass: m1", "mass: m1*x1/l", "SPEC008 `x1`", None),
    "a mass that is not there": (TOPOLOGY, "mass: m1", "mass: mm1", "SPEC008 `mm1`", "m1"),
    # topology
    "a coordinate that is not there": (TOPOLOGY, "x: x1}", "x: xx1}", "SPEC008 `xx1`", "x1"),
    "a function": (TOPOLOGY, "x: x1}", "x: x1 + x2}", "SPEC008 `constraints:`", None),
    "one coordinate twice": (TOPOLOGY, "x: x2}", "x: x1}", "SPEC009 `x1` topology.bodies.top.x", None),
    "one coordinate not at all": (TOPOLOGY, "    bottom: {mass: m2, x: x2}\n", "",
                                  "SPEC003 x2", None),
    # contacts
    "an unknown body": (TOPOLOGY, "[top, bottom]", "[top, botom]", "SPEC008 `botom`", "bottom"),
    "a body with itself": (TOPOLOGY, "[top, bottom]", "[top, top]", "SPEC015", None),
    "the ground alone": (TOPOLOGY, "[top, bottom]", "[ground]", "SPEC015", None),
    "three bodies": (TOPOLOGY, "[top, bottom]", "[top, bottom, ground]", "SPEC015", None),
    "no bodies": (TOPOLOGY, "bodies: [top, bottom], ", "", "SPEC003 `bodies`", None),
    "a direction that is not there": (TOPOLOGY, "[top, bottom]", "[top, bottom], along: y", "SPEC008", None),
    "which direction": (CONSTRAINTS, "along: angle, ", "",
                        "SPEC003 `along:`", None),
    "no shared direction": (CONSTRAINTS, "block: {mass: m1, x: x1}", "block: {mass: m1, z: x1}",
                            "SPEC008 `x`", None),
    "a torque along x": (TOPOLOGY, "between, bodies: [top, bottom], a: 1, unit: N}",
                         "between, bodies: [top, bottom], a: 1, unit: N*m}", "SPEC014", None),
    "a mixture of units": (CONSTRAINTS, "along: angle", "along: {x: 1, angle: J}", "SPEC014 `J`", None),
    "another U": (TOPOLOGY, "friction:\n", WITH_U + "[[1, 0], [1, 1]]\n",
                  "SPEC028 1 [1 1] [1 -1]", None),
    "another U in q": (CONSTRAINTS, "friction:\n", WITH_U + "[[1, 0], [-1, 1]]\n", "SPEC014 `1`", None),
    # constraints
    "a coordinate that moves nothing": (CONSTRAINTS, "x: x2, y: l, angle: x2/l", "x: x1, y: l, angle: x1/l",
                                        "SPEC018 x2", None),
    "coordinates that move alike": (CONSTRAINTS, WHEEL, ALIKE, "SPEC018 x2", None),
    "a force on no body": (CONSTRAINTS, "    block: {x: w}", "    blok: {x: w}", "SPEC008 `blok`", "block"),
    "a torque for a force": (CONSTRAINTS, "{x: w}", "{x: w*l}", "SPEC014 `w*l`", None),
    "a force of an unknown name": (CONSTRAINTS, "{x: w}", "{x: -k*wheel_z}", "SPEC008 `wheel_z`", "wheel_x"),
    "a contradiction": (CONSTRAINTS, "    - wheel_y - l\n", "    - wheel_y - 2*l\n", "SPEC018 1", None),
    "two equations against each other": (CONSTRAINTS, "    - wheel_x - l*wheel_angle\n", "    - wheel_y - 2*l\n",
                                         "SPEC018", None),
    "redundant": (CONSTRAINTS, "    - wheel_x - l*wheel_angle\n", "    - 2*(l - wheel_y)\n",
                  "SPEC018 2", None),
    "too few equations": (CONSTRAINTS, "    - wheel_x - l*wheel_angle\n", "",
                          "SPEC018 1 2 4 2", None),
    "an equation of parameters": (CONSTRAINTS, "    - wheel_y - l\n", "    - l - l/2\n",
                                  "SPEC011", None),
    "an equation of two units": (CONSTRAINTS, "    - wheel_y - l\n", "    - wheel_y - wheel_angle\n",
                                 "SPEC014 `wheel_angle`", None),
    "a name taken": (CONSTRAINTS, "  l: {", "  wheel_x: {value: 1, unit: m}\n  l: {", "SPEC009 `wheel_x`", None),
    # Lagrangian
    "an input in the energy": (LAGRANGIAN, "k*x2**2/2", "-w*x1", "SPEC008 `w`", None),
    "a velocity in the potential": (LAGRANGIAN, "k*x2**2/2", "m1*v1**2", "SPEC008 `v1`", None),
    "a force for an energy": (LAGRANGIAN, "k*x2**2/2", "k*x2", "SPEC014 `k*x2`", None),
    "not quadratic": (LAGRANGIAN, "m2*v2**2/2]", "m2*v2**4/v1**2]", "SPEC018 v1", None),
    "no inertia": (LAGRANGIAN, ", m2*v2**2/2]", "]", "SPEC018 v2", None),
    "negative inertia": (LAGRANGIAN, "m2*v2**2/2]", "-m2*v2**2/2]", "SPEC017 -3", None),
    "a torque on a length": (LAGRANGIAN, "force: [w, 0]", "force: [w*l, 0]", "SPEC014 `w*l`", None),
}  # fmt: skip
