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
    "missing name": ("name: slider\n", "", "key `name` is missing", None),
    "missing mass_matrix": ("mass_matrix:\n  - [mass, 0]\n  - [0, J]\n", "", "key `mass_matrix` is missing", None),
    "misspelt key": ("mass_matrix:", "mass_matrx:", "unknown key `mass_matrx`", "mass_matrix"),
    "misspelt inner key": ("sample_time: 0.001", "sampel_time: 0.001", "unknown key `sampel_time`", "sample_time"),
    "misspelt key of a coordinate": ("velocity: v,", "velocty: v,", "unknown key `velocty`", "velocity"),
    "a list where a mapping belongs": ("coordinates:\n", "coordinates: []\nrest:\n", "rest", None),
    "a mapping where text belongs": ("name: slider", "name: {a: b}", "a mapping; expected text", None),
    "a word where a number belongs": ("value: 2,", "value: two,", "expected a number", None),
    "true where a number belongs": ("value: 2,", "value: true,", "expected a number", None),
    "nothing where a number belongs": ("value: 2,", "value: null,", "expected a number", None),
    "a value for a mapping": ("{value: 30, unit: N/m}", "30", "a mapping with tolerance, unit, value", None),
    "velocity guessed": ("velocity: estimated", "velocity: guessed", "'measured' or 'estimated'", None),
    "velocity misspelt": ("velocity: estimated", "velocity: estimate", "'measured' or 'estimated'", "estimated"),
    "a number with another unit": (
        "0.001\n",
        "1 mm\n",
        "`1 mm`, in m; expected a number in s",
        None,
    ),
    "a number with its unit": ("value: 2,", "value: 2 kg,", "`2 kg`; expected a number alone, without its unit", None),
    # shapes
    "mass matrix not square": ("  - [0, J]", "  - [0]", "2 rows of 1/2; expected 2 by 2", None),
    "mass matrix too small": ("  - [0, J]\n", "", "1 rows of 2; expected 2 by 2", None),
    "force too long": ("  - w - k*x\n", "  - w - k*x\n  - 0\n", "3 entries; expected 2 entries", None),
    "U misses a column": ("[[1, 0], [0, 1]]", "[[1], [0]]", "2 by 2 (coordinates by contacts)", None),
    "U misses a row": ("[[1, 0], [0, 1]]", "[[1, 0]]", "1 rows of 2; expected 2 by 2 (coordinates by contacts)", None),
    # names
    "velocity named like its coordinate": (
        "velocity: v,",
        "velocity: x,",
        "name `x`, which slider.yaml:4: coordinates.x has already; expected a name for each",
        None,
    ),
    "parameter named like an input": (
        "  mass: {",
        "  w: {",
        "the name `w`, which slider.yaml:7: inputs.w has already; expected a name for each of the two",
        None,
    ),
    "two contacts of one name": ("name: hinge", "name: rail", "a second contact `rail`", None),
    "a word of C": ("  mass: {", "  double: {", "the name `double`, a reserved word", None),
    "a word of Python": ("  mass: {", "  lambda: {", "the name `lambda`, a reserved word", None),
    "a function's name": ("  mass: {", "  sin: {", "the name `sin`, a reserved word", None),
    "pi": ("  mass: {", "  pi: {", "the name `pi`, a reserved word", None),
    "a name with a dash": ("name: slider", "name: sli-der", "the name `sli-der`", None),
    "a name that climbs out": ("name: slider", "name: ../slider", "the name `../slider`", None),
    "a name with an underscore in front": ("name: slider", "name: _slider", "the name `_slider`", None),
    "a foreign letter": ("name: slider", "name: slidеr", "the name `slidеr`", None),
    "velocity in the mass matrix": ("[mass, 0]", "[mass*v/v, 0]", "unknown name `v`", None),
    "unknown name in force": ("w - k*x", "w - kk*x", "unknown name `kk`", "k"),
    # laws
    "unknown law": ("law: coulomb, a: 5", "law: coulom, a: 5", "unknown law `coulom`", "coulomb"),
    "a law by its common name": ("law: coulomb, a: 5", "law: stribeck, a: 5", "unknown law `stribeck`", "gaussian"),
    "level missing": ("coulomb, a: 5,", "coulomb,", "`a` (level) is missing", None),
    "level negative": ("a: 5", "a: -5", "level -5; expected zero or a positive number", None),
    "unknown law parameter": ("a: 5,", "a: 5, a2: 1,", "unknown key `a2`", "a"),
    "contact that acts nowhere": ("[[1, 0], [0, 1]]", "[[1, 0], [0, 0]]", "column 2 of zeros", None),
    # numbers
    "envelope upside down": ("x: [-1, 1]", "x: [1, -1]", "expected a range [low, high] with low < high", None),
    "envelope of three": ("x: [-1, 1]", "x: [-1, 0, 1]", "a list of 3; expected a range [low, high]", None),
    "envelope of one number": ("x: [-1, 1]", "x: 1", "`1`; expected a range [low, high]", None),
    "envelope of an unknown name": ("  x: [-1, 1]", "  xx: [-1, 1]", "unknown name `xx`", "x"),
    "a free gain of one number": ("K_F: 10", "K_F: {free: 10}", "K_F.free: `10`; expected a range [low, high]", None),
    "sample time zero": ("sample_time: 0.001", "sample_time: 0", "sample time 0; expected a positive time", None),
    "sample time infinite": ("sample_time: 0.001", "sample_time: .inf", "the number inf", None),
    "tolerance too large": ("value: 2, unit", "value: 2, tolerance: 2000%, unit", "tolerance 2000%", None),
    # the mass matrix as a whole
    "not symmetric": ("[mass, 0]", "[mass, 0.01*J/r]", "symmetric mass matrix", None),
    "not positive definite": ("value: 0.1,", "value: -0.1,", "smallest eigenvalue is -0.1 at every point", None),
    "singular somewhere": ("[mass, 0]", "[mass*(1 - 2*sin(q)), 0]", "smallest eigenvalue is -", None),
    "no real number somewhere": ("[mass, 0]", "[mass*sqrt(cos(2*q)), 0]", "no real number at q = ", None),
}

UNITS: dict[str, tuple[str, str, str]] = {
    "spring constant in N": ("unit: N/m}", "unit: N}", "with `k*x` in "),
    "a torque on a length": ("a: 5, unit: N}", "a: 5, unit: N*m}", "distribution `1` times the friction of contact 1"),
    "coordinate in mm": ("velocity: v, unit: m}", "velocity: v, unit: mm}", "unit mm; expected "),
    "coordinate in degrees": ("velocity: om, unit: rad}", "velocity: om, unit: deg}", "unit deg; expected "),
    "input in kN": ("w: {unit: N}", "w: {unit: kN}", "unit kN; expected "),
    "contact in kN": ("a: 5, unit: N}", "a: 5, unit: kN}", "unit kN; expected "),
    "mass as a length": ("value: 2, unit: kg", "value: 2, unit: m", "mass_matrix `mass` times the rate of v"),
    "exp of a length": ("w - k*x", "w*exp(x)", "exp of `x`, which is in m"),
    "sine of a velocity": ("w - k*x", "w*sin(v)", "sin of `v`, which is in m"),
    "a number added to a length": ("w - k*x", "w - k*(x + 1)", "`x` in m with `1` in a pure number"),
    "an unknown unit": ("unit: kg}", "unit: kilo}", "unit `kilo`"),
    "a unit misspelt": ("unit: kg}", "unit: kgg}", "(did you mean 'kg'?)"),
    "a torque of two meanings": ("unit: N*m}", "unit: N·m/kg·m}", "unit `N·m/kg·m`; expected parentheses around"),
    "a thousandth of an inch or an angle": ("unit: kg}", "unit: mil}", "unit `mil`, a length or an angle"),
    "a shaft speed without a revolution": ("unit: kg}", "unit: min⁻¹}", "unit `min⁻¹`, revolutions or radians in a"),
    "an ounce that is a mass": ("unit: kg}", "unit: oz-in/A}", "unit `oz-in/A`, a torque or a mass times a length"),
    "a kilogram that is a force": ("unit: kg}", "unit: kg-cm}", "unit `kg-cm`, a torque or a mass times a length"),
    "a revolution that is an enzyme": ("unit: kg}", "unit: mm/U}", "(did you mean 'rev'?)"),
    "a number in a unit": ("unit: kg}", "unit: 1000g}", "unit `1000g`; expected a unit such as"),
    "a unit that would take for ever": ("unit: kg}", "unit: kg*9^9^9^9}", "unit `kg*9^9^9^9`; expected a unit such as"),
    "a power that is too high": ("unit: kg}", "unit: ((kg^9)^9)^9}", "unit `((kg^9)^9)^9`; expected a unit such as"),
    "a unit with an offset": ("unit: kg}", "unit: degC}", "unit `degC`"),
    "an empty unit that should be one": ("value: 2, unit: kg", "value: 2", "mass_matrix `mass` times the rate of v"),
    "a unit that is code": ("unit: kg}", "unit: \"__import__('os')\"}", "unit `__import__('os')`"),
    "a square from 1 + 1": ("w - k*x", "w - k*x**(1 + 1)", "with `k*x**(1 + 1)` in "),
}
