"""Exported USD scenes: masses, joints and friction as they stand in the text, and as Newton reads them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from codegen.export import usd
from codegen.export.bodies import principal
from tests.app.command import SPECS, stiction
from tests.machines import effect

from .test_models import arm, remarks, spec_file

ROTOR = "effects: [{kind: inertia_error, on: elbow_pitch, parameters: {delta: 0.3}}]\n"
NUMBER = r"[-+0-9.e]+"


def prims(text: str) -> dict[str, dict[str, list[float] | str]]:
    """Path of a prim → its attributes; numbers as lists."""
    found: dict[str, dict[str, list[float] | str]] = {}
    path: list[str] = []
    for line in text.splitlines():
        opened = re.match(r'\s*def \w+ "(\w+)"', line)
        if opened:
            path.append(opened[1])
            found["/".join(path)] = {}
        elif line.strip() == "}":
            path.pop()
        elif path and (rel := re.match(r"\s*rel ([\w:]+) = </(.*)>", line)):
            found["/".join(path)][rel[1]] = rel[2]
        elif path and (said := re.match(r"\s*(?:uniform )?[\w\[\]]+ ([\w:]+) = (.*)", line)):
            number = re.fullmatch(rf"\(?({NUMBER}(?:, {NUMBER})*)\)?", said[2])
            found["/".join(path)][said[1]] = [float(x) for x in number[1].split(",")] if number else said[2]
    return found


def turn(q: list[float]) -> np.ndarray:
    w, *v = np.array(q) / np.linalg.norm(q)
    k = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * w * k + 2 * k @ k


def mass_matrix_of(scene: dict[str, dict], joints: list[str]) -> Callable[[np.ndarray], np.ndarray]:
    """M(q) of the scene's numbers: Σ m J'J + R'IR of bodies on hinges along the x axis of each joint's frame."""

    def mass_matrix(q: np.ndarray) -> np.ndarray:
        n = len(joints)
        total = np.diag([scene[j]["newton:armature"][0] for j in joints])
        pose = {scene[joints[0]]["physics:body0"]: (np.eye(3), np.zeros(3), np.zeros((3, n)), [])}
        for k, name in enumerate(joints):
            joint = scene[name]
            r, p, spin, axes = pose[joint["physics:body0"]]
            frame = r @ turn(joint["physics:localRot0"])
            at = p + r @ np.array(joint["physics:localPos0"])
            c, s = np.cos(q[k]), np.sin(q[k])
            here = frame @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ turn(joint["physics:localRot1"]).T
            spin = spin.copy()
            spin[:, k] = frame[:, 0]
            axes = [*axes, (k, frame[:, 0], at)]
            body = scene[joint["physics:body1"]]
            centre = at + here @ np.array(body["physics:centerOfMass"])
            jacobian = np.zeros((3, n))
            for i, axis, origin in axes:
                jacobian[:, i] = np.cross(axis, centre - origin)
            about = here @ turn(body["physics:principalAxes"])
            inertia = about @ np.diag(body["physics:diagonalInertia"]) @ about.T
            total += body["physics:mass"][0] * jacobian.T @ jacobian + spin.T @ inertia @ spin
            pose[joint["physics:body1"]] = here, at, spin, axes
            if not q.any():
                assert np.allclose(body["xformOp:translate"], at, atol=1e-6)
                assert np.allclose(turn(body["xformOp:orient"]), here, atol=1e-6)
        return total

    return mass_matrix


def written(tmp_path: Path) -> tuple[Path, Path]:
    """The shipped arm with a rotor at its elbow, as USD and as MJCF."""
    path = arm(tmp_path, ROTOR)
    for to, file in (("usd", "arm.usda"), ("mjcf", "arm.xml")):
        done = stiction("export", path, "--to", to, "-o", tmp_path / file)
        assert done.code == 0, done.err
    return tmp_path / "arm.usda", tmp_path / "arm.xml"


def test_the_mass_matrix_is_mujoco_s(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    scene_file, mjcf = written(tmp_path)
    scene, model = prims(scene_file.read_text()), mujoco.MjModel.from_xml_path(str(mjcf))
    joints = [f"seven_joint_arm/joints/{model.joint(k).name}" for k in range(model.nv)]
    ours, data = mass_matrix_of(scene, joints), mujoco.MjData(model)
    rng = np.random.default_rng(2)
    for q in [np.zeros(model.nv), *rng.uniform(-2, 2, (5, model.nv))]:
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        assert np.allclose(ours(q), mass, rtol=1e-5, atol=1e-5)
    for k, name in enumerate(joints):
        own = scene[name]
        assert own["newton:damping"][0] * 180 / np.pi == pytest.approx(float(np.ravel(model.dof_damping[k])[0]))
        assert own["newton:friction"][0] == pytest.approx(float(model.dof_frictionloss[k]))
        physx = {
            key.rpartition(":")[2]: value for key, value in own.items() if key.startswith("physxJointAxis:angular")
        }
        assert physx["armature"] == own["newton:armature"]
        assert physx["staticFrictionEffort"] == physx["dynamicFrictionEffort"] == own["newton:friction"]
        assert physx["viscousFrictionCoefficient"] == own["newton:damping"]
    assert scene["seven_joint_arm/joints/elbow_pitch"]["newton:armature"] == [pytest.approx(0.3)]
    assert scene["physicsScene"]["physics:gravityMagnitude"] == [pytest.approx(9.81)]


def test_a_sliding_mass_and_what_is_not_held(tmp_path: Path) -> None:
    """A slide's damping is per metre; a limit is the drive's; cogging is lost, with its error."""
    path = spec_file(
        tmp_path,
        effects="[{kind: viscous, on: rail, parameters: {b: 2}}, {kind: saturation, on: w, parameters: {limit: 8}},"
        + effect("cogging", "x", amplitude=0.5, period=0.1, phase=0)[1:],
    )
    said = remarks(path, "usd", tmp_path / "a.usda")
    scene = prims((tmp_path / "a.usda").read_text())
    joint = scene["axis/joints/x"]
    assert joint["newton:damping"] == joint["physxJointAxis:linear:viscousFrictionCoefficient"] == [2.0]
    assert joint["newton:friction"] == [3.0] and joint["drive:linear:physics:maxForce"] == [8.0]
    assert scene["axis/x_link"]["physics:mass"] == [2.0]
    assert said["force on x"].held == "dropped" and said["force on x"].worst == pytest.approx(30.5, rel=0.02)
    assert said["gravity"].held == "nearest" and scene["physicsScene"]["physics:gravityMagnitude"] == [0.0]


def test_an_inertia_below_zero_is_dropped(tmp_path: Path) -> None:
    path = arm(tmp_path, ROTOR.replace("0.3", "-0.01"))
    said = remarks(path, "usd", tmp_path / "a.usda")
    assert said["inertia of elbow_pitch"].held == "dropped"
    assert prims((tmp_path / "a.usda").read_text())["seven_joint_arm/joints/elbow_pitch"]["newton:armature"] == [0.0]


def test_principal_axes() -> None:
    """Moments and axes give the tensor again: random tensors, equal moments, and one that is diagonal already."""
    rng = np.random.default_rng(4)
    for moments in ([1, 2, 2.5], [1, 1, 1.5], [2, 2, 2], [1e-5, 2e-5, 2.5e-5]):
        r = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        given = r @ np.diag(moments) @ r.T
        found, axes = principal(given)
        assert np.allclose(found, moments, rtol=1e-9)
        assert np.allclose(axes @ np.diag(found) @ axes.T, given, rtol=0, atol=1e-12 * max(moments))
        assert np.linalg.det(axes) == pytest.approx(1)
    assert (principal(np.diag([3.0, 1, 2]))[1] == [[0, 0, 1], [1, 0, 0], [0, 1, 0]]).all()


def test_a_frame_whose_x_axis_is_the_joint_s() -> None:
    axes = [*np.eye(3), *-np.eye(3), *np.random.default_rng(6).normal(size=(20, 3))]
    for axis in (np.array(a) / np.linalg.norm(a) for a in axes):
        frame = usd._from_x(axis)
        assert np.allclose(frame[:, 0], axis) and np.allclose(frame @ frame.T, np.eye(3))
        assert np.linalg.det(frame) == pytest.approx(1)


@pytest.mark.slow
def test_newton_reads_it(tmp_path: Path) -> None:
    """M(q), armature, damping in N m s/rad and friction, as Newton's own reader of USD has them."""
    newton = pytest.importorskip("newton", reason="Newton is not installed")
    pytest.importorskip("newton_usd_schemas", reason="its USD schemas are not installed")
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed")
    scene_file, mjcf = written(tmp_path)
    builder = newton.ModelBuilder()
    builder.add_usd(str(scene_file))
    model, theirs = builder.finalize(device="cpu"), mujoco.MjModel.from_xml_path(str(mjcf))
    n = theirs.nv
    assert [label.rpartition("/")[2] for label in model.joint_label[1:]] == [theirs.joint(k).name for k in range(n)]
    assert np.allclose(model.joint_damping.numpy(), np.ravel(theirs.dof_damping.reshape(n, -1)[:, 0]), rtol=1e-6)
    assert np.allclose(model.joint_friction.numpy(), theirs.dof_frictionloss, rtol=1e-6)
    assert np.allclose(model.joint_armature.numpy(), theirs.dof_armature, rtol=1e-6)
    assert np.allclose(model.gravity.numpy(), [0, 0, -9.81])
    data, state = mujoco.MjData(theirs), model.state()
    for q in np.random.default_rng(3).uniform(-2, 2, (4, n)):
        data.qpos[:] = q
        mujoco.mj_forward(theirs, data)
        mass = np.zeros((n, n))
        mujoco.mj_fullM(theirs, data, mass)
        state.joint_q.assign(q.astype(np.float32))
        newton.eval_fk(model, state.joint_q, state.joint_qd, state)
        assert np.allclose(newton.eval_mass_matrix(model, state).numpy()[0][:n, :n], mass, rtol=1e-4, atol=1e-4)


@pytest.mark.slow
def test_the_usd_library_reads_it(tmp_path: Path) -> None:
    usd_library = pytest.importorskip("pxr", reason="usd-core is not installed")
    from pxr import Usd, UsdPhysics

    assert usd_library
    scene_file, _ = written(tmp_path)
    stage = Usd.Stage.Open(str(scene_file))
    robot = stage.GetDefaultPrim()
    assert robot.HasAPI(UsdPhysics.ArticulationRootAPI)
    joints = [p for p in stage.Traverse() if p.IsA(UsdPhysics.RevoluteJoint)]
    assert [p.GetName() for p in joints] == list(_positions())
    for p in joints:
        joint = UsdPhysics.RevoluteJoint(p)
        (inner,), (outer,) = joint.GetBody0Rel().GetTargets(), joint.GetBody1Rel().GetTargets()
        assert stage.GetPrimAtPath(inner) and stage.GetPrimAtPath(outer).HasAPI(UsdPhysics.RigidBodyAPI)
        assert UsdPhysics.DriveAPI(p, "angular") and "NewtonJointAPI" in p.GetAppliedSchemas()


def _positions() -> tuple[str, ...]:
    from codegen.spec import read_spec

    return read_spec(SPECS / "seven_joint_arm.yaml").positions
