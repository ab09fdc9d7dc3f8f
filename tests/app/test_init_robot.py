"""``stiction init robot.xml --log run``: a spec that is accepted, with columns matched by name, and what was not."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from mechanics.robots import TWO_LINKS

from codegen.logs.joint_columns import guess_columns
from codegen.spec import read_spec

from .command import SPECS, contents, is_one_message, stiction

JOINTS = {"shoulder_pan": "shoulder_pan", "elbow": "elbow"}
MODEL = """<mujoco><worldbody>
  <body name="a"><joint name="shoulder_pan" axis="0 1 0" armature=".02" damping=".1" frictionloss=".3" range="-90 90"/>
    <geom type="box" size=".1 .02 .02"/>
    <body name="b" pos=".1 0 0"><joint name="elbow" axis="0 1 0" stiffness="2" springref="0.5"/>
      <geom type="box" size=".1 .02 .02"/></body></body>
</worldbody><actuator><motor joint="elbow" gear="30"/></actuator></mujoco>
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("names", "found"),
    [
        (
            ["t", "/j.position[elbow]", "/j.velocity[elbow]", "/j.effort[elbow]", "/cmd.position[elbow]", "/imu.x"],
            {"elbow": "/j.position[elbow]", "v_elbow": "/j.velocity[elbow]", "w_elbow": "/j.effort[elbow]"},
        ),
        (["time_s", "elbow_pos", "elbowVel", "tau_elbow"],
         {"t": "time_s", "elbow": "elbow_pos", "v_elbow": "elbowVel", "w_elbow": "tau_elbow"}),
        (["Time", "ShoulderPan_Angle", "shoulder pan torque (Nm)"],
         {"t": "Time", "shoulder_pan": "ShoulderPan_Angle", "w_shoulder_pan": "shoulder pan torque (Nm)"}),
        (["t", "elbow", "v_elbow", "w_elbow"], {"elbow": "elbow", "v_elbow": "v_elbow", "w_elbow": "w_elbow"}),
        (["t", "elbow_winkel", "elbow_drehmoment"], {"elbow": "elbow_winkel", "w_elbow": "elbow_drehmoment"}),
        (["t", "elbow.position.desired", "elbow.position.actual"], {"elbow": "elbow.position.actual"}),
        (["t", "elbows_position", "shoulder_position"], {}),
        (["t", "position[0]", "position[1]", "effort[0]", "effort[1]"],
         {"shoulder_pan": "position[0]", "elbow": "position[1]",
          "w_shoulder_pan": "effort[0]", "w_elbow": "effort[1]"}),
        (["t", "joint1_pos", "joint2_pos", "tau_meas_1", "tau_meas_2"],
         {"shoulder_pan": "joint1_pos", "elbow": "joint2_pos",
          "w_shoulder_pan": "tau_meas_1", "w_elbow": "tau_meas_2"}),
        (["t", "q1", "q2"], {"shoulder_pan": "q1", "elbow": "q2"}),
        (["header.stamp.sec", "header.stamp.nanosec", "elbow_position"],
         {"t": "header_stamp_sec + 1e-9*header_stamp_nanosec", "elbow": "elbow_position"}),
        (["t", "position[0]", "position[1]", "position[2]", "torque_cmd_1", "torque_cmd_2"], {}),
        (["t", "name[0]", "name[1]", "position[0]", "position[1]"], {}),
    ],
)  # fmt: skip
def test_names_that_are_matched(names: list[str], found: dict[str, str]) -> None:
    assert dict(guess_columns(names, JOINTS).columns) == found


def test_columns_by_number_ask_for_the_order_of_the_joints() -> None:
    said = guess_columns(["t", "name[0]", "name[1]", "position[0]", "position[1]"], JOINTS).remarks
    order = "assign them in the order of the log's list of names"
    assert f"`position[0]`, `position[1]`: position by number; {order}" in said
    said = guess_columns(["t", "q1", "q2"], JOINTS).remarks
    assert "`q1`, `q2`: by number; see that the joints of the log are in the robot file's order" in said


def test_what_names_do_not_tell_is_said() -> None:
    said = guess_columns(["elbow_position", "elbow_current", "action[0]", "other_elbow_position"], JOINTS).remarks
    assert any("no column of time" in line for line in said)
    assert "elbow: `other_elbow_position` would do as well" in said
    assert "w_elbow: `elbow_current` is a current; as `elbow_current*K`, K the torque it makes" in said
    assert any(line.startswith("`action[0]`: commanded, not measured") for line in said)
    assert any("a commanded position is no torque" in line and "25*(action_0_ - POSITION)" in line for line in said)


def test_a_mujoco_model_with_a_log(folder: Path) -> None:
    pytest.importorskip("mujoco", reason="needs the extra mujoco")
    (folder / "my arm.xml").write_text(MODEL)
    (folder / "run.csv").write_text("t,elbow_pos,elbow_tau,x\n0,0,0,0\n1,0,0,0\n")
    made = stiction("init", "my arm.xml", "--log", "run.csv")
    assert (made.code, made.out.split()) == (0, ["my_arm.yaml", "my_arm.urdf"]), made.err
    text = Path("my_arm.yaml").read_text()
    assert "# - actuator actuator_0 on elbow: w_elbow = 30*ctrl" in text
    assert "  # - w_shoulder_pan: no column of effort with the name shoulder_pan" in text
    spec = read_spec("my_arm.yaml")
    assert dict(spec.log.columns) == {"elbow": "elbow_pos", "w_elbow": "elbow_tau"}
    effects = {(effect.kind, *effect.on) for effect in spec.effects}
    assert effects == {
        ("viscous", "shoulder_pan"),
        ("inertia_error", "shoulder_pan"),
        ("spring", "elbow"),
        ("offset", "elbow"),
    }
    assert stiction("check", "my_arm.yaml").code == 0
    before = contents(folder)
    again = stiction("init", "my arm.xml", "--log", "run.csv")
    assert is_one_message(again) and again.err.startswith("error: my_arm.yaml") and "[FILE004]" in again.err
    (folder / "my_arm.yaml").unlink()
    (folder / "my_arm.urdf").write_text("mine")
    taken = stiction("init", "my arm.xml")
    assert is_one_message(taken) and taken.err.startswith("error: my_arm.urdf") and "[FILE004]" in taken.err
    assert (folder / "my_arm.urdf").read_text() == "mine" and len(contents(folder)) == len(before) - 1


def test_what_cannot_be_converted_is_told_of_the_model(folder: Path) -> None:
    """And not of the robot description that it became for a moment."""
    pytest.importorskip("mujoco", reason="needs the extra mujoco")
    (folder / "arm.xml").write_text(MODEL.replace('"elbow"', '"shoulder-pan"'))
    result = stiction("init", "arm.xml")
    assert is_one_message(result) and 'error: arm.xml: joint "shoulder-pan"' in result.err, result.err
    assert list(contents(folder)) == ["arm.xml"]


def test_a_urdf_with_a_log(folder: Path) -> None:
    shutil.copy(SPECS / "seven_joint_arm.urdf", folder / "arm.urdf")
    joint = read_spec(SPECS / "seven_joint_arm.yaml").positions[0]
    (folder / "run.csv").write_text(f"time,{joint}_position\n0,0\n1,0\n")
    assert stiction("init", "arm.urdf", "--log", "run.csv").out.split() == ["arm.yaml"]
    assert dict(read_spec("arm.yaml").log.columns) == {"t": "time", joint: f"{joint}_position"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("arm.xml", "--log", "none.csv"), "none.csv: no such file"),
        (("arm.xml", "--log", "run.xyz"), "run.xyz"),
        (("bad.xml",), "bad.xml"),
        (("none.xml",), "none.xml: no such file"),
        (("new", "--log", "run.csv"), "--log: a log without a robot file"),
    ],
)
def test_refusals(folder: Path, arguments: tuple[str, ...], words: str) -> None:
    (folder / "arm.xml").write_bytes((SPECS / "seven_joint_arm.urdf").read_bytes())
    (folder / "bad.xml").write_text("<mujoco><worldbody/></mujoco>")
    before = contents(folder)
    result = stiction("init", *arguments)
    assert is_one_message(result) and words in result.err, result
    assert contents(folder) == before


def _log(path: Path, joint: str, velocity: bool, step: float = 0.004) -> None:
    """A joint that swings by 4 rad at 1 rad/s, 10 s long, with stamps that jitter by a hundredth of a step."""
    t = np.arange(0, 10, step) + np.random.default_rng(0).uniform(-0.01, 0.01, round(10 / step)) * step
    columns = {"time": t, f"{joint}_position": 4 * np.sin(t)} | (
        {f"{joint}_velocity": 4 * np.cos(t)} if velocity else {}
    )
    rows = "\n".join(",".join(f"{v:.9g}" for v in row) for row in zip(*columns.values(), strict=True))
    path.write_text(",".join(columns) + "\n" + rows + "\n")


@pytest.mark.parametrize("velocity", [True, False])
def test_the_sample_time_and_the_speeds_of_the_log(folder: Path, velocity: bool) -> None:
    shutil.copy(SPECS / "seven_joint_arm.urdf", folder / "arm.urdf")
    joint, other = read_spec(SPECS / "seven_joint_arm.yaml").positions[:2]
    _log(folder / "run.csv", joint, velocity)
    assert stiction("init", "arm.urdf", "--log", "run.csv").code == 0
    spec = read_spec("arm.yaml")
    assert spec.observer is not None and float(spec.observer.sample_time) == pytest.approx(0.004, rel=1e-2)
    low, high = map(float, spec.envelope[f"v_{joint}"])
    assert -low == high == pytest.approx(1.2 * 4, rel=0.02) and high >= 1.2 * 3.999
    assert tuple(map(float, spec.envelope[f"v_{other}"])) == (-1, 1)
    low, high = map(float, spec.envelope[joint])
    assert low <= -3.99 and high >= 3.99 and spec.envelope[other] != spec.envelope[joint]
    text = Path("arm.yaml").read_text()
    assert "# the median step of the log" in text
    assert f"# 1.2 times the highest speed in the log, 4 rad/s{'' if velocity else ' by its positions'}" in re.sub(
        r"(log, )[34]\.\d+", r"\g<1>4", text
    )


def test_a_log_that_cannot_be_read_leaves_the_defaults_and_says_so(folder: Path) -> None:
    shutil.copy(SPECS / "seven_joint_arm.urdf", folder / "arm.urdf")
    joint = read_spec(SPECS / "seven_joint_arm.yaml").positions[0]
    (folder / "run.csv").write_text(f"time,{joint}_position\n1,0\n0,0\n")
    assert stiction("init", "arm.urdf", "--log", "run.csv").code == 0
    text = Path("arm.yaml").read_text()
    assert "# Sample time and speeds were not taken from it: " in text and "sample_time: 1 ms" in text
    assert "[-1, 1]" in text


URDF = """<robot name="slide"><link name="base"/><link name="cart"><inertial><mass value="2"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="x" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="1 0 0"/>%s</joint></robot>
"""


@pytest.mark.parametrize(
    ("limit", "ends"),
    [
        ('<limit effort="9" velocity="2" lower="-0.05" upper="0.4"/>', (-0.05, 0.4)),
        ('<limit effort="9" velocity="2" lower="-1e6" upper="1e6"/>', None),
        ('<limit effort="9" velocity="2"/>', None),
        ("", None),
    ],
)
def test_the_limits_of_a_urdf_are_the_envelope_or_it_is_said_to_be_assumed(folder: Path, limit: str, ends) -> None:
    (folder / "slide.urdf").write_text(URDF % limit)
    assert stiction("init", "slide.urdf").code == 0
    low, high = read_spec("slide.yaml").envelope["x"]
    assert (float(low), float(high)) == (ends or (-1, 1))
    assert ("assumed" in Path("slide.yaml").read_text()) == (ends is None)


@pytest.mark.parametrize("scale", [1.0, 1e-4])
def test_the_written_gains_are_stable_for_a_light_arm_too(folder: Path, scale: float) -> None:
    """K_2 was -1 for every joint: unstable at 1 ms for the light arm, and `generate` refused the new spec.

    M of the planar arm is that of a textbook; its smallest effective inertias are where the fastest mode is.
    """

    def scaled(found: re.Match[str]) -> str:
        return f'{found[1]}="{float(found[2]) * scale:.9g}"'

    text = re.sub(r'(value|i[xyz][xyz])="([0-9.]+)"', scaled, TWO_LINKS).replace('damping="0.4"', "")
    (folder / "arm.urdf").write_text(text)
    assert stiction("init", "arm.urdf").code == 0
    observer = read_spec("arm.yaml").observer
    assert observer is not None
    gains = -np.array([float(value) for value in observer.gains["K_2"]])
    cosine = np.cos(np.linspace(-2, 2, 401))
    coupled = scale * (0.05 + 0.2**2 + 0.5 * 0.2 * cosine)
    first = scale * (0.2 + 2 * 0.3**2 + 0.05 + 0.5**2 + 0.2**2 + 2 * 0.5 * 0.2 * cosine)
    mass = np.array([[first, coupled], [coupled, np.full_like(cosine, scale * (0.05 + 0.2**2))]]).transpose(2, 0, 1)
    fastest = np.linalg.eigvals(gains[:, None] * np.linalg.inv(mass)).real.max()
    assert fastest == pytest.approx(100 / 4, rel=0.05)  # s^2 + k s + k lambda has a double root at lambda = k/4
    assert stiction("generate", "arm.yaml").code == 0


def test_heavy_damping_gets_an_implicit_step(folder: Path) -> None:
    """Euler at 1 ms is unstable whatever K_2: damping over inertia is above 2000 1/s. `init` was silent."""
    (folder / "arm.urdf").write_text(TWO_LINKS.replace('damping="0.4"', 'damping="400"'))
    assert stiction("init", "arm.urdf").code == 0
    text = (folder / "arm.yaml").read_text()
    (limit,) = (float(n) for n in re.findall("integration: implicit .* euler, is stable below ([0-9.]+) ms only", text))

    def radius(of: str) -> float:
        (folder / "arm.yaml").write_text(of)
        return float(json.loads(stiction("derive", "arm.yaml", "--json").out)["spectral_radius"])

    euler = text.replace("integration: implicit", "integration: euler")
    assert radius(text) < 1 < radius(euler)
    assert radius(euler.replace("1 ms", f"{limit} ms")) < 1 < radius(euler.replace("1 ms", f"{1.15 * limit} ms"))
    assert "implicit" not in _of_light_damping(folder)


def _of_light_damping(folder: Path) -> str:
    (folder / "light.urdf").write_text(TWO_LINKS)
    assert stiction("init", "light.urdf").code == 0
    return (folder / "light.yaml").read_text()


def test_check_prints_the_tolerances_of_a_robot_file_and_no_fractions(folder: Path) -> None:
    """A tolerance of 500 %, or of 0, passed without a word; M22, a constant, was printed as a ratio of integers."""
    (folder / "arm.urdf").write_text(TWO_LINKS)
    tolerance = "{mass: 500 %, inertia: 0, damping: 50 %}"
    (folder / "arm.yaml").write_text(f"name: arm\nurdf: {{file: arm.urdf, tolerance: {tolerance}}}\n")
    out = stiction("check", "arm.yaml").out
    assert "robot file     arm.urdf, tolerance: mass 500 %, centre_of_mass 0 %, inertia 0 %" in out
    assert "[M21, 0.09]" in out  # 0.05 kg m^2 about the centre of mass, and 1 kg at 0.2 m
    assert "tolerance 50 %" in out


def test_a_column_in_counts_asks_for_their_size():
    found = guess_columns(["t", "elbow_pos_counts", "elbow_torque"], {"elbow": "elbow"})
    assert found.columns["elbow"] == "elbow_pos_counts"
    (said,) = [remark for remark in found.remarks if "counts by its name" in remark]
    assert said.startswith("elbow: `elbow_pos_counts`") and "`scale: {elbow: 2*pi/4096}`" in said


def test_a_weight_on_a_joint_is_printed_as_a_decimal(folder):
    """The weight of a vertical slide was printed as 10791/1000."""
    inertia = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    quill = f'<link name="quill"><inertial><mass value="1.1"/>{inertia}</inertial></link>'
    joint = '<joint name="z" type="prismatic"><parent link="base"/><child link="quill"/><axis xyz="0 0 1"/></joint>'
    Path("slide.urdf").write_text(f'<robot name="slide"><link name="base"/>{quill}{joint}</robot>')
    assert stiction("init", "slide.urdf").code == 0
    assert json.loads(stiction("check", "slide.yaml", "--json").out)["force"] == ["w_z - 10.791"]
