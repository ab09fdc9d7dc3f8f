"""Robot description files with damage that knows URDF: elements and attributes dropped, doubled, moved, changed."""

from __future__ import annotations

import copy
import random
import re

from lxml import etree

from .case import Case
from .hostile import NAMES, NUMBERS, TEXTS
from .spec_cases import FILE, check_stage, damaged_text

ROBOT = "r.urdf"
SPEC = f"""\
name: arm
urdf: {ROBOT}
observer: {{kind: gto, velocity: estimated, gains: {{K_2: -10, K_v: 100}}, sample_time: 0.001}}
"""
INERTIAL = (
    '<inertial><origin xyz="0 0 0.5"/><mass value="2"/>'
    '<inertia ixx="0.2" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.01"/></inertial>'
)
ONE = f"""<robot name="arm">
  <link name="base"/>
  <joint name="hinge" type="revolute">
    <origin xyz="0 0 1" rpy="0 0 0"/> <parent link="base"/> <child link="rod"/> <axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/> <dynamics damping="0.5" friction="0.25"/>
  </joint>
  <link name="rod">{INERTIAL}</link>
</robot>
"""
TWO = f"""<?xml version="1.0"?>
<robot name="two">
  <link name="base"/>
  <joint name="q 1" type="prismatic">
    <parent link="base"/> <child link="upper"/> <axis xyz="1 0 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/> <dynamics friction="3"/>
  </joint>
  <link name="upper">{INERTIAL}<visual><geometry><mesh filename="a.stl"/></geometry></visual></link>
  <joint name="fix" type="fixed"><origin rpy="0.3 0 1"/><parent link="upper"/><child link="tool"/></joint>
  <link name="tool">{INERTIAL}</link>
  <joint name="q-2" type="continuous">
    <origin xyz="0.5 0 0"/> <parent link="tool"/> <child link="lower"/> <axis xyz="0 -1 0"/>
    <dynamics damping="0.4" friction="0.7"/>
  </joint>
  <link name="lower">{INERTIAL}</link>
</robot>
"""
VECTORS = [
    *("0 0 0", "1 2 3", "1e308 1e308 0", "nan 0 0", "0 0", "0 0 0 0", "", "a b c", "1,2,3", "1e-320 0 0"),
    *("inf 0 1", "0 0 1e9"),
]
ELEMENTS = (
    *("mimic", "transmission", "gazebo", "safety_controller", "calibration", "limit", "sensor", "x", "robot"),
    *("inertia", "link", "joint", "mass", "origin", "axis", "parent", "child", "dynamics", "Link"),
)
ENTITY = '<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa">{}]>'
BOMB = ENTITY.format("".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True)))
HEADS = (
    *(
        "",
        "<?xml version='1.1'?>",
        "<?xml version='1.0' encoding='utf-16'?>",
        "<?xml version='1.0' encoding='nope'?>",
        "\ufeff",
        " \n",
    ),
    *(
        BOMB,
        '<!DOCTYPE robot SYSTEM "file:///etc/passwd">',
        '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/hostname">]>',
        "<!-- -- -->",
    ),
    *("<?php x ?>", '<?xml-stylesheet href="x.xsl"?>', "<robot/>", "<![CDATA[x]]>", "\x00", "&i;", "text"),
)


def robot(seed: int) -> Case:
    """The damaged robot file of that number below a spec that names it."""
    dice = random.Random(f"robot {seed}")
    text = damaged_xml(dice.choice([ONE, ONE, TWO]), dice)
    if dice.random() < 0.3:
        text = damaged_text(text, dice)
    spec = SPEC if dice.random() < 0.95 else damaged_text(SPEC, dice)
    files = {ROBOT: text.encode("utf-8", "surrogatepass"), FILE: spec.encode("utf-8", "surrogatepass")}
    return Case(files, (check_stage(),))


def damaged_xml(text: str, dice: random.Random) -> str:
    root = etree.fromstring(text.encode())
    for _ in range(dice.choice([1, 1, 1, 2, 3])):
        elements = list(root.iter())
        element = dice.choice(elements)
        attributes = list(element.attrib)
        match dice.randrange(10):
            case 0 if element.getparent() is not None:
                element.getparent().remove(element)
            case 1 if element.getparent() is not None:
                element.getparent().insert(dice.randrange(5), copy.deepcopy(element))
            case 2:
                dice.choice(elements).append(copy.deepcopy(element) if element is not root else etree.Element("link"))
            case 3 if attributes:
                del element.attrib[dice.choice(attributes)]
            case 4:
                element.append(etree.Element(dice.choice(ELEMENTS), joint="hinge", multiplier="2", name="a"))
            case 5:
                element.tag = dice.choice(ELEMENTS)
            case 6 if attributes:
                _set(element, dice.choice(attributes), dice.choice([*NAMES, *TEXTS]))
            case 7 if attributes:
                kinds = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "ball", ""]
                _set(element, dice.choice(attributes), dice.choice([*kinds, "base", "rod", "upper", "world", "hinge"]))
            case _ if attributes:
                name = dice.choice(attributes)
                _set(element, name, dice.choice(VECTORS if name in ("xyz", "rpy") else NUMBERS))
    made = etree.tostring(root, encoding="unicode")
    if dice.random() < 0.1:
        made = dice.choice(HEADS) + made
    if dice.random() < 0.05:
        made = re.sub('name="arm"', 'name="&i;&x;"', made)
    if dice.random() < 0.03:
        made = made.replace("</robot>", "<link>" * dice.choice([5, 300, 5000]) + "</robot>")
    if dice.random() < 0.03:
        links = "".join(f'<link name="l{k}"/>' for k in range(dice.choice([5, 500])))
        made = made.replace("</robot>", f"{links}</robot>")
    return made


def _set(element: etree._Element, name: str, text: str) -> None:
    """A value, if XML can hold it."""
    try:
        element.set(name, text)
    except ValueError:
        element.set(name, "")
