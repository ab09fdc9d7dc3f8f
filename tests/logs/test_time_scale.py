"""A time that is too long or too short by a factor: reported, and distinguished from a mass that is too small."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from slider_log import LEVEL, MASS, TEXT, write_csv

from codegen.logs import Finding, preflight, read_log
from codegen.logs.audit.scales import SCALE_OF_TIME
from codegen.spec.reader import parse_spec
from tests.slow_cases import slow_except

DAMPING = 12.0
RATE = 500.0
DAMPED = TEXT.replace("force: [w]", "force: [w - b*v]").replace(
    "parameters:\n", f"parameters:\n  b: {{value: {DAMPING}, unit: N*s/m}}\n"
)
SPRUNG = """name: sprung_slider
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 0.3, unit: kg}, b: {value: 6, unit: N*s/m}, k: {value: 60, unit: N/m}}
mass_matrix: [[m]]
force: [w - b*v - k*x]
friction: {distribution: [[1]], contacts: [{name: rail, a: 0.4, unit: N}]}
"""


def found(
    folder: Path,
    c: float = 1.0,
    mass: float = MASS,
    about: str = "scale: {w: 1}",
    text: str = DAMPED,
    stamped: bool = True,
) -> list[Finding]:
    """What the preflight says of the rate of a log whose time is c times too long."""
    t = np.arange(10000) / RATE
    waves = [(0.1, 3.1, 0.0), (0.02, 12.0, 0.4)]
    x, a = (sum(b * (-(o**2)) ** n * np.sin(o * t + p) for b, o, p in waves) for n in (0, 1))
    v = sum(b * o * np.cos(o * t + p) for b, o, p in waves)
    force = mass * a + (DAMPING * v if text == DAMPED else 0.0) + LEVEL * np.sign(v)
    spec, described = parse_spec(text, Path("slider.yaml")), folder / "about.yaml"
    described.write_text(f"{about}\n")
    columns = {"t": c * t, "x": x, "w": force} if stamped else {"x": x, "w": force}
    path = write_csv(folder / "a.csv", columns, fmt="%.12g")
    log = read_log(path, spec, description=described)
    return [f for f in preflight(log, spec) if f.topic == SCALE_OF_TIME]


@pytest.mark.parametrize(("c", "severity"), [(2.0, "warning"), (0.5, "problem"), (1.6, "warning")])
def test_a_wrong_time_is_reported_with_the_line_that_corrects_it(tmp_path: Path, c: float, severity: str) -> None:
    """A log of 1 kHz that was described as of 500 Hz was diagnosed as an inertia error and viscous friction.

    A factor of 0.5 was a problem before too, of the scale of x, which leaves 0.85 % of the squared forces.
    """
    (one,) = found(tmp_path, c)
    assert one.severity == severity and one.figures["factor"] == pytest.approx(c, rel=0.03)
    assert one.figures["misfit_scaled"] < one.figures["misfit_by_mass"]
    line = one.words.rpartition("(`")[2].partition("`")[0]
    assert line == f"scale: {{t: {1 / c:g}}}"  # 498.4 Hz by the fit, proposed as 500 Hz
    assert not found(tmp_path, c, about=line)


def test_without_stamps_the_rate_is_named(tmp_path: Path) -> None:
    (one,) = found(tmp_path, about=f"sample_rate_hz: {RATE / 2}", stamped=False)
    line = one.words.rpartition("(`")[2].partition("`")[0]
    assert line == f"sample_rate_hz: {RATE:g}"
    assert not found(tmp_path, about=line, stamped=False)


def test_a_right_time_is_not_reported(tmp_path: Path) -> None:
    assert not found(tmp_path)


def test_another_mass_is_not_taken_for_another_time(tmp_path: Path) -> None:
    """Inertia alone tells nothing of the time: a mass that is too small explains as much."""
    assert not found(tmp_path, mass=4 * MASS)
    assert not found(tmp_path, c=2.0, text=TEXT)


LATE = [(0.03, 1.0), (0.1, 1.0), (0.0, 1.3), (0.0, 2.0)]


@pytest.mark.parametrize(("delay", "c"), slow_except(LATE, LATE[1:3], several=True))
def test_inputs_that_act_late_are_not_taken_for_another_time(delay: float, c: float, tmp_path: Path) -> None:
    """A spring of 60 N/m moved slowly: a delay adds damping and mass as a time 1.3 and 1.9 times too long would. The
    delay was named as an effect, with the warning of a wrong sample rate beside it. A wrong rate is still found.
    """
    t, waves = np.arange(10000) / RATE, [(0.15, 0.9, 0.0), (0.05, 2.3, 0.4)]
    now, later = (
        [sum(b * o**n * np.sin(o * at + p + n * np.pi / 2) for b, o, p in waves) for n in range(3)]
        for at in (t, t + delay)
    )
    force = 60 * later[0] + 6 * later[1] + 0.3 * later[2] + 0.4 * np.sign(later[1])
    path = write_csv(tmp_path / "a.csv", {"t": c * t, "x": now[0], "w": force}, fmt="%.12g")
    spec = parse_spec(SPRUNG, Path("slider.yaml"))
    named = [f for f in preflight(read_log(path, spec), spec) if f.topic == SCALE_OF_TIME]
    assert bool(named) == (c > 1)


def test_no_other_column_is_suggested_where_the_unit_of_time_is_in_doubt(tmp_path: Path) -> None:
    """Of a log in ms that was read in s, the position was called a velocity: its acceleration was a millionth."""
    t = np.arange(20000) / 1000
    x, v, a = (0.1 * 3.1**n * np.sin(3.1 * t + n * np.pi / 2) for n in range(3))
    force = MASS * a + DAMPING * v + LEVEL * np.sign(v)
    path = write_csv(tmp_path / "a.csv", {"t": 1e3 * t, "x": 1e3 * x, "w": 1e3 * force}, fmt="%.12g")
    spec = parse_spec(DAMPED, Path("slider.yaml"))
    topics = {f.topic: f for f in preflight(read_log(path, spec), spec) if f.severity == "problem"}
    assert "milliseconds" in topics["sample rate"].words and "columns" not in topics
