"""The measured logs beside the project, read as they were published, by descriptions of a few lines."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from codegen.base.errors import BadInput
from codegen.logs import preflight, read_description, read_log, read_logs
from codegen.spec.reader import parse_spec

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
SCREWS = DATA / "rvim_screw_drives" / "experiments"
LAAS = DATA / "laas_cogging"


def needs(folder: Path) -> pytest.MarkDecorator:
    return pytest.mark.skipif(not folder.is_dir(), reason=f"../shared/data/{folder.name} is not here")


def one_joint(name: str, inertia: float, level: float, force: str = "u", unit: str = "N*m", more: str = "") -> str:
    """A rotor with dry friction; the drive's signal in its own unit."""
    return f"""name: {name}
coordinates: {{q: {{velocity: v, unit: rad}}}}
inputs: {{u: {{unit: {unit}}}}}
parameters:
  J: {{value: {inertia}, unit: kg*m^2}}
{more}mass_matrix: [[J]]
force: [{force}]
friction:
  distribution: [[1]]
  contacts: [{{name: joint, a: {level}, unit: N*m}}]
"""


def told(log, spec):
    return {f.topic: f for f in preflight(log, spec)}


SCREW = parse_spec(one_joint("screw", 2.186e-6, 3e-3), Path("screw.yaml"))
SCREW_META = """columns: {t: 1, v: Velocity actual value averaged, u: Torque_actual_value_averaged/100*9.84e-3}
units: {t: ms, v: rpm}
"""


def screw_rows(path: Path) -> np.ndarray:
    """(N, 3) ms, rpm, %: by hand, from the lines that begin with a number."""
    lines = [line.split(",")[0] for line in path.read_text().splitlines()]
    return np.array([[float(x) for x in line.split(";")] for line in lines if line[:1].isdigit() and ";" in line])


@needs(DATA / "rvim_screw_drives")
@pytest.mark.parametrize("name", ["driveNo1/20", "driveNo1/n2", "driveNo2/n10", "driveNo3/1", "driveNo3/n1"])
def test_epos_exports(tmp_path, name):
    drive, log = name.split("/")
    path = SCREWS / drive / "steady_state" / "0.096kg" / f"{log}.csv"
    (tmp_path / "meta.yaml").write_text(SCREW_META)
    read = read_log(path, SCREW, description=tmp_path / "meta.yaml")
    table = screw_rows(path)
    assert read.size == len(table) == 500
    assert read.sample_time == pytest.approx(np.diff(table[:, 0]).mean() * 1e-3, rel=1e-9)
    assert read.velocities[:, 0] == pytest.approx(table[:, 1] * 2 * np.pi / 60)
    assert read.inputs[:, 0] == pytest.approx(table[:, 2] / 100 * 9.84e-3)
    turned = np.sum((table[1:, 1] + table[:-1, 1]) / 2 * np.diff(table[:, 0])) * 1e-3 / 60 * 2 * np.pi
    assert np.ptp(read.positions[[0, -1], 0]) == pytest.approx(abs(turned))
    header = 11 if name == "driveNo1/n2" else 13
    assert any(f"the header is line {header} " in n for n in read.notes), read.notes
    assert any("integral of the measured speed" in n for n in read.notes)
    if name == "driveNo3/1":
        assert any("`was -8.9` of line 15 is not read" in n for n in read.notes)


LAAS_SPEC = parse_spec(one_joint("motor", 1.9e-4, 0.065, "k*u", "A", "  k: {value: 1, unit: N*m/A}\n"), Path("m.yaml"))


@needs(LAAS)
@pytest.mark.parametrize("name", ["speed_test", "speed_test1", "speed_test_old", "acc_current"])
def test_text_with_comma_and_blank(tmp_path, name):
    (tmp_path / "meta.yaml").write_text("columns: {t: Time, q: Position, v: Velocity, u: Iq}\n")
    read = read_log(LAAS / f"{name}.txt", LAAS_SPEC, description=tmp_path / "meta.yaml")
    table = np.genfromtxt(LAAS / f"{name}.txt", delimiter=",", names=True)
    assert np.allclose(read.positions[:, 0], np.interp(read.time, table["Time"], table["Position"]), atol=1e-9)
    assert read.sample_time == pytest.approx(0.001, rel=1e-3) or read.raw_data.resampled
    assert told(read, LAAS_SPEC)["motion of q"]


BAM = DATA / "bam_xl330"
SERVO_TEXT = one_joint(
    "servo",
    0.016,
    0.03,
    "k*u - m*g*l*sin(q)",
    "V",
    """  k: {value: 0.2, unit: N*m/V}
  m: {value: 0.49, unit: kg}
  l: {value: 0.1, unit: m}
  g: {value: 9.81, unit: m/s^2}
""",
)
SERVO = parse_spec(SERVO_TEXT, Path("servo.yaml"))
BAM_META = """columns: {t: timestamp, q: position, v: speed, u: load/885*input_volts*torque_enable}
"""


@needs(BAM)
def test_json_records_beside_scalars(tmp_path):
    path = sorted(BAM.glob("*.json"))[0]
    (tmp_path / "meta.yaml").write_text(BAM_META)
    read = read_log(path, SERVO, description=tmp_path / "meta.yaml")
    entries = json.loads(path.read_text())["entries"]
    at = np.array([e["timestamp"] for e in entries])
    assert read.raw_data.rows == len(at)
    assert np.allclose(read.positions[:, 0], np.interp(read.time, at, [e["position"] for e in entries]), atol=1e-9)
    volts = np.array([e["load"] / 885 * e["input_volts"] * e["torque_enable"] for e in entries])
    assert read.inputs.max() <= volts.max() + 1e-9 and read.inputs.mean() == pytest.approx(volts.mean(), rel=0.02)


WRAPPED = ("28m10", "28m17", "28m32", "28m42", "28m49", "29m04", "29m14", "29m21", "29m37", "29m47", "29m54", "30m10")


@needs(BAM)
def test_signed_numbers_stored_unsigned_are_named_and_not_the_sign_of_the_input(tmp_path):
    about = tmp_path / "meta.yaml"
    for path in sorted(BAM.glob("*.json")):
        about.write_text(BAM_META)
        found = told(read_log(path, SERVO, description=about), SERVO)
        assert ("numbers of u" in found) == any(part in path.name for part in WRAPPED)
        if "numbers of u" in found:
            finding = found["numbers of u"]
            assert finding.severity == "problem" and "Say `signed16: [load]`" in finding.words
            assert found["sign and scale of u"].severity == "info" and "flipped" not in str(found)
        about.write_text(BAM_META + "signed16: [load]\n")
        read = read_log(path, SERVO, description=about)
        found = told(read, SERVO)
        assert "numbers of u" not in found and "flipped" not in str(found)
        assert np.abs(read.inputs).max() < 8.5  # V: the battery's


@needs(BAM)
def test_a_sign_of_gravity_is_told_from_a_sign_of_the_input(tmp_path):
    path = BAM / "2026-01-15_10h28m10.json"
    about = tmp_path / "meta.yaml"
    other = parse_spec(SERVO_TEXT.replace("- m*g*l*sin(q)", "+ m*g*l*sin(q)"), Path("servo.yaml"))
    about.write_text(BAM_META + "signed16: load\n")
    words = told(read_log(path, other, description=about), other)["sign and scale of u"].words
    assert words.startswith("The modelled gravity and springs run against the force that input u gives, while inertia")
    assert "and not the sign of u" in words and "flipped" not in words
    about.write_text(BAM_META + "signed16: load\nscale: {u: -1}\n")
    found = told(read_log(path, SERVO, description=about), SERVO)["sign and scale of u"]
    assert found.severity == "problem" and "`force`" in found.words and "`scale: {u: 1}`" in found.words


PENDULUM = parse_spec(
    one_joint("pendulum", 0.17, 0.1, "u - G*sin(q)", more="  G: {value: 3.4, unit: N*m}\n"), Path("p")
)


@needs(DATA / "dfki_simple_pendulum")
def test_rows_that_repeat(tmp_path):
    (tmp_path / "meta.yaml").write_text("columns: {t: time, q: position, v: velocity, u: torque}\n")
    path = DATA / "dfki_simple_pendulum" / "gravity_compensation.csv"
    table = np.genfromtxt(path, delimiter=",", skip_header=1)[:, 1:3]
    finding = told(read_log(path, PENDULUM, description=tmp_path / "meta.yaml"), PENDULUM)["stale rows"]
    assert finding.figures["share"] == pytest.approx(np.mean((table[1:] == table[:-1]).all(axis=1)))
    assert 0.16 < finding.figures["share"] < 0.17


STAUBLI = DATA / "staubli_tx40"
RATIOS = (32, 32, 45, -48, 45, 32)
OFFSETS = (0, -np.pi / 2, np.pi / 2, 0, 0, 0)


def arm() -> str:
    """Six rotors; the mechanics do not matter here."""
    joints = range(1, 7)
    zeros = [["1" if i == j else "0" for j in joints] for i in joints]
    return "\n".join(
        [
            "name: arm",
            f"coordinates: {{{', '.join(f'q{j}: {{velocity: v{j}, unit: rad}}' for j in joints)}}}",
            f"inputs: {{{', '.join(f'u{j}: {{unit: N*m}}' for j in joints)}}}",
            "parameters: {J: {value: 1, unit: kg*m^2}}",
            f"mass_matrix: [{', '.join('[' + ', '.join(row).replace('1', 'J') + ']' for row in zeros)}]",
            f"force: [{', '.join(f'u{j}' for j in joints)}]",
            "friction:",
            f"  distribution: [{', '.join('[' + ', '.join(row) + ']' for row in zeros)}]",
            f"  contacts: [{', '.join(f'{{name: j{j}, a: 5, unit: N*m}}' for j in joints)}]",
        ]
    )


STAUBLI_META = """beside: {current: curr_data.csv}
sample_time: 0.0002
columns:
  q1: Joint_1/32
  q2: Joint_2/32 - pi/2
  q3: Joint_3/45 + pi/2
  q4: -Joint_4/48
  q5: Joint_5/45
  q6: (Joint_6 - 32*Joint_5/45)/32
  u1: 32*current_Joint_1
  u2: 32*current_Joint_2
  u3: 45*current_Joint_3
  u4: -48*current_Joint_4
  u5: 45*current_Joint_5 + 32*current_Joint_6
  u6: 32*current_Joint_6
"""


@needs(STAUBLI)
def test_two_files_side_by_side_without_time(tmp_path):
    spec = parse_spec(arm(), Path("arm.yaml"))
    (tmp_path / "meta.yaml").write_text(STAUBLI_META)
    read = read_log(STAUBLI / "pos_read_data.csv", spec, description=tmp_path / "meta.yaml")
    turned, torque = (
        np.loadtxt(STAUBLI / name, delimiter=",", skiprows=1) for name in ("pos_read_data.csv", "curr_data.csv")
    )
    reduction = np.diag(np.array(RATIOS, dtype=float))
    reduction[5, 4] = 32
    assert read.size == 45000 and read.sample_time == 0.0002
    assert np.allclose(read.positions, turned @ np.linalg.inv(reduction).T + OFFSETS, atol=1e-12)
    assert np.allclose(read.inputs, torque @ reduction, atol=1e-12)
    rms = np.sqrt(np.mean(read.inputs**2, axis=0))
    assert rms == pytest.approx([31.4, 32.8, 12.2, 5.8, 8.3, 5.0], rel=0.02)
    assert 0.08 < read.raw_data.repeated < 0.10


TRAIN = {
    "driveNo1": (2, 20, 40, 60, 80, 100, 140, 180),
    "driveNo2": (10, 30, 50, 70, 90, 120, 160, 200),
    "driveNo3": (1, 4, 8, 13, 20, 30, 50, 70, 90, 120, 160, 200),
}


@needs(SCREWS.parent)
@pytest.mark.parametrize("drive", TRAIN)
def test_a_ladder_of_speeds_is_one_experiment(tmp_path, drive):
    (tmp_path / "meta.yaml").write_text(SCREW_META)
    files = [SCREWS / drive / "steady_state" / "0.096kg" / f"{s}{k}.csv" for k in TRAIN[drive] for s in ("", "n")]
    read = read_logs(files, SCREW, description=tmp_path / "meta.yaml")
    found = told(read, SCREW)
    assert len(read.records) == len(files) and len(read.joints) == len(read.gaps) == len(files) - 1
    finest, coarsest = (pick(one.sample_time for one in read.records) for pick in (min, max))
    assert finest <= read.sample_time <= 3 * finest < coarsest and read.size <= 3 * 500 * len(files) + 1
    assert "gaps" not in found and not [f.words for f in found.values() if f.severity == "problem"]
    assert found["steady speeds of q"].figures["records"] >= len(files) - 1
    assert found["sample rate"].severity == "info"  # nothing turns, so that nothing is too fast for it
    assert "at its own rate" in found["sample rate"].words and found["duration"].figures["samples"] == 500 * len(files)


PAGE = Path(__file__).resolve().parents[2] / "docs" / "logs.md"


def descriptions() -> list[str]:
    """The examples in the page's section of known descriptions."""
    section = PAGE.read_text("utf-8").split("\n## Descriptions of known logs\n")[1]
    return [block.split("```")[0] for block in section.split("```yaml\n")[1:]]


def test_the_descriptions_in_the_page(tmp_path):
    for text in descriptions():
        (tmp_path / "meta.yaml").write_text(text)
        described = read_description(tmp_path / "meta.yaml")
        assert described.columns
    given = "".join(descriptions())
    for text in (SCREW_META, BAM_META):
        assert text in given
    assert not {line.strip() for line in STAUBLI_META.splitlines()[:2]} - set(given.splitlines())
    for line in ("q1: Joint_1/32", "q6: (Joint_6 - 32*Joint_5/45)/32", "u5: 45*current_Joint_5 + 32*current_Joint_6"):
        assert line in given and line in STAUBLI_META


@needs(DATA / "odrive_cogging")
def test_slow_turns_in_counts(tmp_path):
    about = next(text for text in descriptions() if "pos_counts" in text)
    (tmp_path / "meta.yaml").write_text(about)
    path = DATA / "odrive_cogging" / "slow2_nocomp_0.csv"
    read = read_log(path, LAAS_SPEC, description=tmp_path / "meta.yaml")
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    assert np.allclose(
        read.positions[:, 0], np.interp(read.time, table[:, 0], table[:, 1] * 2 * np.pi / 8192), atol=1e-9
    )


def bench_log(path: Path, extra: str) -> np.ndarray:
    """A log of a test bench with the speed alone and another column; its speeds in rpm."""
    t = np.arange(400) * 0.02
    rpm = 100 * np.sin(2 * t)
    rows = zip(t, rpm, np.cos(t), np.full(400, 12.0), strict=True)
    head = f"Time (s),Motor Speed (RPM),Torque (N·m),{extra}\n"
    path.write_text(head + "".join(f"{a:.4f},{b:.6f},{c:.6f},{d}\n" for a, b, c, d in rows))
    return rpm


BENCH_COLUMNS = '{t: "Time (s)", v: "Motor Speed (RPM)", u: "Torque (N·m)"'


@pytest.mark.parametrize(
    ("extra", "columns"), [("Voltage (V)", "}"), ("Pin State 1", ", q: none}"), ("Voltage (V)", ", q: none}")]
)
def test_speed_alone_beside_other_columns(tmp_path, extra, columns):
    """A bench logs volts and pins too; a column in volts is no angle, and of one without a unit the user says so."""
    rpm = bench_log(tmp_path / "bench.csv", extra)
    (tmp_path / "meta.yaml").write_text(f"columns: {BENCH_COLUMNS}{columns}\n")
    read = read_log(tmp_path / "bench.csv", SCREW, description=tmp_path / "meta.yaml")
    assert read.velocities[:, 0] == pytest.approx(rpm * np.pi / 30, rel=1e-5)
    turned = np.pi / 30 * 100 * (1 - np.cos(2 * 399 * 0.02)) / 2
    assert read.positions[-1, 0] - read.positions[0, 0] == pytest.approx(turned, rel=1e-3)


def test_a_column_that_may_be_the_position_is_asked_about(tmp_path):
    bench_log(tmp_path / "bench.csv", "Pin State 1")
    (tmp_path / "meta.yaml").write_text(f"columns: {BENCH_COLUMNS}}}\n")
    with pytest.raises(BadInput) as caught:
        read_log(tmp_path / "bench.csv", SCREW, description=tmp_path / "meta.yaml")
    assert caught.value.code == "LOG003" and "`columns: {q: none}`" in caught.value.expected
    (tmp_path / "meta.yaml").unlink()
    with pytest.raises(BadInput) as caught:
        read_log(tmp_path / "bench.csv", SCREW)
    assert 'v: "Motor Speed (RPM)"' in caught.value.expected and "q: none" in caught.value.expected


def test_no_position_and_no_speed_is_refused(tmp_path):
    bench_log(tmp_path / "bench.csv", "Pin State 1")
    (tmp_path / "meta.yaml").write_text('columns: {t: "Time (s)", u: "Torque (N·m)", q: none}\n')
    with pytest.raises(BadInput) as caught:
        read_log(tmp_path / "bench.csv", SCREW, description=tmp_path / "meta.yaml")
    assert caught.value.code == "LOG003" and "speed v" in caught.value.found


def test_rows_of_several_motors(tmp_path):
    """A bus log has a row for each motor at the same time; the message names the key that selects one, which works."""
    t = np.repeat(np.arange(300) * 0.02, 3)
    number = np.tile([1, 2, 3], 300)
    rows = zip(t, number, number * np.sin(t), np.cos(t), strict=True)
    text = "time,motor_id,position,torque\n" + "".join(f"{a:.4f},{b},{c:.7f},{d:.7f}\n" for a, b, c, d in rows)
    (tmp_path / "bus.csv").write_text(text)
    columns = "columns: {t: time, q: position, u: torque}\n"
    (tmp_path / "meta.yaml").write_text(columns)
    with pytest.raises(BadInput) as caught:
        read_log(tmp_path / "bus.csv", SCREW)
    assert caught.value.code == "LOG007" and "`rows: {COLUMN: NUMBER}`" in caught.value.expected
    (tmp_path / "meta.yaml").write_text(columns + "rows: {motor_id: 2}\n")
    read = read_log(tmp_path / "bus.csv", SCREW)
    assert read.positions[:, 0] == pytest.approx(2 * np.sin(np.arange(300) * 0.02), abs=1e-6)
