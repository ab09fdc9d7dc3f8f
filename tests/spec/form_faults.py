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
OWN = BODIES.replace("x: x", "x: p")
WHEEL = "x: x1}\n    wheel: {mass: m2, inertia: J, x: x2, y: l, angle: x2/l}\n"
ALIKE = WHEEL.replace("x1}", "x1 + x2}").replace("x2,", "x1 + x2,").replace("x2/l", "(x1 + x2)/l")
Fault = tuple[str, str, str, str, str | None]
WITH_U = "friction:\n  distribution: "

FAULTS: dict[str, Fault] = {
    # how many ways
    "none": (TOPOLOGY, "topology:\n  bodies:\n    top: {mass: m1, x: x1}\n    bottom: {mass: m2, x: x2}\n", "",
             "key `mass_matrix` is missing; expected `mass_matrix:` with `force:`, or one of `topology:`", None),
    "two": (TOPOLOGY, "force: [", "mass_matrix: [[m1, 0], [0, m2]]\nforce: [",
            "both `topology` and `mass_matrix`", None),
    "two forms": (LAGRANGIAN, "force: [", "topology: {bodies: {a: {mass: m1, x: x1}}}\nforce: [",
                  "both `lagrangian` and `topology`", None),
    "no force": (TOPOLOGY, "force: [w, -k*x2]\n", "", "key `force` is missing", None),
    "no distribution": (LAGRANGIAN, "  distribution: [[1, 0], [-1, 1]]\n", "",
                        "key `friction.distribution` is missing", None),
    "bodies without any": (LAGRANGIAN, "between, a", "between, bodies: top, a", "`bodies` of contact between", None),
    # bodies
    "no body": (TOPOLOGY, "    top: {mass: m1, x: x1}\n    bottom: {mass: m2, x: x2}\n", "    {}\n", "no body", None),
    "a body called ground": (TOPOLOGY, "    top: {", "    ground: {", "the body `ground`", None),
    "a misspelt key": (TOPOLOGY, "top: {mass", "top: {mas", "unknown key `mas`", "mass"),
    "no position": (TOPOLOGY, "mass: m1, x: x1", "mass: m1", "body top without a position", None),
    "no mass": (TOPOLOGY, "mass: m1, x: x1", "x: x1", "body top with x, y or z but no mass", None),
    "inertia without angle": (TOPOLOGY, "mass: m1,", "mass: m1, inertia: J,", "inertia of top without an angle", None),
    "inertia for mass": (TOPOLOGY, "mass: m1", "mass: J", "mass of top `J` in kg*m^2; expected kg", None),
    "an angle in m": (TOPOLOGY, "mass: m1, x: x1", "inertia: J, angle: x1", "position angle of top `x1` in m", None),
    "a mass that moves": (TOPOLOGY, "mass: m1", "mass: m1*x1/l", "unknown name `x1`", None),
    "a mass that is not there": (TOPOLOGY, "mass: m1", "mass: mm1", "unknown name `mm1`", "m1"),
    # topology
    "a coordinate that is not there": (TOPOLOGY, "x: x1}", "x: xx1}", "unknown name `xx1`", "x1"),
    "a function": (TOPOLOGY, "x: x1}", "x: x1 + x2}", "functions belong to `constraints:`", None),
    "one coordinate twice": (TOPOLOGY, "x: x2}", "x: x1}", "`x1`, which is topology.bodies.top.x too", None),
    "one coordinate not at all": (TOPOLOGY, "    bottom: {mass: m2, x: x2}\n", "",
                                  "coordinate x2, which is no body's", None),
    "a transform of three": (TOPOLOGY, "force: [w", "  transform: [[1, 0, 1], [0, 1, 1]]\nforce: [w",
                             "`x1` as a position before the transform", None),
    "a transform without inverse": (TOPOLOGY, BODIES, OWN + "  transform: [[1, 2], [m1, 2*m1]]\n",
                                    "transform `m1` in kg", None),
    "a transform of rank one": (TOPOLOGY, BODIES, OWN + "  transform: [[1, m2/m1], [m1/m2, 1]]\n",
                                "a transform of determinant 0", None),
    "a transform not square": (TOPOLOGY, BODIES, OWN + "  transform: [[1, 2]]\n", "1 rows of 2; expected 2 by 2", None),
    "a transform of too few": (TOPOLOGY, BODIES, "    top: {mass: m1, x: p1}\n  transform: [[1, 2], [3, 4]]\n",
                               "1 positions of bodies for 2 coordinates", None),
    # contacts
    "an unknown body": (TOPOLOGY, "[top, bottom]", "[top, botom]", "unknown body `botom`", "bottom"),
    "a body with itself": (TOPOLOGY, "[top, bottom]", "[top, top]", "contact between between top and top", None),
    "the ground alone": (TOPOLOGY, "[top, bottom]", "[ground]", "expected two bodies, or one and ground", None),
    "three bodies": (TOPOLOGY, "[top, bottom]", "[top, bottom, ground]", "two bodies, or one and ground", None),
    "no bodies": (TOPOLOGY, "bodies: [top, bottom], ", "", "contact between without `bodies`", None),
    "a direction that is not there": (TOPOLOGY, "[top, bottom]", "[top, bottom], along: y", "unknown direction", None),
    "which direction": (CONSTRAINTS, "along: angle, ", "",
                        "along x or y or angle; expected `along:` with one of", None),
    "no shared direction": (CONSTRAINTS, "block: {mass: m1, x: x1}", "block: {mass: m1, z: x1}",
                            "unknown direction of block `x`", None),
    "a torque along x": (TOPOLOGY, "between, bodies: [top, bottom], a: 1, unit: N}",
                         "between, bodies: [top, bottom], a: 1, unit: N*m}", "friction in N*m; expected N", None),
    "a mixture of units": (CONSTRAINTS, "along: angle", "along: {x: 1, angle: J}", "`J` times angle in", None),
    "another U": (TOPOLOGY, "friction:\n", WITH_U + "[[1, 0], [1, 1]]\n",
                  "U inconsistent with topology: column 1 [1, 1] of contact between; expected [1, -1]", None),
    "another U in q": (CONSTRAINTS, "friction:\n", WITH_U + "[[1, 0], [-1, 1]]\n", "distribution `1` times", None),
    # constraints
    "a coordinate that moves nothing": (CONSTRAINTS, "x: x2, y: l, angle: x2/l", "x: x1, y: l, angle: x1/l",
                                        "coordinate x2 moves no body", None),
    "coordinates that move alike": (CONSTRAINTS, WHEEL, ALIKE, "coordinate x2 moves the bodies only as the", None),
    "a force on no body": (CONSTRAINTS, "    block: {x: w}", "    blok: {x: w}", "unknown body `blok`", "block"),
    "a torque for a force": (CONSTRAINTS, "{x: w}", "{x: w*l}", "force on block `w*l` in N*m; expected N", None),
    "a force of an unknown name": (CONSTRAINTS, "{x: w}", "{x: -k*wheel_z}", "unknown name `wheel_z`", "wheel_x"),
    "a contradiction": (CONSTRAINTS, "    - wheel_y - l\n", "    - wheel_y - 2*l\n", "contradictory: equation 1", None),
    "two equations against each other": (CONSTRAINTS, "    - wheel_x - l*wheel_angle\n", "    - wheel_y - 2*l\n",
                                         "as the equations before it and the positions", None),
    "redundant": (CONSTRAINTS, "    - wheel_x - l*wheel_angle\n", "    - 2*(l - wheel_y)\n",
                  "redundant: equation 2", None),
    "too few equations": (CONSTRAINTS, "    - wheel_x - l*wheel_angle\n", "",
                          "1 of 2 equations for 4 positions and 2 coordinates", None),
    "an equation of parameters": (CONSTRAINTS, "    - wheel_y - l\n", "    - l - l/2\n",
                                  "which holds no position", None),
    "an equation of two units": (CONSTRAINTS, "    - wheel_y - l\n", "    - wheel_y - wheel_angle\n",
                                 "`wheel_angle` in", None),
    "a name taken": (CONSTRAINTS, "  l: {", "  wheel_x: {value: 1, unit: m}\n  l: {", "the name `wheel_x`", None),
    # Lagrangian
    "an input in the energy": (LAGRANGIAN, "k*x2**2/2", "-w*x1", "unknown name `w`", None),
    "a velocity in the potential": (LAGRANGIAN, "k*x2**2/2", "m1*v1**2", "unknown name `v1`", None),
    "a force for an energy": (LAGRANGIAN, "k*x2**2/2", "k*x2", "potential energy `k*x2` in N; expected N*m", None),
    "not quadratic": (LAGRANGIAN, "m2*v2**2/2]", "m2*v2**4/v1**2]", "whose second derivative holds v1", None),
    "no inertia": (LAGRANGIAN, ", m2*v2**2/2]", "]", "no kinetic energy in v2", None),
    "negative inertia": (LAGRANGIAN, "m2*v2**2/2]", "-m2*v2**2/2]", "smallest eigenvalue is -3", None),
    "a torque on a length": (LAGRANGIAN, "force: [w, 0]", "force: [w*l, 0]", "force `w*l` in N*m; expected N", None),
}  # fmt: skip
