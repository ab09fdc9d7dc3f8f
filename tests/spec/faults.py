"""One good spec, and the ways to spoil it: (what to replace, by what, words of the message, nearest right thing)."""

from __future__ import annotations

GOOD = """\
name: slider
source: a test
coordinates:
  x: {velocity: v, unit: m}
  q: {velocity: om, unit: rad}
inputs:
  w: {unit: N}
parameters:
  mass: {value: 2, unit: kg}
  J: {value: 0.1, unit: kg*m^2}
  k: {value: 30, unit: N/m}
mass_matrix:
  - [mass, 0]
  - [0, J]
force:
  - w - k*x
  - -J*om/t0
friction:
  distribution: [[1, 0], [0, 1]]
  contacts:
    - {name: rail, law: coulomb, a: 5, unit: N}
    - {name: hinge, law: coulomb, a: 1, unit: N*m}
observer:
  kind: gcfo
  velocity: estimated
  gains: {K_F: 10, K_v: 100}
  sample_time: 0.001
envelope:
  x: [-1, 1]
""".replace("t0", "tau").replace("  k: {", "  tau: {value: 3, unit: s}\n  r: {value: 1, unit: m}\n  k: {")

FAULTS: dict[str, tuple[str, str, str, str | None]] = {
    # keys
    "missing name": ("name: slider\n", "", "SPEC003 `name`", None),
    "missing mass_matrix": ("mass_matrix:\n  - [mass, 0]\n  - [0, J]\n", "", "SPEC003 `mass_matrix`", None),
    "misspelt key": ("mass_matrix:", "mass_matrx:", "SPEC004 `mass_matrx`", "mass_matrix"),
    "misspelt inner key": ("sample_time: 0.001", "sampel_time: 0.001", "SPEC004 `sampel_time`", "sample_time"),
    "misspelt key of a coordinate": ("velocity: v,", "velocty: v,", "SPEC004 `velocty`", "velocity"),
    "a list where a mapping belongs": ("coordinates:\n", "coordinates: []\nrest:\n", "SPEC004", None),
    "a mapping where text belongs": ("name: slider", "name: {a: b}", "SPEC006", None),
    "a matrix without brackets": (
        "mass_matrix:\n  - [mass, 0]\n  - [0, J]\n",
        "mass_matrix: mass\n",
        "SPEC006 `mass`",
        None,
    ),
    "a word where a list of mappings belongs": (
        "observer:\n",
        "effects: viscous\nobserver:\n",
        "SPEC006 `viscous` mappings kind, on, parameters",
        None,
    ),
    "a row without brackets": ("  - [mass, 0]\n", "  - mass\n", "SPEC006 `mass`", None),
    "a word where a number belongs": ("value: 2,", "value: two,", "SPEC006", None),
    "true where a number belongs": ("value: 2,", "value: true,", "SPEC006", None),
    "nothing where a number belongs": ("value: 2,", "value: null,", "SPEC006", None),
    "a value for a mapping": ("{value: 30, unit: N/m}", "30", "SPEC006", None),
    "velocity guessed": ("velocity: estimated", "velocity: guessed", "SPEC006 'measured' 'estimated'", None),
    "velocity misspelt": ("velocity: estimated", "velocity: estimate", "SPEC006 'measured' 'estimated'", "estimated"),
    "a number with another unit": (
        "0.001\n",
        "1 mm\n",
        "SPEC014 `1 mm`",
        None,
    ),
    "a number with its unit": ("value: 2,", "value: 2 kg,", "SPEC006 `2 kg`", None),
    # shapes
    "mass matrix not square": ("  - [0, J]", "  - [0]", "SPEC015 2 row 1 entry 2", None),
    "mass matrix too small": ("  - [0, J]\n", "", "SPEC015 1 2 2 2", None),
    "force too long": ("  - w - k*x\n", "  - w - k*x\n  - 0\n", "SPEC015 3 2", None),
    "U misses a column": ("[[1, 0], [0, 1]]", "[[1], [0]]", "SPEC015 2 2", None),
    "U misses a row": ("[[1, 0], [0, 1]]", "[[1, 0]]", "SPEC015 1 2 2 2", None),
    # names
    "velocity named like its coordinate": (
        "velocity: v,",
        "velocity: x,",
        "SPEC009 `x` slider.yaml:4 coordinates.x",
        None,
    ),
    "parameter named like an input": (
        "  mass: {",
        "  w: {",
        "SPEC009 `w` slider.yaml:7 inputs.w",
        None,
    ),
    "two contacts of one name": ("name: hinge", "name: rail", "SPEC009 `rail`", None),
    "a word of C": ("  mass: {", "  double: {", "SPEC009 `double`", None),
    "a word of Python": ("  mass: {", "  lambda: {", "SPEC009 `lambda`", None),
    "a function's name": ("  mass: {", "  sin: {", "SPEC009 `sin`", None),
    "pi": ("  mass: {", "  pi: {", "SPEC009 `pi`", None),
    "a name with a dash": ("name: slider", "name: sli-der", "SPEC009 `sli-der`", None),
    "a name that climbs out": ("name: slider", "name: ../slider", "SPEC009 `../slider`", None),
    "a name with an underscore in front": ("name: slider", "name: _slider", "SPEC009 `_slider`", None),
    "a foreign letter": ("name: slider", "name: slidеr", "SPEC009 `slidеr`", None),
    "velocity in the mass matrix": ("[mass, 0]", "[mass*v/v, 0]", "SPEC008 `v`", None),
    "unknown name in force": ("w - k*x", "w - kk*x", "SPEC008 `kk`", "k"),
    # laws
    "unknown law": ("law: coulomb, a: 5", "law: coulom, a: 5", "SPEC008 `coulom`", "coulomb"),
    "a law by its common name": ("law: coulomb, a: 5", "law: stribeck, a: 5", "SPEC008 `stribeck`", "gaussian"),
    "contact's unit missing": ("coulomb, a: 5, unit: N}", "coulomb, a: 5}", "SPEC003 `unit:` N*m", None),
    "level missing": ("coulomb, a: 5,", "coulomb,", "SPEC003 `a`", None),
    "level negative": ("a: 5", "a: -5", "SPEC007 -5", None),
    "viscous friction in a law": ("law: coulomb, a: 5", "law: coulomb+viscous, a: 5", "SPEC008 viscous effects:", None),
    "viscous friction as a parameter": ("a: 5,", "a: 5, viscous: 1,", "SPEC004 `viscous` effects:", None),
    "unknown law parameter": ("a: 5,", "a: 5, a2: 1,", "SPEC004 `a2`", "a"),
    "contact that acts nowhere": ("[[1, 0], [0, 1]]", "[[1, 0], [0, 0]]", "SPEC019 2", None),
    # numbers
    "envelope upside down": ("x: [-1, 1]", "x: [1, -1]", "SPEC007 [low high]", None),
    "envelope of three": ("x: [-1, 1]", "x: [-1, 0, 1]", "SPEC006 3 [low high]", None),
    "envelope of one number": ("x: [-1, 1]", "x: 1", "SPEC006 `1` [low high]", None),
    "envelope of an unknown name": ("  x: [-1, 1]", "  xx: [-1, 1]", "SPEC008 `xx`", "x"),
    "a free gain of one number": ("K_F: 10", "K_F: {free: 10}", "SPEC006 K_F.free `10` [low high]", None),
    "sample time zero": ("sample_time: 0.001", "sample_time: 0", "SPEC007 0", None),
    "sample time infinite": ("sample_time: 0.001", "sample_time: .inf", "SPEC007", None),
    "tolerance too large": ("value: 2, unit", "value: 2, tolerance: 2000%, unit", "SPEC007 2000%", None),
    # the mass matrix as a whole
    "not symmetric": ("[mass, 0]", "[mass, 0.01*J/r]", "SPEC017", None),
    "negative inertia": ("value: 0.1,", "value: -0.1,", "SPEC007 -0.1", None),
    "singular somewhere": ("[mass, 0]", "[mass*(1 - 2*sin(q)), 0]", "SPEC017 [0][0] mass", None),
    "no real number somewhere": ("[mass, 0]", "[mass*sqrt(cos(2*q)), 0]", "SPEC012", None),
}

UNITS: dict[str, tuple[str, str, str]] = {
    "spring constant in N": ("unit: N/m}", "unit: N}", "SPEC014 `k*x`"),
    "a torque on a length": ("a: 5, unit: N}", "a: 5, unit: N*m}", "SPEC014 `1` 1"),
    "coordinate in mm": ("velocity: v, unit: m}", "velocity: v, unit: mm}", "SPEC014"),
    "coordinate in degrees": ("velocity: om, unit: rad}", "velocity: om, unit: deg}", "SPEC014"),
    "input in kN": ("w: {unit: N}", "w: {unit: kN}", "SPEC014"),
    "contact in kN": ("a: 5, unit: N}", "a: 0.03, unit: kN}", "SPEC014 `a: 0.03 kN`"),
    "the units of the names of a sum are told": ("unit: N/m}", "unit: N}", "SPEC014 k in N, x in m"),
    "mass as a length": ("value: 2, unit: kg", "value: 2, unit: m", "SPEC014 mass_matrix `mass`"),
    "exp of a length": ("w - k*x", "w*exp(x)", "SPEC014 `x`"),
    "sine of a velocity": ("w - k*x", "w*sin(v)", "SPEC014 `v`"),
    "a number added to a length": ("w - k*x", "w - k*(x + 1)", "SPEC014 `x` `1`"),
    "an unknown unit": ("unit: kg}", "unit: kilo}", "SPEC013 `kilo`"),
    "a unit misspelt": ("unit: kg}", "unit: kgg}", "SPEC013 'kg'?)"),
    "a torque of two meanings": ("unit: N*m}", "unit: N·m/kg·m}", "SPEC013 `N·m/kg·m`"),
    "a thousandth of an inch or an angle": ("unit: kg}", "unit: mil}", "SPEC013 `mil`"),
    "a shaft speed without a revolution": ("unit: kg}", "unit: min⁻¹}", "SPEC013 `min⁻¹`"),
    "an ounce that is a mass": ("unit: kg}", "unit: oz-in/A}", "SPEC013 `oz-in/A`"),
    "a kilogram that is a force": ("unit: kg}", "unit: kg-cm}", "SPEC013 `kg-cm`"),
    "a degree or a gon": ("unit: kg}", "unit: Grad}", "SPEC013 `Grad` 'deg'?)"),
    "a degree or a gon per second": ("unit: kg}", "unit: grad/s}", "SPEC013 `grad/s` 'deg/s'?)"),
    "a thousandth or a million radians": ("unit: kg}", "unit: Mrad}", "SPEC013 `Mrad` 'mrad'?)"),
    "a revolution that is an enzyme": ("unit: kg}", "unit: mm/U}", "SPEC013 'mm/rev'?)"),
    "a number in a unit": ("unit: kg}", "unit: 1000g}", "SPEC013 `1000g`"),
    "a unit that would take for ever": ("unit: kg}", "unit: kg*9^9^9^9}", "SPEC013 `kg*9^9^9^9`"),
    "a power that is too high": ("unit: kg}", "unit: ((kg^9)^9)^9}", "SPEC013 `((kg^9)^9)^9`"),
    "a unit with an offset": ("unit: kg}", "unit: degC}", "SPEC013 `degC`"),
    "an empty unit that should be one": ("value: 2, unit: kg", "value: 2", "SPEC014 mass_matrix `mass`"),
    "a unit that is code": ("unit: kg}", "unit: \"__import__('os')\"}", "SPEC013 `__import__('os')`"),
    "a square from 1 + 1": ("w - k*x", "w - k*x**(1 + 1)", "SPEC014 `k*x**(1 1)`"),
}
