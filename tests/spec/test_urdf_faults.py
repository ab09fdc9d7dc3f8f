"""A robot file or ``urdf:`` section that cannot be used: what is said, and at which line."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from codegen.base.errors import BadInput, Place
from codegen.spec import parse_spec
from codegen.spec.urdf import identifier, read_kinematic_tree
from tests.expected_errors import matches
from tests.slow_cases import examples

ARM = """<robot name="arm">
  <link name="base"/>
  <joint name="hinge" type="revolute">
    <origin xyz="0 0 1" rpy="0 0 0"/>
    <parent link="base"/>
    <child link="rod"/>
    <axis xyz="0 1 0"/>
    <dynamics damping="0.5" friction="0.25"/>
  </joint>
  <link name="rod">
    <inertial>
      <origin xyz="0 0 0.5"/>
      <mass value="2"/>
      <inertia ixx="0.2" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.01"/>
    </inertial>
  </link>
</robot>
"""
SECOND = '<joint name="{}" type="fixed"><parent link="{}"/><child link="{}"/></joint>'
UNIT = '<mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
LINK = f'<link name="{{}}"><inertial>{UNIT}</inertial></link>'
FAULTS = {
    "no xml": ("<robot", "<robot <", ":1", "SPEC030"),
    "no urdf": ('<robot name="arm">', '<robot name="arm"></robot><robot>', ":1", "SPEC030"),
    "mass": ('value="2"', 'value="-2"', ":13", "SPEC032 -2"),
    "a length that overflows": ('xyz="0 0 0.5"', 'xyz="1e300 0 0"', ":12", "SPEC007 1e+30"),
    "a turn of no meaning": ('rpy="0 0 0"', 'rpy="1e300 0 0"', ":4", "SPEC007 1e+30"),
    "a mass of no machine": ('value="2"', 'value="1e300"', ":13", "SPEC007 1e+30"),
    "a mass of nothing": ('value="2"', 'value="1e-300"', ":13", "SPEC032 1e-30"),
    "an inertia of no machine": ('ixx="0.2"', 'ixx="1e300"', ":14", "SPEC007 1e+30"),
    "damping of no machine": ('damping="0.5"', 'damping="1e300"', ":8", "SPEC007 1e+30"),
    "an inertia of nothing": (
        'ixx="0.2" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.01"',
        'ixx="2e-301" ixy="0" ixz="0" iyy="2e-301" iyz="0" izz="1e-301"',
        ":14",
        "SPEC032 1e-301 m^2",
    ),
    "no mass": ('value="2"', 'value="0"', ":13", "SPEC032 0"),
    "mass in words": ('value="2"', 'value="heavy"', ":13", "SPEC030"),
    "mass unsaid": ('<mass value="2"/>', "", ":11", "SPEC030"),
    "not a number": ('value="2"', 'value="nan"', ":13", "SPEC006"),
    "inertia": ('izz="0.01"', 'izz="0"', ":14", "SPEC032 0 m^2"),
    "no body": ('izz="0.01"', 'izz="0.5"', ":14", "SPEC032 0.2 0.2 0.5 m^2"),
    "indefinite": ('ixy="0"', 'ixy="0.3"', ":14", "SPEC032"),
    "inertia unsaid": (
        '<inertia ixx="0.2" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.01"/>',
        "",
        ":11",
        "SPEC032",
    ),
    "entry unsaid": ('iyz="0" ', "", ":14", "SPEC030"),
    "kind": (
        '"revolute"',
        '"floating"',
        ":3",
        "SPEC031",
    ),
    "planar": ('"revolute"', '"planar"', ":3", "SPEC031"),
    "unknown kind": ('"revolute"', '"hinged"', ":3", "SPEC030"),
    "mimic": ('<axis xyz="0 1 0"/>', '<mimic joint="hinge"/>', ":7", "SPEC031"),
    "axis": ("0 1 0", "0 0 0", ":7", "SPEC031"),
    "short axis": ("0 1 0", "0 1", ":7", "SPEC030"),
    "no child": ('<child link="rod"/>', "", ":3", "SPEC030"),
    "child of nothing": ('<child link="rod"/>', "<child/>", ":6", 'SPEC008 "None"'),
    "unknown link": ('<child link="rod"/>', '<child link="rood"/>', ":6", 'SPEC008 "rood"'),
    "two masses": ('<mass value="2"/>', '<mass value="2"/><mass value="3"/>', ":11", "SPEC030"),
    "damping": ('damping="0.5"', 'damping="-1"', ":8", "SPEC007 -1"),
    "two of a name": ('<link name="base"/>', '<link name="base"/><link name="rod"/>', ":10", 'SPEC009 "rod" 2'),
    "two joints of a name": ("</robot>", SECOND.format("hinge", "rod", "x") + "</robot>", ":17", 'SPEC009 "hinge" 3'),
    "xacro": ('value="2"', 'value="${m}"', ":13", "SPEC030 xacro"),
    "xacro element": (
        '<link name="base"/>',
        '<xacro:arm xmlns:xacro="http://www.ros.org/wiki/xacro"/><link name="base"/>',
        ":2",
        "SPEC030 xacro",
    ),
    "two roots": (
        '<link name="base"/>',
        '<link name="base"/><link name="other"/>',
        "",
        "SPEC031",
    ),
    "loop": ("</robot>", SECOND.format("back", "rod", "base") + "</robot>", "", "SPEC031"),
    "apart": (
        "</robot>",
        '<link name="a"/><link name="b"/>' + SECOND.format("j", "a", "b") + SECOND.format("k", "b", "a") + "</robot>",
        ":17",
        "SPEC031",
    ),
    "two parents": (
        "</robot>",
        SECOND.format("again", "base", "rod") + "</robot>",
        ":17",
        "SPEC031",
    ),
    "nothing moves": ('"revolute"', '"fixed"', "", "SPEC031"),
    "names that clash": (
        "</robot>",
        SECOND.format("hin ge", "rod", "x").replace("fixed", "continuous")
        + SECOND.format("hin-ge", "rod", "y").replace("fixed", "continuous")
        + LINK.format("x")
        + LINK.format("y")
        + "</robot>",
        ":17",
        'SPEC009 "hin ge" "hin-ge" hin_ge',
    ),
}


def read(folder: Path, text: str):
    path = folder / "arm.urdf"
    path.write_text(text, encoding="utf-8")
    return read_kinematic_tree(path, Place("spec.yaml", 2, "urdf"))


@pytest.mark.parametrize("fault", FAULTS)
def test_every_fault_is_told_at_its_line(fault: str, tmp_path: Path, capfd) -> None:
    old, new, line, words = FAULTS[fault]
    assert ARM.count(old) >= 1
    with pytest.raises(BadInput) as error:
        read(tmp_path, ARM.replace(old, new, 1))
    message = str(error.value)
    assert message.startswith(f"{tmp_path / 'arm.urdf'}{line}") and matches(error.value, words) and "\n" not in message
    assert capfd.readouterr() == ("", "")


def test_a_link_without_mass_that_moves_is_refused(tmp_path: Path) -> None:
    start, end = ARM.index("    <inertial>"), ARM.index("</inertial>") + len("</inertial>\n")
    with pytest.raises(BadInput) as error:
        read(tmp_path, ARM[:start] + ARM[end:])
    assert error.value.place.line == 10 and matches(error.value, 'SPEC032 "rod"')


@pytest.mark.parametrize("inertia", ["0 0 0", "0.1 0.1 0", "1e-6 1e-6 -2e-22"])
def test_a_point_mass_or_a_rod_on_a_body_is_read(inertia: str, tmp_path: Path) -> None:
    """Tool frames of published robots have a mass without inertia; the body that they are fixed to has one."""
    ixx, iyy, izz = inertia.split()
    tool = f'<mass value="0.5"/><inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}"/>'
    more = SECOND.format("mount", "rod", "tool") + f'<link name="tool"><inertial>{tool}</inertial></link></robot>'
    (body,) = read(tmp_path, ARM.replace("</robot>", more)).bodies
    rod = 0.2 + 2 * 0.5**2  # about the joint
    to_joint = np.cross(np.eye(3), body.centre.astype(float))
    inertia = body.about_centre.astype(float) + float(body.mass) * to_joint @ to_joint.T
    assert np.allclose(inertia, np.diag([rod + float(ixx), rod + float(iyy), 0.01]))


@pytest.mark.parametrize("rpy", ["0 0 0", "0.3 0.7 1.1", "-2 0.1 0.4", "1 1 1"])
def test_a_moving_rod_is_refused_in_any_direction(rpy: str, tmp_path: Path) -> None:
    """Rounding left a tilted rod a moment of 1e-19 of the others about its own axis, and M(x) was singular."""
    (body,) = (line for line in ARM.splitlines() if "<inertia " in line)
    text = ARM.replace(body, '<inertia ixx="0" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/>')
    text = re.sub("(<inertial>\\s*)(<origin[^>]*/>)?", rf'\1<origin xyz="0.1 0 0" rpy="{rpy}"/>', text, count=1)
    with pytest.raises(BadInput) as error:
        read(tmp_path, text)
    assert matches(error.value, "SPEC032 moment")


def test_a_mimic_joint_is_read_as_fixed_where_the_file_says_so(tmp_path: Path) -> None:
    finger = SECOND.format("finger", "rod", "tip").replace("/></joint>", '/><mimic joint="hinge"/></joint>')
    tree = read(tmp_path, ARM.replace("</robot>", finger + LINK.format("tip") + "</robot>"))
    assert [(b.joint, float(b.mass)) for b in tree.bodies] == [("hinge", 3.0)]


def test_entities_are_not_expanded(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("7")
    head = f'<!DOCTYPE robot [<!ENTITY s SYSTEM "{(tmp_path / "secret").as_uri()}">]>'
    tree = read(tmp_path, head + ARM.replace("<axis", "&s;<axis"))
    assert [b.joint for b in tree.bodies] == ["hinge"]


def test_what_is_not_mechanics_is_left_alone(tmp_path: Path) -> None:
    odd = '<transmission name="t"/><gazebo/><material name="m"/><!-- a --><?b c?></robot>'
    plain = read(tmp_path, ARM)
    assert (
        read(tmp_path, ARM.replace("</robot>", odd).replace("<inertial>", "<visual/><inertial>")).bodies == plain.bodies
    )


@pytest.mark.parametrize(
    ("name", "expected"), [("joint 1", "joint_1"), ("7", "joint_7"), ("a-b.c", "a_b_c"), ("ä", "joint_")]
)
def test_names_become_identifiers(name: str, expected: str) -> None:
    assert identifier(name) == expected


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ("urdf: none.urdf", "FILE001 2"),
        ("urdf: {file: none.urdf}", "FILE001 none.urdf`"),
        ("urdf: {path: arm.urdf}", "SPEC004 `path`"),
        ("urdf: 3", "SPEC006 `3`"),
        ("urdf:", "SPEC006 2 nothing"),
        ("urdf: {gravity: [0, 0, -9.81]}", "SPEC003 `urdf.file`"),
        ("urdf: {file: arm.urdf, tolerance: {masses: 20 %}}", "SPEC004 `masses` mass"),
        ("urdf: {file: arm.urdf, base_parameters: {hinge_m: heavy}}", "SPEC006 `heavy`"),
        ("urdf: {file: arm.urdf, gravity: [0, 0]}", "SPEC006"),
        ("urdf: {file: arm.urdf, gravity: [0, 0, down]}", "SPEC006 2"),
        ("urdf: arm.urdf\nforce: [w]", "SPEC005 3 `force:` `urdf:`"),
        ("urdf: arm.urdf\ncoordinates: {x: {velocity: v, unit: m}}", "SPEC005 `coordinates:` `urdf:`"),
        ("urdf: arm.urdf\nmass_matrix: [[1]]", "SPEC005 `urdf` `mass_matrix`"),
        ("urdf: arm.urdf\nfriction: {contacts: []}", "SPEC015"),
        ("urdf: arm.urdf\nfriction: oil", "SPEC006 3"),
        ("urdf: arm.urdf\nenvelope: {hing: [0, 1]}", "SPEC008 `hing`"),
        ("urdf: [arm.urdf]", "SPEC006 2"),
    ],
)
def test_a_section_that_cannot_be_used(section: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM, encoding="utf-8")
    with pytest.raises(BadInput) as error:
        parse_spec(f"name: arm\n{section}\n", tmp_path / "arm.yaml")
    assert matches(error.value, words)


def test_joint_friction_is_that_of_the_file_unless_the_spec_gives_it(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM, encoding="utf-8")
    spec = parse_spec("name: arm\nurdf: arm.urdf\n", tmp_path / "arm.yaml")
    (contact,), (effect,) = spec.contacts, spec.effects
    assert (contact.name, contact.law, contact.unit, float(contact.parameters["a"])) == (
        "hinge",
        "coulomb",
        "N*m",
        0.25,
    )
    assert (effect.kind, effect.on, float(effect.parameters["b"])) == ("viscous", ("hinge",), 0.5)
    own = "friction: {contacts: [{name: c, law: coulomb, a: 3, unit: N*m}]}"
    spec = parse_spec(f"name: arm\nurdf: arm.urdf\n{own}\n", tmp_path / "arm.yaml")
    assert (
        [c.name for c in spec.contacts] == ["c"] and not spec.effects and spec.distribution == spec.distribution.eye(1)
    )


@pytest.mark.parametrize(("kind", "number"), [("revolute", 101), ("fixed", 1001)])
def test_a_robot_of_too_many_joints_is_refused_at_once(tmp_path: Path, kind: str, number: int) -> None:
    """160 moving joints took more than two minutes to read, 3000 all memory."""
    links = '<link name="0"/>' + "".join(LINK.format(k) for k in range(1, number + 1))
    joint = '<joint name="j{1}" type="{2}"><parent link="{0}"/><child link="{1}"/></joint>'
    joints = "\n".join(joint.format(k, k + 1, kind) for k in range(number))
    with pytest.raises(BadInput, match=f"{number} .*joints; expected at most {number - 1}") as told:
        read(tmp_path, f'<robot name="long">{links}{joints}</robot>')
    assert told.value.code == "SPEC031" and f":{number}" in str(told.value)


def test_the_hash_of_a_spec_counts_its_robot_file(tmp_path: Path) -> None:
    text, hashes, files = "name: arm\nurdf: arm.urdf\n", [], []
    for mass in ("2", "3"):
        (tmp_path / "arm.urdf").write_text(ARM.replace('value="2"', f'value="{mass}"'), encoding="utf-8")
        spec = parse_spec(text, tmp_path / "arm.yaml")
        hashes.append(spec.sha256)
        files.append(spec.file_sha256)
    assert hashes[0] != hashes[1] and files[0] == files[1]


@settings(max_examples=examples(150), deadline=None)
@given(st.data())
def test_a_damaged_file_is_bad_input_or_a_robot(tmp_path_factory, data) -> None:
    """Words taken out or put elsewhere: never another exception than BadInput."""
    words = ARM.split(" ")
    for _ in range(data.draw(st.integers(1, 3))):
        k = data.draw(st.integers(0, len(words) - 1))
        words[k] = data.draw(
            st.sampled_from(["", "0", '"', "<link/>", 'name="rod"', "1e999", words[(7 * k) % len(words)]])
        )
    folder = tmp_path_factory.mktemp("damaged")
    try:
        read(folder, " ".join(words))
    except BadInput as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize("section", ["3", "true", "[arm.urdf]"])
def test_a_section_that_is_neither_a_path_nor_a_mapping_says_what_it_may_be(section: str) -> None:
    with pytest.raises(BadInput, match=r"the path of a robot description, or a mapping with `file:`") as told:
        parse_spec(f"name: arm\nurdf: {section}\n", Path("arm.yaml"))
    assert str(told.value).startswith("arm.yaml:2: urdf: ")
