"""Reader of a robot description, URDF → kinematic tree: fixed links are merged, invalid mechanisms refused.

Only masses and joints are read, not shapes, force limits and transmissions. ``lxml`` is imported when a file is read,
since few specs have one.
"""

import contextlib
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from codegen.base.errors import BadInput, Place
from codegen.base.exact_numbers import Exact, exact_array, sine_cosine, square_root
from codegen.base.input_files import read_bytes
from codegen.spec.motion import KinematicTree, MovingBody, moments_of, pose, rows, vector

LARGEST = 20_000_000
"""Largest size of a robot description, bytes."""
ONCE = {
    "link": ("inertial",),
    "inertial": ("origin", "mass", "inertia"),
    "joint": ("origin", "parent", "child", "axis", "dynamics", "mimic"),
}
"""Element → child elements that it may have only once."""
STANDARD_GRAVITY = (Fraction(0), Fraction(0), Fraction("-9.81"))
MOVING, REFUSED = ("revolute", "continuous", "prismatic"), ("floating", "planar")
EXPECTED = "a robot description (URDF)"
MOST_JOINTS, MOST_MOVING = 1000, 100
"""Largest numbers of joints and of moving ones: M(x) of 80 joints takes a minute, and grows with their cube."""
TRIANGLE = 1e-3
"""Relative tolerance of the inequalities of principal moments of inertia: files round their numbers, and for a thin rod
or plate one of them is an equality.
"""
ROUNDING = 3 * float(np.finfo(np.float64).eps)
"""Relative size of a computed principal moment that may be zero: the tolerance of ``numpy.linalg.matrix_rank``."""
MOST, LEAST = 1e30, 1e-30
"""Largest number of a robot, and least mass and principal moment of a moving body, SI: no machine is near them, and the
products of a few such numbers are within the range of a double.
"""
SAME, MASSLESS = exact_array(np.eye(4, dtype=int)), exact_array(np.zeros((4, 4), dtype=int))


@dataclass
class _Body:
    """A moving body to which links are added; attributes as of ``MovingBody``."""

    joint: Any
    parent: int
    frame: Exact
    moments: Exact


def read_kinematic_tree(path: Path, named_at: Place, gravity: Sequence[Fraction] = STANDARD_GRAVITY) -> KinematicTree:
    """The kinematic tree of a URDF file.

    Args:
        named_at: place of the file's name in the spec, for a file that cannot be read.
        gravity: in the base's frame, m/s².

    Raises:
        BadInput: for a file that is no URDF, a floating, planar or mimic joint, a loop, or inertial data that are
            missing or not physical.
    """
    return _Reading(path, named_at).tree(gravity)


def identifier(name: str) -> str:
    """A joint's name as an identifier: letters, digits and ``_``, starting with a letter."""
    word = "".join(c if c.isascii() and (c.isalnum() or c == "_") else "_" for c in name)
    return word if word[:1].isalpha() else f"joint_{word.lstrip('_')}"


class _Reading:
    """Reading of one file: its links and joints, name → XML element, and the bodies so far."""

    def __init__(self, path: Path, named_at: Place) -> None:
        from lxml import etree

        self.path, self.bodies = path, list[_Body]()
        self.content = read_bytes(path, f"{EXPECTED}, its path relative to the spec", LARGEST, named_at)
        # No entities and no network: the file may come from an untrusted source.
        parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
        try:
            root = etree.fromstring(self.content, parser)
        except etree.XMLSyntaxError as error:
            place = Place(str(path), error.lineno)
            raise BadInput(place, str(error.msg), "a robot description (XML)", code="SPEC030") from None
        if root is None or root.tag != "robot":
            found = f"<{root.tag}>" if root is not None else "no element"
            raise BadInput(Place(str(path), 1), found, f"<robot>, {EXPECTED}", code="SPEC030")
        for element in root.iter():
            macro = str(element.tag).startswith(("{http://www.ros.org/wiki/xacro}", "{http://ros.org/wiki/xacro}"))
            if macro or any("${" in value for value in element.values()):
                expected = "a file that xacro has expanded: `xacro robot.urdf.xacro > robot.urdf`"
                raise BadInput(Place(str(path), element.sourceline), "a macro of xacro", expected, code="SPEC030")
        self.links, self.joints = self._named(root, "link"), self._named(root, "joint")

    def place(self, element: Any, *inner: str) -> Place:
        """File and line of an element, or of the innermost existing element on a path in it, with its link or joint."""
        owner = next(e for e in (element, *element.iterancestors()) if e.tag in ("link", "joint"))
        for tag in inner:
            found = element.find(tag)
            element = element if found is None else found
        return Place(str(self.path), element.sourceline, f'{owner.tag} "{owner.get("name")}"')

    def _named(self, root: Any, kind: str) -> dict[str, Any]:
        """The links or joints by name, in the order of the file; raises BadInput for a duplicate name or child."""
        found: dict[str, Any] = {}
        for element in root.findall(kind):
            name, line = element.get("name"), element.sourceline
            if name is None:
                raise BadInput(Place(str(self.path), line), f"a {kind} without a name", EXPECTED, code="SPEC030")
            if name in found:
                expected = f"a different name; the first is on line {found[name].sourceline}"
                raise BadInput(Place(str(self.path), line), f'a second {kind} "{name}"', expected, code="SPEC009")
            found[name] = element
            for outer in (element, *element.findall("inertial")):
                twice = next((tag for tag in ONCE[outer.tag] if len(outer.findall(tag)) > 1), None)
                if twice:
                    raise BadInput(self.place(outer), f"two <{twice}>", "one", code="SPEC030")
        return found

    def tree(self, gravity: Sequence[Fraction]) -> KinematicTree:
        root = self._root()
        moving = [joint for joint in self.joints.values() if joint.get("type") in MOVING]
        for kind, joints, most in (("", [*self.joints.values()], MOST_JOINTS), ("moving ", moving, MOST_MOVING)):
            if len(joints) > most:
                found, expected = f"{len(joints)} {kind}joints", f"at most {most}, those that stand still as fixed"
                raise BadInput(self.place(joints[most]), found, expected, code="SPEC031")
        waiting = [(root, -1, SAME)]
        reached = set()
        while waiting:
            link, body, frame = waiting.pop()
            reached.add(link)
            if body >= 0:
                self._add_inertia(self.bodies[body], self.links[link], frame)
            following = []
            for joint in self.joints.values():
                if self._end(joint, "parent") != link:
                    continue
                child = self._end(joint, "child")
                here = frame @ self._placement(joint)
                if self._kind(joint) == "fixed":
                    following.append((child, body, here))
                else:
                    self.bodies.append(_Body(joint, body, here, MASSLESS))
                    following.append((child, len(self.bodies) - 1, SAME))
            waiting += reversed(following)
        lost = next((element for name, element in self.links.items() if name not in reached), None)
        if lost is not None:
            found, expected = "a link in a closed loop of joints", f"a tree of links that starts at {root}"
            raise BadInput(self.place(lost), found, expected, code="SPEC031")
        if not self.bodies:
            expected = f"at least one joint: {', '.join(MOVING)}"
            raise BadInput(str(self.path), "no moving joint", expected, code="SPEC031")
        digest = hashlib.sha256(self.content).hexdigest()
        return KinematicTree(self._moving_bodies(), vector(gravity), self.path.name, digest, path=self.path)

    def _root(self) -> str:
        """The root: the link that is no child of a joint."""
        parent: dict[str, str] = {}
        for name, joint in self.joints.items():
            for end in ("parent", "child"):
                link = self._end(joint, end)
                if link not in self.links:
                    found = f'unknown link "{link}"'
                    raise BadInput(self.place(joint, end), found, f"a link as {end}", code="SPEC008")
            if link in parent:
                found = f'link "{link}" is the child of {parent[link]} already'
                expected = "exactly one joint for each moving link"
                raise BadInput(self.place(joint, "child"), found, expected, code="SPEC031")
            parent[link] = name
        roots = [name for name in self.links if name not in parent]
        if len(roots) != 1:
            found = f"links {', '.join(roots)} without a parent" if roots else "no link without a parent"
            expected = "one base link, to which all others are connected"
            raise BadInput(str(self.path), found, expected, code="SPEC031")
        return roots[0]

    def _end(self, joint: Any, end: str) -> str:
        """The link that a joint has as ``parent`` or ``child``."""
        element = joint.find(end)
        if element is None:
            raise BadInput(self.place(joint), f"a joint without <{end}>", EXPECTED, code="SPEC030")
        return str(element.get("link"))

    def _kind(self, joint: Any) -> str:
        kind = str(joint.get("type"))
        if joint.find("mimic") is not None and kind != "fixed":
            expected = 'no <mimic> where the log has its position and force, else type="fixed"'
            raise BadInput(self.place(joint, "mimic"), "a joint that follows another", expected, code="SPEC031")
        if kind not in (*MOVING, "fixed"):
            code = "SPEC031" if kind in REFUSED else "SPEC030"
            raise BadInput(self.place(joint), f"a {kind} joint", f"one of {', '.join(MOVING)}, fixed", code=code)
        return kind

    def _placement(self, element: Any) -> Exact:
        """The pose of an element's ``<origin>``; roll, pitch and yaw about fixed axes x, y, z."""
        xyz, rpy = (self._numbers(element, "origin", key, 3, "0 0 0") for key in ("xyz", "rpy"))
        (sr, cr), (sp, cp), (sy, cy) = (sine_cosine(angle) for angle in rpy)
        rotation = exact_array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )
        return pose(rotation, xyz)

    def _add_inertia(self, body: _Body, link: Any, frame: Exact) -> None:
        """Add the moments of a link that is fixed to a body; ``frame``: pose of the link in the body."""
        inertial = link.find("inertial")
        if inertial is None:
            return  # a frame without mass
        (mass,) = self._numbers(inertial, "mass", "value", 1)
        given = inertial.find("inertia") is not None
        keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz") if given else ()
        entries = [self._numbers(inertial, "inertia", key, 1)[0] for key in keys]
        if mass == 0 and given and not any(entries):
            return  # the same, written with zeros
        if not mass >= LEAST:
            found = f"a mass of {float(mass):g} kg"
            expected = "a positive mass" if mass <= 0 else f"a mass of at least {LEAST:g} kg"
            raise BadInput(self.place(inertial, "mass"), found, expected, code="SPEC032")
        if not given:
            expected = "ixx, ixy, ixz, iyy, iyz, izz about the centre of mass"
            raise BadInput(self.place(inertial), "<inertia> is missing", expected, code="SPEC032")
        xx, xy, xz, yy, yz, zz = entries
        about_centre = exact_array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        _refuse_impossible(about_centre, self.place(inertial, "inertia"))
        centre = frame @ self._placement(inertial)
        body.moments = body.moments + centre @ moments_of(mass, exact_array([0, 0, 0]), about_centre) @ centre.T

    def _moving_bodies(self) -> tuple[MovingBody, ...]:
        labels: dict[str, str] = {}
        result = []
        for body in self.bodies:
            joint, label = body.joint, body.joint.get("name")
            name = identifier(label)
            if name in labels:
                found = f'joints "{labels[name]}" and "{label}" both read as {name}'
                raise BadInput(self.place(joint), found, "names that differ in letters and digits", code="SPEC009")
            labels[name] = label
            link = self.links[self._end(joint, "child")]
            if not body.moments[3, 3] > 0:
                found = f'link "{link.get("name")}" and the links fixed to it have no mass'
                raise BadInput(self.place(link), found, "<inertial> with mass and inertia", code="SPEC032")
            axis = self._numbers(joint, "axis", "xyz", 3, "1 0 0")
            length = square_root(axis @ axis)
            if not length > 0:
                raise BadInput(self.place(joint, "axis"), "an axis of zeros", "a direction", code="SPEC031")
            moving = MovingBody(
                joint=name,
                label=label,
                kind="prismatic" if self._kind(joint) == "prismatic" else "revolute",
                parent=body.parent,
                frame=rows(body.frame),
                axis=vector(axis / length),
                moments=rows(body.moments),
                damping=self._dynamics(joint, "damping"),
                friction=self._dynamics(joint, "friction"),
                limits=_limits(joint),
            )
            _refuse_impossible(moving.about_centre, self.place(link, "inertial", "inertia"), is_moving=True)
            result.append(moving)
        return tuple(result)

    def _dynamics(self, joint: Any, name: str) -> float:
        number = float(self._numbers(joint, "dynamics", name, 1, "0")[0])
        if number < 0:
            found = f"{name} {number:g}"
            raise BadInput(self.place(joint, "dynamics"), found, "zero or a positive number", code="SPEC007")
        return number

    def _numbers(self, outer: Any, tag: str, attribute: str, count: int, default: str | None = None) -> Exact:
        """The numbers in an attribute of the element ``tag`` in another."""
        element, place = outer.find(tag), self.place(outer, tag)
        text = default if element is None else element.get(attribute, default)
        try:
            numbers = [float(word) for word in (text or "").split()]
        except ValueError:
            numbers = []
        if len(numbers) != count:
            found = f"<{tag}> is missing" if element is None else f'{attribute}="{text}" in <{tag}>'
            if element is not None and text is None:
                found = f"<{tag}> without `{attribute}`"
            expected = "a number" if count == 1 else f"{count} numbers"
            raise BadInput(place, found, f"{expected}, as in {EXPECTED}", code="SPEC030")
        if not np.isfinite(numbers).all():
            raise BadInput(place, str(text), "finite numbers", code="SPEC006")
        if max(map(abs, numbers)) > MOST:
            found = f'{attribute}="{text}" in <{tag}>'
            raise BadInput(place, found, f"numbers of at most {MOST:g} in size, in SI units", code="SPEC007")
        return exact_array(numbers)


def _refuse_impossible(inertia: Exact, place: Place, is_moving: bool = False) -> None:
    """Raise BadInput unless an inertia about its centre of mass is that of a real body.

    No principal moment is negative, and the largest is at most the sum of the others. The moments of a point mass or of
    a thin rod may be zero; those of a moving body, with all links that are fixed to it, must be positive by more than
    the rounding of the eigenvalues.
    """
    try:
        smallest, middle, largest = (float(value) for value in np.linalg.eigvalsh(inertia.astype(float)))
    except np.linalg.LinAlgError as error:
        found = f"principal moments that cannot be computed ({error})"
        raise BadInput(place, found, "finite numbers", code="SPEC032") from None
    if smallest < -TRIANGLE * largest or (is_moving and smallest <= max(LEAST, ROUNDING * largest)):
        found = f"an inertia with the principal moment {smallest:.4g} kg m^2"
        expected = "a positive definite inertia" + " of the link with those that are fixed to it" * is_moving
        raise BadInput(place, found, expected, code="SPEC032")
    if largest > (smallest + middle) * (1 + TRIANGLE):
        found = f"principal moments {smallest:.4g}, {middle:.4g} and {largest:.4g} kg m^2"
        expected = "those of a real body: the largest is at most the sum of the other two"
        raise BadInput(place, found, expected, code="SPEC032")


def _limits(joint: Any) -> tuple[float, float] | None:
    """(lower, upper) limit of a joint's position; None without a valid range, which is no error."""
    limit = joint.find("limit")
    if limit is None or joint.get("type") == "continuous":
        return None
    with contextlib.suppress(ValueError):
        low, high = (float(limit.get(end, "0")) for end in ("lower", "upper"))
        return (low, high) if low < high else None
    return None
