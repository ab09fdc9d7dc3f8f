"""What the preflight says of motions whose answers are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slider_log import LEVEL, MASS, TEXT, rows, write_csv

from codegen.logs import Finding, preflight, read_log
from codegen.spec.reader import parse_spec


def findings(path: Path, columns: dict, text: str = TEXT, **options) -> dict[str, Finding]:
    spec = parse_spec(text, Path("slider.yaml"))
    log = read_log(write_csv(path / "a.csv", columns, fmt="%.12g"), spec, **options)
    result = preflight(log, spec)
    assert all(f.words.endswith((".", ")", "?")) and f.topic for f in result)
    assert all(np.isfinite(v) for f in result for v in f.figures.values())
    return {f.topic: f for f in result}


def findings_of(path: Path, columns: dict, about: Path) -> list[Finding]:
    spec = parse_spec(TEXT, Path("slider.yaml"))
    return list(preflight(read_log(write_csv(path / "a.csv", columns, fmt="%.12g"), spec, description=about), spec))


def test_a_good_log(tmp_path):
    found = findings(tmp_path, rows(20, 250))
    assert {f.severity for f in found.values()} == {"info"}
    motion = found["motion of x"].figures
    assert motion["reversals"] == 20
    assert motion["velocity_max"] == pytest.approx(0.1 * np.pi, rel=1e-3)
    assert motion["position_max"] == pytest.approx(0.1, rel=1e-6)
    assert found["sample rate"].figures["rate_hz"] == pytest.approx(250)
    assert found["duration"].figures["samples"] == 5000
    assert found["sign and scale of w"].figures["factor"] == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3])
def test_reversals_are_not_made_of_noise(tmp_path, noise):
    made = rows(20, 250)
    made["x"] = made["x"] + noise * np.random.default_rng(0).normal(size=len(made["x"]))
    assert findings(tmp_path, made)["motion of x"].figures["reversals"] == 20


def test_standstill(tmp_path):
    t = np.arange(5000) / 250
    made = {"t": t, "x": np.where(t < 15, 0.2, 0.2 + 0.1 * (1 - np.cos(np.pi * (t - 15)))), "w": np.sin(t)}
    motion = findings(tmp_path, made)["motion of x"]
    assert motion.figures["standstill"] == pytest.approx(0.75, abs=0.02)
    assert motion.figures["reversals"] == 4


def test_no_motion_and_one_way(tmp_path):
    made = rows(10)
    still = findings(tmp_path, {**made, "x": np.full(5000, 0.3)})
    assert still["motion of x"].severity == "problem" and "does not move" in still["motion of x"].words
    way = findings(tmp_path, {"t": made["t"], "x": 0.1 * made["t"] + 0.001 * np.sin(made["t"]), "w": made["w"]})
    assert "one direction only" in way["motion of x"].words and way["motion of x"].severity == "warning"


def test_encoder(tmp_path):
    made = rows(10)
    made["x"] = np.round(made["x"] / 3e-4) * 3e-4
    found = findings(tmp_path, made)
    assert found["resolution of x"].figures["seen"] == pytest.approx(3e-4, rel=1e-6)
    about = tmp_path / "about.yaml"
    about.write_text("encoder_step: 1e-4\n")
    other = findings(tmp_path, made, description=about)["resolution of x"]
    assert other.severity == "warning" and "0.0003 m, while the description says 0.0001" in other.words
    made["x"] = rows(10)["x"] + 1e-5 * np.random.default_rng(3).standard_normal(5000)  # it shows no step
    for said, doubted in (("2e-3", True), ("1e-6", False)):
        about.write_text(f"encoder_step: {said}\n")
        words = findings(tmp_path, made, description=about)["resolution of x"].words
        assert ("half of the described step" in words and "is `encoder_step` in m" in words) is doubted
    made["x"] = np.round(made["x"] / 2e-2) * 2e-2
    assert "coarse" in findings(tmp_path, made)["resolution of x"].words


def test_inputs(tmp_path):
    made = rows(20, 250)
    assert "zero throughout" in findings(tmp_path, {**made, "w": 0 * made["w"]})["input w"].words
    assert "constant at 2 N" in findings(tmp_path, {**made, "w": 0 * made["w"] + 2})["input w"].words
    wave = np.sin(7 * made["t"])
    limited = findings(tmp_path, {**made, "w": np.clip(wave, -2, 0.8)})["input w"]
    assert limited.severity == "warning"
    assert limited.figures["share_at_max"] == pytest.approx(np.mean(wave >= 0.8))
    assert "two levels" in findings(tmp_path, {**made, "w": np.sign(wave)})["input w"].words


def test_sign_and_scale(tmp_path):
    made = rows(20, 250)
    flipped = findings(tmp_path, {**made, "w": -made["w"]})["sign and scale of w"]
    assert flipped.severity == "problem" and "sign of input w seems flipped" in flipped.words
    for factor in (0.1, 10.0):
        off = findings(tmp_path, {**made, "w": made["w"] / factor})["sign and scale of w"]
        assert off.severity == "problem" and off.figures["factor"] == pytest.approx(factor, rel=0.03)
        assert "off by a factor of" in off.words
    near = findings(tmp_path, {**made, "w": made["w"] * 1.5})["sign and scale of w"]
    assert near.severity == "info" and near.figures["factor"] == pytest.approx(1 / 1.5, rel=0.03)


def test_the_line_that_mends_an_input_mends_it(tmp_path):
    """The line between backquotes is written into meta.yaml, and the log then fits; 30 is no power of 1000."""
    made, about = rows(20, 250), tmp_path / "about.yaml"

    def told(log: dict, meta: str = "scale: {w: 1}") -> Finding:
        about.write_text(f"{meta}\n")
        return findings(tmp_path, log, description=about)["sign and scale of w"]

    for factor, line in ((1000, "units: {w: mN}"), (1e-3, "units: {w: kN}"), (-1, "scale: {w: -1}")):
        log = {**made, "w": made["w"] * factor}
        found = told(log)
        assert found.severity == "problem" and f"(`{line}` " in found.words
        assert (f"Is w in {line[-3:-1]}?" in found.words) is (factor > 0)
        assert told(log, line).severity == "info"
    assert "`scale: {w: 2}`" in told(made, "scale: {w: -2}").words
    assert "Is w in N? (`units: {w: N}`" in told(made, "units: {w: mN}").words
    assert "`units:" not in told({**made, "w": 30 * made["w"]}).words


def test_a_limit_is_not_taken_for_a_scale(tmp_path):
    made = rows(20, 250)
    command = np.where(np.abs(made["w"]) > 3.5, 10 * made["w"], made["w"])  # what a limit of 3.5 N keeps from acting
    told = findings(tmp_path, {**made, "w": command})["sign and scale of w"]
    assert told.severity == "warning" and told.figures["factor"] < 1 / 3 < told.figures["factor_at_small_input"]


def test_undriven_coordinate(tmp_path):
    t = np.arange(5000) / 250
    text = TEXT.replace("force: [w]", "force: [-k*x]").replace("inputs: {w: {unit: N}}\n", "")
    text = text.replace("parameters:\n", "parameters:\n  k: {value: STIFF, unit: N/m}\n").replace(
        f"a: {LEVEL}", "a: 0.01"
    )
    made = {"t": t, "x": 0.1 * np.sin(4 * t)}  # a mass on a spring of 16 m
    right = findings(tmp_path, made, text.replace("STIFF", str(16 * MASS)))["force on x"]
    assert right.severity == "info" and right.figures["factor"] == pytest.approx(1, abs=0.02)
    assert "sign of gravity and springs" in findings(tmp_path, made, text.replace("STIFF", str(-16 * MASS)))
    assert "factor of 9.98" in findings(tmp_path, made, text.replace("STIFF", str(1.6 * MASS)))["force on x"].words


def test_without_contacts(tmp_path):
    text = TEXT[: TEXT.index("friction:")] + "friction: {distribution: [[]], contacts: []}\n"
    made = rows(20, 250)
    made["w"] = made["w"] - LEVEL * np.sign(made["v"])
    assert findings(tmp_path, made, text)["sign and scale of w"].figures["factor"] == pytest.approx(1, abs=0.02)


def test_envelope(tmp_path):
    found = findings(tmp_path, rows(20, 250), TEXT + "envelope: {x: [-0.05, 0.05], v: [-1, 1], w: [-100, 100]}\n")
    assert found["envelope of x"].severity == "warning"
    assert found["envelope of x"].figures["share"] == pytest.approx(2 / 3, abs=0.01)  # |sin| > 1/2
    assert "envelope of v" not in found and "envelope of w" not in found


def test_gaps_jumps_repairs_and_short_logs(tmp_path):
    made = rows(20)
    keep = np.r_[0:3000, 4000:10000]
    found = findings(tmp_path, {k: v[keep] for k, v in made.items()})
    assert found["gaps"].figures["seconds"] == pytest.approx(2.0)
    assert found["motion of x"].figures["reversals"] == 18
    turned = findings(tmp_path, {"t": made["t"], "x": (made["t"] * 0.7) % 1.0, "w": made["w"]})["jumps of x"]
    assert turned.severity == "problem" and turned.figures["count"] == 13
    made["x"][500] = np.nan
    (tmp_path / "meta.yaml").write_text("missing: fill\n")
    assert findings(tmp_path, made)["missing values"].figures["count"] == 1
    short = findings(tmp_path, {k: v[:20] for k, v in rows().items()})
    assert short["motion"].severity == "problem" and short["duration"].severity == "warning"
    findings(tmp_path, {k: v[:2] for k, v in rows().items()})


@pytest.mark.parametrize("unit", [0.001, 57.3, 1000.0])
def test_a_coordinate_in_another_unit_is_blamed_and_not_the_input(tmp_path, unit):
    """Inertia grows with the scale of x, Coulomb friction does not; both grow with that of w."""
    made = rows(20, 250)
    t, v = made["t"], made["v"] + 0.003 * 31 * np.cos(31 * made["t"])
    made["w"] += LEVEL * (np.sign(v) - np.sign(made["v"])) - MASS * 0.003 * 31**2 * np.sin(31 * t)
    made["x"] += 0.003 * np.sin(31 * t)
    assert findings(tmp_path, made)["sign and scale of w"].severity == "info"
    told = findings(tmp_path, {**made, "x": unit * made["x"]})
    assert told["scale of x"].severity == "problem" and "sign and scale of w" not in told
    assert told["scale of x"].figures["inertia"] == pytest.approx(1 / unit, rel=0.05)
    push = findings(tmp_path, {**made, "w": made["w"] / unit})
    assert push["sign and scale of w"].severity == "problem" and "scale of x" not in push


PAIR = """name: pair
coordinates: {x1: {velocity: v1, unit: m}, x2: {velocity: v2, unit: m}}
inputs: {w: {unit: N}}
parameters: {m1: {value: 3, unit: kg}, m2: {value: 5, unit: kg}, k: {value: 400, unit: N/m}}
mass_matrix: [[m1, 0], [0, m2]]
force: [k*(x2 - x1), w - k*(x2 - x1)]
friction: {distribution: [[0], [1]], contacts: [{name: ground, law: coulomb, a: 6, unit: N}]}
"""


@pytest.mark.parametrize("name", ["x1", "x2"])
def test_of_two_coupled_coordinates_the_one_in_another_unit_is_named(tmp_path, name):
    """Forces by the equations of motion. In mm, the undriven x1 disturbed the balance of x2 alone, which was blamed."""
    t = np.arange(7500) / 250
    waves = [(0.1, 2.5, 0.0), (0.03, 6.7, 1.0)]
    x1, a1 = (sum(b * (-(o**2)) ** k * np.sin(o * t + p) for b, o, p in waves) for k in (0, 1))
    j1 = sum(b * o**4 * np.sin(o * t + p) for b, o, p in waves)  # the fourth derivative
    x2, a2 = x1 + 3 * a1 / 400, a1 + 3 * j1 / 400
    v2 = np.gradient(x2, t)
    made = {"t": t, "x1": x1, "x2": x2, "w": 5 * a2 + 3 * a1 + 6 * np.sign(v2)}
    good = findings(tmp_path, made, PAIR)
    assert not any(f.severity == "problem" for f in good.values())
    told = findings(tmp_path, {**made, name: 1000 * made[name]}, PAIR)
    problems = [topic for topic, f in told.items() if f.severity == "problem"]
    assert problems == [f"scale of {name}"] and f"is {name} in mm?" in told[problems[0]].words


def test_motion_that_no_input_could_make_is_in_another_unit(tmp_path):
    made = rows(20, 250)
    told = findings(tmp_path, {**made, "x": 1000 * made["x"]})["scale of x"]
    top = MASS * 1000 * 0.1 * np.pi**2 / np.sqrt(2)
    assert told.severity == "problem" and told.figures["times"] == pytest.approx(
        top / LEVEL, rel=0.15
    )  # near reversals nothing is compared


def test_where_friction_does_not_tell_the_envelope_does(tmp_path):
    made = rows(20, 250)
    made["w"] = made["w"] - LEVEL * np.sign(made["v"])
    text = (
        TEXT[: TEXT.index("friction:")] + "friction: {distribution: [[]], contacts: []}\nenvelope: {v: [-0.5, 0.5]}\n"
    )
    told = findings(tmp_path, {**made, "x": 1000 * made["x"]}, text)
    assert "sign and scale of w" not in told
    assert told["scale of x"].figures["times"] == pytest.approx(1000 * 0.1 * np.pi / 0.5, rel=0.05)
    small = findings(tmp_path, {**made, "x": made["x"] / 1000}, text)["envelope of v"]
    assert small.severity == "warning" and "is its scale right?" in small.words
    assert findings(tmp_path, {**made, "w": made["w"] / 1000}, text)["sign and scale of w"].severity == "problem"


def moving_in_mm(share: float = 1.0) -> dict:
    """Two tones and the force for them, with ``share`` of the declared inertia; x in mm."""
    t = np.arange(5000) / 250
    waves = [(0.1, 3.1, 0.0), (0.004, 29.0, 0.4)]
    x, a = (sum(b * (-(o**2)) ** k * np.sin(o * t + p) for b, o, p in waves) for k in (0, 1))
    v = sum(b * o * np.cos(o * t + p) for b, o, p in waves)
    return {"t": t, "x": 1000 * x, "w": share * MASS * a + LEVEL * np.sign(v)}


@pytest.mark.parametrize("inside", ["", "envelope: {v: [-0.8, 0.8]}\n"], ids=["by inertia", "by the envelope"])
@pytest.mark.parametrize("stated", ["cm", "m", "um"])
def test_a_wrong_power_of_ten_in_the_units_of_a_log_is_named_with_the_right_unit(tmp_path, stated, inside):
    """A log in mm read as cm was diagnosed as 90 % less inertia."""
    about = tmp_path / "about.yaml"
    about.write_text(f"units: {{x: {stated}}}\n")
    told = findings(tmp_path, moving_in_mm(), TEXT + inside, description=about)["scale of x"]
    assert told.severity == "problem" and "is x in mm?" in told.words and "units: {x: mm}" in told.words
    about.write_text("units: {x: mm}\n")
    assert "scale of x" not in findings(tmp_path, moving_in_mm(), TEXT + inside, description=about)


@pytest.mark.parametrize("gear", [50.0, 1 / 50])
def test_a_position_on_the_other_side_of_a_gear_is_no_other_unit(tmp_path, gear):
    """A servo's angle at its motor, 100 times that of the load, was taken for degrees, 57 times."""
    text = TEXT.replace("parameters:\n", f"parameters:\n  n: {{value: {gear:.6g}}}\n")
    assert text != TEXT
    made = moving_in_mm()
    told = findings(tmp_path, {**made, "x": made["x"] / 1000 * gear}, text)["scale of x"]
    assert told.severity == "problem" and "is x in" not in told.words
    assert f"scale: {{x: {1 / gear:.4g}}}" in told.words and "the parameter n has this value" in told.words
    told = findings(tmp_path, {**made, "x": made["x"] / 1000 * 1.3 * gear}, text)["scale of x"]
    assert "the parameter n" not in told.words


@pytest.mark.parametrize("share", [0.3, 0.5, 1.5, 3.0])
def test_another_inertia_is_no_other_unit(tmp_path, share):
    """Also where the log is outside the envelope, which tells the audit to look."""
    about = tmp_path / "about.yaml"
    about.write_text("units: {x: mm}\n")
    told = findings(tmp_path, moving_in_mm(share), TEXT + "envelope: {v: [-0.05, 0.05]}\n", description=about)
    assert "in cm" not in str(told) and "in m?" not in str(told) and "in um" not in str(told)


@pytest.mark.parametrize(
    ("effect", "force"),
    [
        (
            "{kind: inertia_error, on: [x], parameters: {delta: 108}}",
            lambda m, a: 108 * a,
        ),  # 54 times the declared mass
        ("{kind: spring, on: [x], parameters: {k: 900}}", lambda m, a: 900 * m["x"]),
        (
            "{kind: friction_drift, on: [rail], parameters: {delta: 60, T: 0.5}}",
            lambda m, a: 60 * np.exp(-m["t"] / 0.5) * np.sign(m["v"]),
        ),
    ],
    ids=["inertia_error", "spring", "friction_drift"],
)
def test_declared_effects_are_part_of_the_balance_of_forces(tmp_path, effect, force):
    """The declared rotor inertia of a robot's wrist, 54 times that of its link, was taken for a wrong unit."""
    about = tmp_path / "about.yaml"
    about.write_text("units: {x: mm}\n")
    made = moving_in_mm()
    x = made["x"] / 1000
    v, a = np.gradient(x, made["t"]), np.gradient(np.gradient(x, made["t"]), made["t"])
    made["w"] = made["w"] + force({**made, "x": x, "v": v}, a)
    text = f"{TEXT}effects: [{effect}]\n"
    told = findings(tmp_path, made, text, description=about)
    assert {f.severity for f in told.values()} == {"info"}
    assert told["sign and scale of w"].figures["factor"] == pytest.approx(1, abs=0.03)


@pytest.mark.parametrize(("factor", "offer"), [(10.0, "units: {x: mm}"), (3.0, "scale: {x: 0.3333}"), (1.0, "")])
def test_a_position_and_its_measured_velocity_of_two_scales(tmp_path, factor, offer):
    about = tmp_path / "about.yaml"
    about.write_text("units: {x: cm}\n")
    made = rows(20, 250)
    made["x"] *= 100 * factor
    found = [f for f in findings_of(tmp_path, made, about) if "measured v" in f.words]
    assert len(found) == bool(offer)
    for f in found:
        assert f.severity == "warning" and offer in f.words and f.figures["factor"] == pytest.approx(factor, rel=0.01)


PENDULUM = """name: pendulum
coordinates: {q: {velocity: v, unit: rad}}
inputs: {u: {unit: N*m}}
parameters: {J: {value: 0.17, unit: kg*m^2}, G: {value: 3.4, unit: N*m}}
mass_matrix: [[J]]
force: [u - G*sin(q)]
friction: {distribution: [[1]], contacts: [{name: joint, a: 0.15, unit: N*m}]}
"""


def test_an_input_computed_from_the_position_is_told(tmp_path):
    """Gravity compensation, moved by hand; with a torque that moves the arm the same motion is a good log."""
    t = np.arange(7500) / 250
    q = -1.5 + 1.2 * np.sin(0.5 * t) + 0.4 * np.sin(1.3 * t + 1)
    v, a = np.gradient(q, t), np.gradient(np.gradient(q, t), t)
    noise = 0.003 * np.random.default_rng(1).normal(size=len(t))
    found = findings(tmp_path, {"t": t, "q": q, "u": 3.31 * np.sin(q) + noise}, PENDULUM)
    words = found["input computed from q"]
    assert words.severity == "problem" and "in no column" in words.words
    assert words.figures["share"] < 0.005 and words.figures["taken"] > 0.05
    driven = 3.4 * np.sin(q) + 0.17 * a + 0.15 * np.sign(v) + noise
    assert {f.severity for f in findings(tmp_path, {"t": t, "q": q, "u": driven}, PENDULUM).values()} == {"info"}


def test_a_free_swing_against_a_spring_of_the_controller_is_a_good_log(tmp_path):
    """The input is a function of the position there too; friction of another size than declared explains the swing."""
    h, q, v, rows_ = 0.001, 1.2, 0.0, []
    for k in range(20000):
        u = -8.0 * q
        rows_.append((h * k, q, u))
        v += h * (u - 3.4 * np.sin(q) - 0.05 * v - 0.04 * np.tanh(v / 0.01)) / 0.17
        q += h * v
    t, q, u = np.array(rows_).T
    assert "input computed from q" not in findings(tmp_path, {"t": t, "q": q, "u": u}, PENDULUM)


@pytest.mark.parametrize(("unit", "factor"), [("mm/s", 1e-3), ("cm/s", 1e-2)])
def test_a_measured_velocity_in_another_unit_is_named(tmp_path, unit, factor):
    about = tmp_path / "about.yaml"
    about.write_text("velocity_columns: true\n")
    made = rows(20, 250)
    made["v"] /= factor
    (found,) = [f for f in findings_of(tmp_path, made, about) if "measured v" in f.words]
    assert found.severity == "warning" and f"if it is v: `units: {{v: {unit}}}`" in found.words
    assert found.figures["factor"] == pytest.approx(factor, rel=0.01)
