"""A flipped sign of a position, a velocity or an input: which it is, or that the log cannot tell."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from slider_log import LEVEL, MASS, TEXT, write_csv

from codegen.logs import Finding, preflight, read_log
from codegen.logs.audit.changed_columns import FITS, Change
from codegen.spec.reader import parse_spec

WEIGHT, STIFFNESS = 120.0, 150.0
FORCES = {"plain": "w", "hoist": "w - W", "spring": "w - k*x", "wall": "w - k*(x - rest)"}
STANDING = TEXT.replace(
    "parameters:\n",
    f"parameters:\n  W: {{value: {WEIGHT}, unit: N}}\n  k: {{value: {STIFFNESS}, unit: N/m}}\n"
    "  rest: {value: 0.3, unit: m}\n",
)


def made() -> dict[str, np.ndarray]:
    t = np.arange(8000) / 500
    waves = [(0.1, 3.1, 0.0), (0.02, 12.0, 0.4)]
    x, a = (sum(b * (-(o**2)) ** n * np.sin(o * t + p) for b, o, p in waves) for n in (0, 1))
    v = sum(b * o * np.cos(o * t + p) for b, o, p in waves)
    return {"t": t, "x": x, "v": v, "w": MASS * a + LEVEL * np.sign(v)}


def problems(folder: Path, machine: str, turned: str, speeds: bool = True, about: str = "hold: []") -> list[Finding]:
    """The problems of a log of ``machine`` in which the columns of ``turned`` have the wrong sign."""
    columns = made()
    standing = {"plain": 0.0, "hoist": WEIGHT, "spring": STIFFNESS * columns["x"]}
    columns["w"] = columns["w"] + standing.get(machine, STIFFNESS * (columns["x"] - 0.3))
    columns = {name: -values if name in turned else values for name, values in columns.items()}
    if not speeds:
        del columns["v"]
    spec = parse_spec(STANDING.replace("force: [w]", f"force: [{FORCES[machine]}]"), Path("slider.yaml"))
    path, described = write_csv(folder / "a.csv", columns), folder / "about.yaml"
    described.write_text(f"{about}\n")
    return [f for f in preflight(read_log(path, spec, description=described), spec) if f.severity == "problem"]


@pytest.mark.parametrize("machine", FORCES)
@pytest.mark.parametrize(("turned", "speeds"), [("x", False), ("x", True), ("v", True), ("xv", True), ("w", True)])
def test_a_flipped_sign_is_named_where_a_log_can_tell(tmp_path, machine, turned, speeds):
    """A hoist whose position counts downwards passed the preflight; elsewhere the answer was to turn the input.

    A weight, or a spring about another zero, tells a coordinate from an input; a measured velocity tells it from a
    position alone. A plain axis, or a spring about zero, cannot tell them apart.
    """
    (one,) = problems(tmp_path, machine, turned, speeds)
    alone = speeds and turned in ("x", "v")
    undecided = machine in ("plain", "spring") and not alone
    coordinate = "x: -1, v: -1" if speeds else "x: -1"
    lines = re.findall(r"`scale: \{(.*?)\}`", one.words)
    right = f"{turned}: -1" if alone or turned == "w" else coordinate
    assert lines == (["w: -1", coordinate] if undecided else [right])
    assert ("cannot decide which" in one.words) is undecided
    assert one.topic == ("sign and scale of w" if undecided or turned == "w" else f"sign of {turned[0]}")
    assert not problems(tmp_path, machine, turned, speeds, about=f"scale: {{{right}}}")


@pytest.mark.parametrize("header", ["t,x [mm],v [mm/s],w [mN]\n", "t,x,v,w\ns,mm,mm/s,mN\n", "t,x [°],v,w [mN]\n"])
@pytest.mark.parametrize("turned", ["w", "xv"])
def test_the_line_that_turns_a_sign_keeps_the_unit_of_the_file(tmp_path, header, turned):
    """`scale: {w: -1}` replaced the mN of the header, and the input was 1000 times too large."""
    columns, text = made(), STANDING.replace("force: [w]", "force: [w - W]")
    columns["w"] = columns["w"] + WEIGHT
    if "°" in header:
        text = text.replace("velocity: v, unit: m}", "velocity: v, unit: rad}").replace("unit: kg", "unit: kg*m^2")
        text = text.replace("unit: N}", "unit: N*m}").replace("unit: N/m}", "unit: N*m/rad}")
        sizes = {"x": 180 / np.pi, "w": 1e3}
        header = header.replace("mN", "mNm")
    else:
        sizes = {"x": 1e3, "v": 1e3, "w": 1e3}
    spec = parse_spec(text, Path("slider.yaml"))
    columns = {name: (-1 if name in turned else 1) * sizes.get(name, 1) * values for name, values in columns.items()}
    path = write_csv(tmp_path / "a.csv", columns)
    path.write_text(header + path.read_text().split("\n", 1)[1])

    def found(about: str) -> list[Finding]:
        (tmp_path / "about.yaml").write_text(about)
        log = read_log(path, spec, description=tmp_path / "about.yaml")
        return [f for f in preflight(log, spec) if f.severity == "problem"]

    (one,) = found("hold: []\n")
    assert "seems flipped" in one.words
    said = re.search(r"\(((?:`[^`]*`(?: with )?)+) in meta.yaml", one.words)
    assert said is not None
    assert not found("\n".join(re.findall("`(.*?)`", said[1])))


@pytest.mark.parametrize("machine", FORCES)
def test_a_right_log_has_no_flipped_sign(tmp_path, machine):
    assert not problems(tmp_path, machine, "")


def test_a_weight_with_the_wrong_sign_in_the_spec_is_no_sign_of_the_log(tmp_path):
    spec = parse_spec(STANDING.replace("force: [w]", "force: [w + W]"), Path("slider.yaml"))
    columns = made()
    log = read_log(write_csv(tmp_path / "a.csv", columns | {"w": columns["w"] + WEIGHT}), spec)
    (one,) = [f for f in preflight(log, spec) if f.severity == "problem"]
    assert one.topic == "sign of gravity and springs" and "in the spec" in one.words and "scale:" not in one.words


@pytest.mark.parametrize("machine", ["hoist", "spring", "wall"])
def test_a_force_of_the_spec_with_the_other_sign_is_named(tmp_path, machine):
    """The whole force was written with the other sign, and the columns of the log were blamed alone."""
    columns = made()
    standing = {"hoist": WEIGHT, "spring": STIFFNESS * columns["x"], "wall": STIFFNESS * (columns["x"] - 0.3)}[machine]
    spec = parse_spec(STANDING.replace("force: [w]", f"force: [-({FORCES[machine]})]"), Path("slider.yaml"))
    log = read_log(write_csv(tmp_path / "a.csv", columns | {"w": columns["w"] + standing}), spec)
    (one,) = [f for f in preflight(log, spec) if f.severity == "problem"]
    assert "`force`" in one.words and "spec" in one.words
    if machine == "hoist":  # a coordinate that counts the other way is the same equation
        assert one.topic == "sign of x" and "x: -1" in one.words
    else:
        assert one.topic == "sign of the force" and "scale:" not in one.words


@pytest.mark.parametrize("machine", ["plain", "hoist", "wall"])
def test_a_flipped_input_may_be_a_sign_in_the_spec(tmp_path, machine):
    """No log tells the sign of a column from that of its term, so both places are named."""
    (one,) = problems(tmp_path, machine, "w")
    assert "`force`" in one.words and "`scale: {w: -1}`" in one.words


@pytest.mark.parametrize("far_better", [False, True])
def test_a_change_that_leaves_the_forces_unbalanced_is_none(far_better):
    """A current in mA without its unit: a change that left 77,000 times the forces unbalanced was proposed."""
    change = Change("", "", lambda: 0.0, "", far_better=far_better)
    assert change.enough(1e6) <= FITS and change.enough(0.2) < 0.2


def test_an_angle_that_no_input_drives(tmp_path):
    """A cart with a pendulum whose angle has the wrong sign passed the preflight."""
    text = """name: crane
coordinates: {x: {velocity: v, unit: m}, p: {velocity: u, unit: rad}}
inputs: {w: {unit: N}}
parameters:
  {a: {value: 28, unit: kg}, b: {value: 7, unit: kg*m}, c: {value: 6, unit: kg*m^2}, g: {value: 9.8, unit: m/s^2}}
mass_matrix: [[a, b*cos(p)], [b*cos(p), c]]
force: [w + b*u**2*sin(p), -b*g*sin(p)]
friction: {distribution: [[1], [0]], contacts: [{name: rail, a: 15, unit: N}]}
"""
    t, step = np.arange(0, 8, 5e-4), 5e-4
    state, rows = np.zeros(4), []
    force = 60 * np.sin(1.9 * t) + 45 * np.sin(4.5 * t)

    def rate(z, w):
        (_, p, v, u), k = z, np.cos(z[1])
        f = np.array([w + 7 * u**2 * np.sin(p) - 15 * np.tanh(v / 1e-3), -7 * 9.8 * np.sin(p)])
        return np.array([v, u, *np.linalg.solve([[28, 7 * k], [7 * k, 6]], f)])

    for w in force:
        rows.append(state)
        half = state + step / 2 * rate(state, w)
        state = state + step * rate(half, w)
    x = np.array(rows)[::2]
    columns = {"t": t[::2], "x": x[:, 0], "p": -x[:, 1], "w": force[::2]}
    spec = parse_spec(text, Path("crane.yaml"))
    found = preflight(read_log(write_csv(tmp_path / "a.csv", columns), spec), spec)
    (one,) = [f for f in found if f.severity == "problem"]
    assert one.topic == "sign of p" and re.findall(r"`scale: \{(.*?)\}`", one.words) == ["p: -1"]


@pytest.mark.parametrize(
    ("machine", "declared", "magnitude", "said"),
    [
        ("plain", "plain", True, True),
        ("hoist", "plain", False, True),  # a weight that the spec lacks
        ("hoist", "hoist", False, False),
        ("plain", "plain", False, False),
    ],
)
def test_an_input_without_its_sign(tmp_path, machine, declared, magnitude, said):
    """A servo reported the size of its current: the preflight was silent, and no sign or scale restores the log."""
    columns = made()
    columns["w"] = np.abs(columns["w"]) if magnitude else columns["w"] + WEIGHT * (machine == "hoist")
    spec = parse_spec(STANDING.replace("force: [w]", f"force: [{FORCES[declared]}]"), Path("slider.yaml"))
    found = preflight(read_log(write_csv(tmp_path / "a.csv", columns), spec), spec)
    words = [f.words for f in found if f.topic == "sign of w"]
    assert len(words) == said
    assert all("never negative" in text and "magnitude" in text and "weight" in text for text in words)


def test_an_input_in_another_unit_is_not_taken_for_a_magnitude_beside_a_declared_weight(tmp_path):
    """The input of a hoist in mN was said to have lost its sign, or to carry a weight that the spec lacks."""
    columns = made()
    columns["w"] = 1000 * (columns["w"] + WEIGHT)
    spec = parse_spec(STANDING.replace("force: [w]", f"force: [{FORCES['hoist']}]"), Path("slider.yaml"))
    found = preflight(read_log(write_csv(tmp_path / "a.csv", columns), spec), spec)
    (one,) = [f for f in found if f.severity in ("problem", "warning")]
    assert one.topic == "sign and scale of w" and "units: {w: mN}" in one.words


@pytest.mark.parametrize("machine", ["plain", "hoist"])
def test_of_a_constant_input_neither_sign_nor_scale_is_judged(tmp_path, machine):
    """It was said to be off by a factor, or to have lost its sign, beside the true finding that it is constant."""
    columns = made()
    columns["w"] = np.full_like(columns["w"], 5.0)
    spec = parse_spec(STANDING.replace("force: [w]", f"force: [{FORCES[machine]}]"), Path("slider.yaml"))
    found = preflight(read_log(write_csv(tmp_path / "a.csv", columns), spec), spec)
    assert [f.topic for f in found if f.severity in ("problem", "warning")] == ["input w"]


def gas(x: np.ndarray) -> np.ndarray:
    """A gas spring that holds 150 N and more against a weight that the spec has: it pushes towards +x."""
    return -90.0 * (0.36 / (0.24 - x)) ** 1.25


@pytest.mark.parametrize("turned", [False, True])
def test_an_input_against_a_force_that_the_spec_lacks_is_not_flipped(tmp_path, turned):
    """A vertical axis on a gas spring was unfit: the input pulls it down where the declared weight needs it to lift."""
    columns = made()
    columns["w"] = (-1 if turned else 1) * (columns["w"] + WEIGHT + gas(columns["x"]))
    spec = parse_spec(STANDING.replace("force: [w]", f"force: [{FORCES['hoist']}]"), Path("slider.yaml"))
    found = preflight(read_log(write_csv(tmp_path / "a.csv", columns), spec), spec)
    signs = [f for f in found if f.topic in ("sign and scale of w", "sign of x")]
    if turned:
        assert not any("is right" in f.words for f in signs)
        return
    (one,) = signs
    assert one.severity == "warning" and "the sign of w is right" in one.words
    assert one.figures["factor"] < 0 and one.figures["factor_beside_positions"] == pytest.approx(1, abs=0.1)


def test_a_position_in_another_unit_is_no_sign_of_the_input(tmp_path):
    """The scale of x, 23 times outside its envelope, was told as a warning that the sign of w is right."""
    columns = made()
    columns["w"] = columns["w"] + WEIGHT + 0.8 * gas(columns["x"])  # against the motion, with a correlation of -0.3
    text = STANDING.replace("force: [w]", f"force: [{FORCES['hoist']}]") + "envelope: {x: [-0.005, 0.005]}\n"
    spec = parse_spec(text, Path("slider.yaml"))
    found = preflight(read_log(write_csv(tmp_path / "a.csv", columns), spec), spec)
    (one,) = [f for f in found if "correlation" in f.figures]
    assert one.figures["factor"] < 0 and (one.topic, one.severity) == ("scale of x", "problem")


@pytest.mark.parametrize(
    ("damping", "level", "times", "wrong"), [(60.0, 1, 1, False), (0.0, 12, 1, False), (0.0, 1, 6, True)]
)
def test_a_damping_that_the_spec_lacks_is_no_wrong_scale(tmp_path, damping, level, times, wrong):
    """A motor at a voltage, whose spec lacks its back-EMF, did not fit its log: it takes a sixth of the voltage."""
    columns = made()
    columns["w"] = times * (columns["w"] + damping * columns["v"] + (level - 1) * LEVEL * np.sign(columns["v"]))
    spec = parse_spec(STANDING.replace("force: [w]", f"force: [{FORCES['plain']}]"), Path("slider.yaml"))
    found = preflight(read_log(write_csv(tmp_path / "a.csv", columns), spec), spec)
    (one,) = [f for f in found if f.topic == "sign and scale of w"]
    assert one.severity == ("problem" if wrong else "warning")
    assert ("back-EMF" in one.words) is not wrong
    assert one.figures["factor"] < 1 / 3
    assert wrong or abs(one.figures["factor_beside_losses"] - 1) < 0.05


def stepped(damping: float, size: float = 60.0) -> dict[str, np.ndarray]:
    """The slider with this damping under a force of this size that is reversed every half second."""
    t = np.arange(8000) / 500
    w, v = size * (1 - 2 * (np.floor(2 * t) % 2)), np.zeros(len(t))
    for k in range(len(t) - 1):
        v[k + 1] = v[k] + (w[k] - damping * v[k] - LEVEL * np.sign(v[k])) / MASS / 500
    return {"t": t, "x": np.concatenate([[0.0], np.cumsum(v[1:] + v[:-1]) / 1000]), "v": v, "w": w}


@pytest.mark.parametrize(("damping", "declared", "times"), [(15.0, 90, 1), (60.0, 60, 6), (15.0, 15, 6)])
def test_a_damping_that_is_declared_too_large_is_no_wrong_scale(tmp_path, damping, declared, times):
    """A motor of whose damping its data sheet states a multiple was unfit: it takes three times the voltage."""
    columns = stepped(damping)
    columns["w"] = columns["w"] / times
    text = STANDING.replace("force: [w]", "force: [w - d*v]")
    text = text.replace("parameters:\n", f"parameters:\n  d: {{value: {declared}, unit: N*s/m}}\n", 1)
    spec = parse_spec(text, Path("slider.yaml"))
    found = preflight(read_log(write_csv(tmp_path / "a.csv", columns), spec), spec)
    (one,) = [f for f in found if f.topic == "sign and scale of w"]
    assert one.severity == ("problem" if times > 1 else "warning")
    assert ("declares it too large" in one.words) == (times == 1)
    assert one.figures["factor"] > 3
    assert times > 1 or abs(one.figures["factor_beside_losses"] - 1) < 0.05


LEVER = """name: lever
coordinates: {q: {velocity: v, unit: rad}}
inputs: {T: {unit: N*m}}
parameters: {J: {value: 0.2, unit: kg*m^2}, W: {value: 6, unit: N*m}}
mass_matrix: [[J]]
force: [T - W*cos(q)]
friction: {distribution: [[1]], contacts: [{name: gear, law: coulomb, a: 0.6, unit: N*m}]}
observer: {kind: cfo, velocity: estimated, gains: {K_F: 10, K_v: 100}, sample_time: 1 ms}
envelope: {v: [-5, 5]}
"""


@pytest.mark.parametrize("degrees", [True, False])
def test_a_weight_over_an_angle_in_degrees_is_no_lost_sign(degrees, tmp_path):
    """A lever that carries its weight: its torque "is never negative", beside the unit that balances all forces."""
    t = np.arange(0, 10, 0.002)
    q = 0.3 * np.sin(3 * t) + 0.15 * np.sin(7 * t)
    v, a = 0.9 * np.cos(3 * t) + 1.05 * np.cos(7 * t), -2.7 * np.sin(3 * t) - 7.35 * np.sin(7 * t)
    torque = 0.2 * a + 6 * np.cos(q) + 0.6 * np.sign(v)
    assert torque.min() > 0
    columns = {"t": t, "q": np.degrees(q) if degrees else q, "T": torque}
    spec = parse_spec(LEVER, Path("lever.yaml"))
    found = preflight(read_log(write_csv(tmp_path / "a.csv", columns), spec), spec)
    assert not [f.words for f in found if "never negative" in f.words]
    problems = [f.words for f in found if f.severity == "problem"]
    assert len(problems) == degrees and all("q: deg" in words for words in problems), problems
