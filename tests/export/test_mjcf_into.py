"""A MuJoCo model → spec → the same model: untouched where nothing was found, and with the friction where it was."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.app.command import is_one_message, stiction

mujoco = pytest.importorskip("mujoco", reason="needs the extra mujoco")

MODEL = """<?xml version="1.0"?>
<!-- an arm of somebody's -->
<mujoco model='mine'>
  <compiler angle="degree"/>   <option timestep="0.001" integrator="implicitfast"/>
  <default><default class="geared"><joint damping="0.1" armature="0.02" frictionloss="0.3"/></default></default>
  <asset><texture name="sky" type="skybox" builtin="gradient" width="8" height="8"/></asset>
  <worldbody>
    <light pos="0 0 3"/>
    <body name="upper" pos="0 0 0.5"><camera name="eye"/>
      <joint   name = "shoulder-pan" class="geared" axis="0 1 0"
               range="-90 90" limited="true" />
      <geom type="capsule" size="0.02" fromto="0 0 0 0.2 0 0" mass="0.4" rgba="1 0 0 1"/>
      <body name="fore" pos="0.2 0 0">
        <joint name='elbow' axis="0 1 0" damping='0.03' frictionloss="0.05" stiffness="2" springref="30"></joint>
        <geom type="capsule" size="0.015" fromto="0 0 0 0.15 0 0" mass="0.2"/>
      </body>
    </body>
  </worldbody>
  <tendon><fixed name="both"><joint joint="shoulder-pan" coef="1"/><joint joint="elbow" coef="-1"/></fixed></tendon>
  <actuator>
    <motor name="m1" joint="shoulder-pan" gear="30"/>
    <position name="m2" joint="elbow" kp="20"/>
  </actuator>
  <sensor><jointpos joint="elbow"/></sensor>
  <keyframe><key name="home" qpos="0.1 0.2"/></keyframe>
</mujoco>
<!-- the end -->
"""
COMMENT = re.compile(r"<!--\s+Written by stiction export.*?-->\n", re.DOTALL)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.xml").write_text(MODEL)
    made = stiction("init", "arm.xml")
    assert made.code == 0, made.err
    return tmp_path


def into(out: str = "new.xml", spec: str = "arm.yaml") -> str:
    done = stiction("export", spec, "--to", "mjcf", "--into", "arm.xml", "-o", out)
    assert done.code == 0, done.err
    text = Path(out).read_text()
    mujoco.MjModel.from_xml_path(out)
    return text


def arrays(path: str) -> dict[str, np.ndarray]:
    model = mujoco.MjModel.from_xml_path(path)
    return {name: np.array(getattr(model, name)) for name in dir(model) if isinstance(getattr(model, name), np.ndarray)}


def test_what_is_not_changed_is_byte_for_byte_the_same(folder: Path) -> None:
    text = into()
    assert COMMENT.sub("", text) == MODEL and len(COMMENT.findall(text)) == 1
    assert (folder / "arm.xml").read_text() == MODEL
    assert COMMENT.sub("", into()) == MODEL  # over our own
    (folder / "arm.xml").write_text(long := MODEL.replace("<!-- an arm", "<!--" + 5000 * " " + "\n an arm"))
    assert COMMENT.sub("", into()) == COMMENT.sub("", into()) == long


def test_found_friction_is_written_and_nothing_else(folder: Path) -> None:
    """Levels as a diagnosis writes them; every other array of the compiled model stays."""
    spec = (folder / "arm.yaml").read_text()
    effects = "effects:\n  - {kind: viscous, on: elbow, parameters: {b: 0.02}}\n"
    assert "effects:" in spec
    added = re.sub(r"^effects:[^\n]*\n", effects, spec, count=1, flags=re.MULTILINE)
    added = added.replace("delta: 0.02", "delta: 0.035")
    (folder / "found.yaml").write_text(added)
    text = COMMENT.sub("", into("found.xml", "found.yaml"))
    changed = [(a, b) for a, b in zip(MODEL.splitlines(), text.splitlines(), strict=True) if a != b]
    assert [b for _, b in changed] == [
        changed[0][0].replace(" />", ' armature="0.035" />'),
        changed[1][0].replace("damping='0.03'", 'damping="0.05"'),
    ]
    before, after = arrays("arm.xml"), arrays("found.xml")
    different = {name for name in before if not np.array_equal(before[name], after[name])}
    assert {"dof_damping", "dof_armature"} <= different
    assert np.allclose(after["dof_damping"], [0.1, 0.05]) and np.allclose(after["dof_armature"], [0.035, 0])
    # What MuJoCo computes of the armature, and where texts lie.
    assert different <= {"dof_damping", "dof_armature", "dof_M0", "dof_invweight0", "body_invweight0", "text_data",
                         "actuator_acc0", "tendon_invweight0", "dof_solimp", "dof_solref", "paths"}  # fmt: skip


def test_cogging_and_lugre_are_added_behind_the_actuators(folder: Path) -> None:
    spec = (folder / "arm.yaml").read_text()
    cogging = "  - {kind: cogging, on: elbow, parameters: {amplitude: 0.06, period: 24 deg, phase: 0.3}}\n"
    (folder / "found.yaml").write_text(
        re.sub(r"(^effects:[^\n]*\n)", rf"\1{cogging}", spec, count=1, flags=re.MULTILINE)
    )
    text = COMMENT.sub("", into("found.xml", "found.yaml"))
    head, _, tail = MODEL.partition("</mujoco>")
    assert text.startswith(head) and text.endswith("</mujoco>" + tail)
    model = mujoco.MjModel.from_xml_path("found.xml")
    assert [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, k) for k in (0, 1)] == ["m1", "m2"]
    data = mujoco.MjData(model)
    plain = mujoco.MjModel.from_xml_path("arm.xml")
    other = mujoco.MjData(plain)
    for angle in np.linspace(-1, 1, 7):  # the generalised force that the model has besides is that of the effect
        for m, d in ((model, data), (plain, other)):
            d.qpos[:] = 0.1, angle
            mujoco.mj_forward(m, d)
        force = (data.qfrc_actuator + data.qfrc_passive) - (other.qfrc_actuator + other.qfrc_passive)
        assert np.allclose(force, [0, 0.06 * np.sin(15 * angle + 0.3)], atol=1e-12)


def test_a_joint_that_is_missing_or_elsewhere_is_told(folder: Path) -> None:
    (folder / "other.xml").write_text(MODEL.replace("elbow", "elbows"))
    told = stiction("export", "arm.yaml", "--to", "mjcf", "--into", "other.xml", "-o", "new.xml")
    assert is_one_message(told) and "no joint for the coordinate elbow" in told.err and "'elbows'" in told.err
    inner = MODEL[MODEL.index("    <body name=") : MODEL.index("  </worldbody>")]
    other = inner.replace('limited="true"', 'limited="true" damping="1"')
    (folder / "inner.xml").write_text(f"<mujoco>\n{other}</mujoco>\n")
    (folder / "outer.xml").write_text(MODEL.replace(inner, '    <include file="inner.xml"/>\n'))
    told = stiction("export", "arm.yaml", "--to", "mjcf", "--into", "outer.xml", "-o", "new.xml")
    assert is_one_message(told) and 'the joint "shoulder-pan" is not written there' in told.err
    for more in (("--to", "mjcf", "-o", "arm.xml"), ("--to", "urdf", "-o", "new.urdf")):
        assert is_one_message(stiction("export", "arm.yaml", "--into", "arm.xml", *more))
    assert is_one_message(stiction("export", "arm.yaml", "--to", "mjcf", "--into", "none.xml", "-o", "new.xml"))
    assert (folder / "arm.xml").read_text() == MODEL and not (folder / "new.xml").exists()


SLIDE = """<mujoco><worldbody><body><joint name="x" type="slide" axis="1 0 0" armature="0.5"/>
<geom type="sphere" size="0.1" mass="12"/></body></worldbody></mujoco>
"""
GEARED = """name: axis
coordinates: {x: {velocity: v, unit: m}}
inputs: {w: {unit: N}}
parameters: {m: {value: 12, unit: kg}, J: {value: 0.0159, unit: kg*m^2}, r: {value: 0.03, unit: m}}
mass_matrix: [[m + J/r**2]]
force: [w]
friction: {distribution: [[1]], contacts: [{name: rail, law: coulomb, a: 5, unit: N}]}
observer: {kind: cfo, velocity: measured, gains: {K_F: 10}, sample_time: 0.001}
envelope: {v: [-1, 1]}
"""


@pytest.mark.parametrize(
    ("effects", "factor"), [("[]", 1.0), ("[{kind: inertia_error, on: x, parameters: {delta: 2}}]", None)]
)
def test_the_inertia_of_the_spec_is_the_joint_s(
    effects: str, factor: float | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A force of 1 N accelerates the compiled model by 1/M of the spec; an armature it has already counts."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.xml").write_text(SLIDE)
    (tmp_path / "arm.yaml").write_text(f"{GEARED}effects: {effects}\n")
    inertia = 12 + 0.0159 / 0.03**2 + (0 if factor else 2)
    text = into()
    model = mujoco.MjModel.from_xml_path("new.xml")
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    data.qfrc_applied[:] = 1000
    mujoco.mj_forward(model, data)
    still = mujoco.MjData(model)
    still.qfrc_applied[:] = 2000
    mujoco.mj_forward(model, still)
    assert 1000 / (still.qacc[0] - data.qacc[0]) == pytest.approx(inertia, rel=1e-4)
    assert data.M[0] == pytest.approx(inertia, rel=1e-12)
    assert "inertia of x: exact: armature" in text and "instead of 0.5" in text
    assert COMMENT.sub("", into()) == COMMENT.sub("", text)


def test_an_inertia_that_no_armature_makes_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.yaml").write_text(GEARED)
    for mass in ("40", "29.6666666666666666"):
        (tmp_path / "arm.xml").write_text(SLIDE.replace('armature="0.5"', "").replace('"12"', f'"{mass}"'))
        text = into()
        assert ("inertia of x: dropped: inertia differs: 29.67 in the spec against 40 kg" in text) == (mass == "40")
        assert "armature" not in COMMENT.sub("", text)
