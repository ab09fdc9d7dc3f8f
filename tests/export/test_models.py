"""Exported models: what stands in the file, what is said of the rest, and what no file of another is replaced by."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from codegen.base.rotations import quaternion, roll_pitch_yaw
from codegen.effects.declare import system_of
from codegen.export.exporter import Remark
from codegen.export.friction_fit import fit_friction
from codegen.export.mechanism import SPEED, mechanism_of
from codegen.export.mjcf import build_mjcf
from codegen.mechanics.casadi_form import to_casadi
from codegen.simulate.closed_loop import simulate
from codegen.spec import read_spec
from codegen.spec.reader import parse_spec
from tests.app.command import SPECS, is_one_message, stiction
from tests.machines import axis, effect

ARM = SPECS / "seven_joint_arm.yaml"
JOINTS = {"shoulder_yaw": (400, 20), "shoulder_pitch": (800, 20), "arm_roll": (150, 8), "elbow_pitch": (200, 8)}
JOINTS |= {"forearm_roll": (30, 1.5), "wrist_pitch": (20, 1), "hand_roll": (3, 0.1)}
DRIVE = f"""
simulation:
  duration: 1
  sample_time: 0.001
  reference: {{{", ".join(f"{name}: 0.4*sin({5 + k}*t)" for k, name in enumerate(JOINTS))}}}
  position_gain: {{{", ".join(f"w_{name}: {gain}" for name, (gain, _) in JOINTS.items())}}}
  velocity_gain: {{{", ".join(f"w_{name}: {gain}" for name, (_, gain) in JOINTS.items())}}}
"""


def remarks(path: Path, to: str, out: Path) -> dict[str, Remark]:
    done = stiction("export", path, "--to", to, "-o", out, "--json")
    assert done.code == 0, done.err
    found = [Remark(**r) for r in json.loads(done.out)["remarks"]]
    return {r.where: r for r in found}


def spec_file(tmp_path: Path, **given: str) -> Path:
    path = tmp_path / "axis.yaml"
    path.write_text(axis(**given)[0].text, "utf-8")
    return path


def arm(tmp_path: Path, more: str = "") -> Path:
    """The shipped arm with its robot file, in a folder of its own."""
    for source in (ARM, ARM.with_suffix(".urdf")):
        (tmp_path / source.name).write_text(source.read_text("utf-8"), "utf-8")
    path = tmp_path / ARM.name
    path.write_text(path.read_text("utf-8") + more, "utf-8")
    return path


def test_a_robot_s_rigid_body_model_is_mujoco_s() -> None:
    """M(x) and the bias force at random states, ours and those that MuJoCo has for the exported model."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    casadi = pytest.importorskip("casadi")
    spec = read_spec(ARM)
    system = system_of(spec)
    model = mujoco.MjModel.from_xml_string(build_mjcf(spec, mechanism_of(spec, system), []).text)
    data, rng = mujoco.MjData(model), np.random.default_rng(3)
    n = model.nv
    assert [model.joint(k).name for k in range(n)] == list(spec.positions)
    x, v = casadi.SX.sym("x", n), casadi.SX.sym("v", n)
    names = {s: casadi.SX(float(value)) for s, value in system.values.items()}
    names |= {s: x[k] for k, s in enumerate(system.positions)} | {s: v[k] for k, s in enumerate(system.velocities)}
    names |= dict.fromkeys(system.inputs, casadi.SX(0))
    parts = [to_casadi(system.mass_matrix, names), to_casadi(system.force, names)]
    ours = casadi.Function("ours", [x, v], [casadi.densify(p) for p in parts])
    for _ in range(10):
        data.qpos[:], data.qvel[:] = rng.uniform(-2, 2, n), rng.uniform(-2, 2, n)
        mujoco.mj_forward(model, data)
        mass = np.zeros((n, n))
        mujoco.mj_fullM(model, data, mass)
        expected, force = (np.asarray(part.full()) for part in ours(data.qpos, data.qvel))
        assert np.allclose(mass, expected, rtol=1e-9, atol=1e-12)
        assert np.allclose(-data.qfrc_bias, force.ravel(), rtol=1e-9, atol=1e-9)


def test_a_robot_moves_alike(tmp_path: Path) -> None:
    """Seven joints with friction under control, each with a reversal every half of its period."""
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    from codegen.export.mujoco_plant import mujoco_plant

    spec = read_spec(arm(tmp_path, DRIVE))
    system = system_of(spec)
    maker, _ = mujoco_plant(spec, system)
    ours, theirs = simulate(spec, system), simulate(spec, system, make_plant=maker)
    apart = np.abs(ours.true_positions - theirs.true_positions).max(axis=0)
    assert (apart < 1e-3 * np.ptp(ours.true_positions, axis=0)).all()
    forces = np.abs(ours.contact_forces - theirs.contact_forces)
    assert (np.median(forces, axis=0) < 0.01 * np.abs(ours.contact_forces).max(axis=0)).all()


def test_the_contact_forces_of_both_plants_agree() -> None:
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    from codegen.export.mujoco_plant import mujoco_plant

    for given in (
        {"effects": effect("viscous", "rail", b=2)},
        {"effects": effect("stribeck", "rail", delta=1, v_s=0.3)},
    ):
        spec, system = axis(**given)
        maker, _ = mujoco_plant(spec, system)
        ours, theirs = simulate(spec, system), simulate(spec, system, make_plant=maker)
        assert np.median(np.abs(ours.contact_forces - theirs.contact_forces)) < 5e-3 * np.abs(ours.contact_forces).max()


def test_simulate_takes_mujoco_as_its_plant(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    path, logs = spec_file(tmp_path), [tmp_path / "own.csv", tmp_path / "mujoco.csv"]
    for plant, log in zip(("own", "mujoco"), logs, strict=True):
        assert stiction("simulate", path, "-o", log, "--plant", plant).code == 0
    noted = stiction(
        "simulate", spec_file(tmp_path, effects=effect("dead_zone", "w", width=1)), "-o", logs[1], "--plant", "mujoco"
    )
    assert "note: the plant is MuJoCo's: input w: dropped: a dead zone" in noted.err
    path = spec_file(tmp_path)
    assert stiction("simulate", path, "-o", logs[1], "--plant", "mujoco").code == 0
    own, other = (np.loadtxt(log, delimiter=",", skiprows=1) for log in logs)
    assert np.abs(own - other).max() < 1e-3
    assert is_one_message(stiction("simulate", path, "-o", logs[0], "--plant", "gazebo"))


def test_without_mujoco_one_message_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("codegen.export.mujoco_plant.find_spec", lambda name: None)
    done = stiction("simulate", spec_file(tmp_path), "-o", tmp_path / "log.csv", "--plant", "mujoco")
    assert is_one_message(done) and "stiction[mujoco]" in done.err
    assert not (tmp_path / "log.csv").exists()


def test_stribeck_in_urdf_costs_what_the_remark_says(tmp_path: Path) -> None:
    """The file's own damping and friction, held against the law over the envelope's speeds by hand."""
    path = spec_file(tmp_path, law="law: gaussian, F_c: 3, F_s: 4.5, F_v: 0.7, v_s: 0.2")
    told = remarks(path, "urdf", tmp_path / "axis.urdf")["friction on x"]
    dynamics = etree.parse(tmp_path / "axis.urdf").find(".//dynamics")
    damping, friction = float(dynamics.get("damping")), float(dynamics.get("friction"))
    s = np.linspace(0, 2, 200_001)[1:]
    error = friction + damping * s - (3 + 1.5 * np.exp(-((s / 0.2) ** 2)) + 0.7 * s)
    assert told.held == "nearest"
    assert told.worst == pytest.approx(np.abs(error).max(), rel=2e-2)
    assert told.rms == pytest.approx(np.sqrt(np.mean(error**2)), rel=2e-2)
    # No other pair of a friction and a damping is nearer: the least squares of NumPy.
    best = np.linalg.lstsq(np.column_stack([np.ones_like(s), s]), error + 0.0, rcond=None)[0]
    assert np.abs(best).max() < 1e-2


def test_what_simulators_lack_is_dropped_with_its_size(tmp_path: Path) -> None:
    cogging = effect("cogging", "x", amplitude=2, period=0.1, phase=0.7)
    path = spec_file(tmp_path, effects=cogging)
    assert remarks(path, "mjcf", tmp_path / "a.xml")["periodic force along x"].held == "exact"
    lost = remarks(path, "sdf", tmp_path / "a.sdf")["force on x"]
    assert lost.held == "dropped" and lost.worst == pytest.approx(2, rel=1e-3)
    assert lost.rms == pytest.approx(np.sqrt(2), rel=3e-2)


PENDULUM = """name: pendulum
coordinates: {q: {velocity: om, unit: rad}}
inputs: {u: {unit: N*m}}
parameters: {J: {value: 0.1, unit: kg*m^2}, G: {value: 2, unit: N*m}}
mass_matrix: [[J]]
force: [u - G*sin(TURNS*q)]
friction: {distribution: [[1]], contacts: [{name: joint, a: 0.3, unit: N*m}]}
"""


@pytest.mark.parametrize("to", ["urdf", "sdf"])
def test_a_weight_is_said_to_belong_into_the_inertial(tmp_path: Path, to: str) -> None:
    """It was called a periodic force. Twelve periods a turn are no weight."""
    for turns, weight in ((1, True), (12, False)):
        path = tmp_path / "pendulum.yaml"
        path.write_text(PENDULUM.replace("TURNS", str(turns)), "utf-8")
        how = remarks(path, to, tmp_path / f"a{turns}.{to}")["force on q"].how
        assert "depends on the position" in how
        assert ("mass" in how and "inertial" in how) == weight


def test_a_level_that_changes_leaves_its_mean(tmp_path: Path) -> None:
    """Friction that settles: delta exp(−t/T) over the 2 s of the simulation, mean (1 − exp(−2))/2 with T = 1 s."""
    path = spec_file(tmp_path, effects=effect("friction_drift", "rail", delta=2, T=1))
    told = remarks(path, "mjcf", tmp_path / "a.xml")
    mean = 2 * (1 - np.exp(-2)) / 2
    assert told["the contact rail"].held == "nearest"
    assert told["the contact rail"].worst == pytest.approx(2 - mean, rel=2e-2)
    loss = float(etree.parse(tmp_path / "a.xml").find(".//body/joint").get("frictionloss"))
    assert loss == pytest.approx(3 + mean, rel=1e-2)


@pytest.mark.parametrize(
    "line",
    [effect("dead_zone", "w", width=1), effect("encoder_eccentricity", "x", amplitude=0.001, period=0.1, phase=0)],
)
def test_what_no_model_holds_is_said(tmp_path: Path, line: str) -> None:
    path = spec_file(tmp_path, effects=line)
    for to, file in (("mjcf", "a.xml"), ("urdf", "a.urdf"), ("sdf", "a.sdf")):
        assert "dropped" in {r.held for r in remarks(path, to, tmp_path / file).values()}
        assert ": dropped: " in (tmp_path / file).read_text("utf-8")


def test_a_polynomial_is_exact_and_a_fit_never_drives() -> None:
    speeds = np.linspace(0.001, 2, 500)
    exact = fit_friction(2 + SPEED / 2 + SPEED**3, speeds, 3, True)
    assert exact.exact and exact.terms.level == 2 and exact.terms.damping == (0.5, 0, 1)
    import sympy

    falling = fit_friction(5 * sympy.exp(-SPEED), speeds, 1, False)
    assert not falling.exact and falling.terms.level >= 0 and min(falling.terms.damping) >= 0


def test_an_edited_robot_file_keeps_the_rest(tmp_path: Path) -> None:
    """Every byte but the values of damping, friction and effort; unknown elements, comments and quotes stay."""
    path = arm(
        tmp_path,
        "effects:\n  - {kind: saturation, on: w_elbow_pitch, parameters: {limit: 33}}\n"
        "  - {kind: viscous, on: hand_roll, parameters: {b: 0.25}}\n",
    )
    robot = path.with_suffix(".urdf")
    text = robot.read_text("utf-8").replace("<robot name=", "<robot   xmlns:x='urn:x' name=", 1)
    text = text.replace(
        '<dynamics damping="0.1" friction="0.35"/>', "<dynamics damping='0.1' friction='0.35' x:note='a > b'/>"
    )
    text = text.replace('effort="150"', 'effort="strong"', 1)
    text = text.replace('<link name="base">', '<!-- kept --><x:strange a="&lt;1"/><link name="base">')
    robot.write_text(text, "utf-8")
    remarks(path, "urdf", tmp_path / "out.urdf")
    written = (tmp_path / "out.urdf").read_text("utf-8")
    after = written[written.index("-->\n") + 4 :]
    expected = text.partition("?>")[2].lstrip()
    expected = expected.replace(
        "<dynamics damping='0.1' friction='0.35' x:note='a > b'/>",
        """<dynamics damping="0.35" friction='0.35' x:note='a > b'/>""",
    )
    limit = next(
        line
        for line in expected.splitlines()
        if "<limit" in line and expected.index(line) > expected.index('joint name="elbow_pitch"')
    )
    effort = limit[limit.index('effort="') :].split('"')[1]
    start = expected.index(limit, expected.index('joint name="elbow_pitch"'))
    expected = expected[:start] + limit.replace(f'effort="{effort}"', 'effort="33"') + expected[start + len(limit) :]
    assert after == expected


def test_a_file_of_another_is_not_replaced(tmp_path: Path) -> None:
    path, out = spec_file(tmp_path), tmp_path / "model.xml"
    out.write_text("<mujoco/>")
    assert is_one_message(stiction("export", path, "--to", "mjcf", "-o", out))
    assert out.read_text() == "<mujoco/>"
    out.unlink()
    for _ in range(2):
        assert stiction("export", path, "--to", "mjcf", "-o", out).code == 0
    for name in ("axis.yaml", "model.txt"):
        assert is_one_message(stiction("export", path, "--to", "mjcf", "-o", tmp_path / name))
    assert is_one_message(stiction("export", path, "--to", "mjfc", "-o", out))
    assert is_one_message(stiction("export", arm(tmp_path), "--to", "urdf", "-o", tmp_path / "seven_joint_arm.urdf"))


@pytest.mark.parametrize("name", ["two_link_arm", "thesis/rig_to"])
def test_a_machine_without_bodies_is_refused_with_the_reason(tmp_path: Path, name: str) -> None:
    done = stiction("export", SPECS / f"{name}.yaml", "--to", "mjcf", "-o", tmp_path / "a.xml")
    if name == "two_link_arm":
        assert is_one_message(done) and "depends on the position" in done.err and "urdf:" in done.err
    else:
        assert done.code == 0


def test_text_of_a_user_cannot_leave_its_comment(tmp_path: Path) -> None:
    path = tmp_path / "a--b--.yaml"
    path.write_text(axis()[0].text, "utf-8")
    for to, file in (("mjcf", "a.xml"), ("urdf", "a.urdf"), ("sdf", "a.sdf")):
        remarks(path, to, tmp_path / file)
        comments = [c.text for c in etree.parse(tmp_path / file).xpath("//comment()")]
        assert len(comments) == 1 and "a- -b- -.yaml" in comments[0]


def test_rotations_as_quaternions_and_angles() -> None:
    """Against the matrix made of them: random rotations, and half and quarter turns about each axis."""
    rng = np.random.default_rng(1)
    turns = [np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(20)]
    turns = [r * np.sign(np.linalg.det(r)) for r in turns]
    for a in ([1, 0, 0], [0, 1, 0], [0, 0, 1]):
        k = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]], dtype=float)
        turns += [np.eye(3) + s * k + (1 - c) * k @ k for s, c in ((0, -1), (1, 0), (-1, 0))]
    for r in turns:
        w, x, y, z = quaternion(r)
        k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        assert np.allclose(np.eye(3) + 2 * w * k + 2 * k @ k, r)
        (sr, cr), (sp, cp), (sy, cy) = [(np.sin(t), np.cos(t)) for t in roll_pitch_yaw(r)]
        about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
        about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        assert np.allclose(about_z @ about_y @ about_x, r, atol=1e-9)


def test_a_robot_file_in_urdf_and_sdf_has_the_bodies_of_the_tree(tmp_path: Path) -> None:
    """The URDF of a machine without a robot file, read back, is the same machine."""
    path = spec_file(tmp_path, effects=effect("viscous", "rail", b=2))
    remarks(path, "urdf", tmp_path / "axis.urdf")
    again = parse_spec("name: again\nurdf: axis.urdf\n", tmp_path / "again.yaml")
    back = system_of(again)
    assert float(back.mass_matrix[0, 0]) == 2 and float(back.values[back.contacts[0].law_parameters["a"]]) == 3
    assert [e.parameters["b"] for e in again.effects] == [2]
    path = arm(tmp_path)
    remarks(path, "sdf", tmp_path / "arm.sdf")
    model = etree.parse(tmp_path / "arm.sdf").find("model")
    robot = etree.parse(path.with_suffix(".urdf"))
    for joint in robot.findall("joint"):
        if joint.get("type") == "fixed":
            continue
        found = model.find(f"joint[@name='{joint.get('name')}']")
        dynamics = joint.find("dynamics")
        assert float(found.find("axis/dynamics/damping").text) == float(dynamics.get("damping"))
        assert float(found.find("axis/dynamics/friction").text) == float(dynamics.get("friction"))
        parts = [float(p) for p in found.find("pose").text.split()]
        origin = [float(p) for key in ("xyz", "rpy") for p in joint.find("origin").get(key).split()]
        assert np.allclose(parts, origin, atol=1e-12)


def test_a_flat_body_loads(tmp_path: Path) -> None:
    """A plate whose principal moments are at the edge of what a body can have, and one beyond it by rounding."""
    from codegen.export.bodies import physical_inertia

    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    for moments in ([1.0, 2.0, 3.0], [1.0, 2.0, 3.0009]):
        given = turn @ np.diag(moments) @ turn.T
        found = np.linalg.eigvalsh(physical_inertia(given))
        assert found[2] <= found[0] + found[1] and np.abs(physical_inertia(given) - given).max() < 1e-3
    assert (physical_inertia(np.diag([1.0, 2.0, 2.5])) == np.diag([1.0, 2.0, 2.5])).all()
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    body = '<link name="{0}"><inertial><mass value="1"/><inertia {1}/></inertial></link>'
    flat = 'ixx="0.01" iyy="0.02" izz="0.03002" ixy="0" ixz="0" iyz="0"'
    robot = f"""<robot name="r">{body.format("base", flat)}{body.format("plate", flat)}
    <joint name="j" type="revolute"><parent link="base"/><child link="plate"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
    (tmp_path / "r.urdf").write_text(robot)
    (tmp_path / "r.yaml").write_text("name: r\nurdf: r.urdf\n")
    remarks(tmp_path / "r.yaml", "mjcf", tmp_path / "r.xml")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "r.xml")).nv == 1


@pytest.mark.parametrize(("envelope", "half"), [("x: [-0.02, 0.02], ", 0.02), ("", 1.0)])
def test_the_error_of_a_spring_is_over_the_envelope_or_over_what_is_said(
    tmp_path: Path, envelope: str, half: float
) -> None:
    path = tmp_path / "axis.yaml"
    text = (SPECS / "one_mass.yaml").read_text("utf-8").replace("  - w\n", "  - w - k*x\n")
    text = text.replace("parameters:\n", "parameters:\n  k: {value: 30, unit: N/m}\n")
    path.write_text(text.replace("  v: [-5, 5]", f"  v: [-5, 5]\n  {envelope.rstrip(', ')}"), "utf-8")
    lost = remarks(path, "urdf", tmp_path / "axis.urdf")["force on x"]
    assert lost.worst == pytest.approx(30 * half, rel=1e-2)
    assert lost.rms == pytest.approx(30 * half / np.sqrt(3), rel=3e-2)
    assert ("over x in [-1, 1] m, assumed" in lost.how) == (not envelope)
