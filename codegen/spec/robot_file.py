"""A URDF file → elements with typed values and lines, through ROS's own parser (urdf_parser_py).

That parser of 2021 is small, strict and needs no other package. The others give no lines: yourdfpy 0.0.60 reads a link
that appears twice and an <inertial> without <inertia> without a word, and brings meshes with it; urchin 0.0.30 ends
both in an AttributeError; Pinocchio 4.1 takes the second as a body without inertia. What is refused here is found on
lxml's tree, which knows the lines.

Both parsers are imported when a file is read: few specs name one.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import read_bytes

KNOWN = {
    "robot": {"link", "joint"},
    "link": {"inertial"},
    "inertial": {"origin", "mass", "inertia"},
    "joint": {"origin", "parent", "child", "axis", "dynamics", "mimic"},
}
LARGEST = 20_000_000


class RobotFile:
    """What a URDF file says about masses and joints; pictures, limits and transmissions are left out.

    Attributes:
        robot: as urdf_parser_py gives it.
        content: the file's bytes.
    """

    def __init__(self, path: Path, named_at: Place) -> None:
        """Args:
            path: of the file.
            named_at: where the spec names it.

        Raises:
            BadInput: for a file that cannot be read, is no XML or no URDF.
        """
        from lxml import etree

        self.path = path
        expected = "a robot description (URDF), its path relative to the spec"
        self.content = read_bytes(path, expected, LARGEST, named_at)
        # No entities and no network: a robot description is a stranger's file.
        parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
        try:
            self._root = etree.fromstring(self.content, parser)
        except etree.XMLSyntaxError as error:
            raise BadInput(
                Place(str(path), error.lineno), str(error.msg), "a robot description (XML)", code="SPEC030"
            ) from None
        if self._root is None or self._root.tag != "robot":
            found = f"<{self._root.tag}>" if self._root is not None else "no element"
            raise BadInput(Place(str(path), 1), found, "<robot>, a robot description (URDF)", code="SPEC030")
        self._refuse_xacro()
        self.limits = self._limits()
        self._keep_mechanics()
        self.robot: Any = self._parsed()

    def place(self, kind: str, name: str, inner: str = "") -> Place:
        """File and line of a link or joint, or of an element inside it if it has that."""
        for element in self._root.findall(kind):
            if element.get("name") == name:
                found = element.find(inner) if inner else element
                line = (element if found is None else found).sourceline
                return Place(str(self.path), line, f'{kind} "{name}"')
        return Place(str(self.path), None, f'{kind} "{name}"')

    def _limits(self) -> dict[str | None, tuple[float, float]]:
        """Joint → the least and the greatest position, where the file says a range; a strange one is no error."""
        found = {}
        for joint in self._root.findall("joint"):
            limit = joint.find("limit")
            with contextlib.suppress(ValueError):
                low, high = (float("0" if limit is None else limit.get(end, "0")) for end in ("lower", "upper"))
                if low < high and joint.get("type") != "continuous":
                    found[joint.get("name")] = low, high
        return found

    def _keep_mechanics(self) -> None:
        """Drop what is not mechanics, so that a strange mesh or transmission is no error; refuse what appears twice."""
        for element in list(self._root.iter()):
            known = KNOWN.get(str(element.tag))
            for child in list(element) if known else []:
                if child.tag not in (known or ()):
                    element.remove(child)
            tags = [str(child.tag) for child in element]
            twice = [tag for tag in tags if tags.count(tag) > 1 and element is not self._root]
            if twice:
                raise BadInput(Place(str(self.path), element.sourceline), f"two <{twice[0]}>", "one", code="SPEC030")
        for kind in ("link", "joint"):
            lines: dict[str | None, int] = {}
            for element in self._root.findall(kind):
                name = element.get("name")
                if name in lines and name is not None:
                    found = f'a second {kind} "{name}"'
                    expected = f"a different name; the first is on line {lines[name]}"
                    raise BadInput(Place(str(self.path), element.sourceline), found, expected, code="SPEC009")
                lines[name] = element.sourceline

    def _refuse_xacro(self) -> None:
        for element in self._root.iter():
            macro = str(element.tag).startswith(("{http://www.ros.org/wiki/xacro}", "{http://ros.org/wiki/xacro}"))
            if macro or any("${" in value for value in element.values()):
                expected = "a file that xacro has expanded: `xacro robot.urdf.xacro > robot.urdf`"
                raise BadInput(Place(str(self.path), element.sourceline), "a macro of xacro", expected, code="SPEC030")

    def _parsed(self) -> Any:
        from urdf_parser_py.urdf import Robot
        from urdf_parser_py.xml_reflection import core

        try:
            # The parser reports attributes that it does not know on stderr; a robot description may have them.
            with contextlib.redirect_stderr(io.StringIO()):
                return Robot.from_xml(self._root, core.Path("robot", tree=self._root.getroottree()))
        except core.ParseError as error:
            words = " ".join(str(error.e).split())
            raise BadInput(
                self._place_of(str(error.path)), words, "a robot description (URDF)", code="SPEC030"
            ) from None
        except (AssertionError, TypeError, ValueError, AttributeError) as error:
            # The parser meets a missing attribute of <mass>, <axis>, <parent> or <child> with one of these.
            incomplete = self._incomplete()
            found = " ".join(str(error).split()) if incomplete is None else _shown(incomplete)
            line = None if incomplete is None else incomplete.sourceline
            raise BadInput(Place(str(self.path), line), found, "a robot description (URDF)", code="SPEC030") from None

    def _place_of(self, xpath: str) -> Place:
        from lxml import etree

        with contextlib.suppress(etree.XPathError):
            found = self._root.getroottree().xpath(xpath)
            if isinstance(found, list) and found:
                return Place(str(self.path), found[0].sourceline)
        return Place(str(self.path), None, xpath)

    def _incomplete(self) -> Any:
        wanted: dict[str, tuple[str, Callable[[str], object]]] = {
            "mass": ("value", float),
            "axis": ("xyz", _three),
            "parent": ("link", str),
            "child": ("link", str),
        }
        for element in self._root.iter(*wanted):
            attribute, read = wanted[str(element.tag)]
            try:
                if element.get(attribute) is None:
                    return element
                read(element.get(attribute))
            except ValueError:
                return element
        return None


def _shown(element: Any) -> str:
    given = "".join(f' {name}="{value}"' for name, value in element.items())
    return f"<{element.tag}{given}>, which is incomplete"


def _three(text: str) -> list[float]:
    values = [float(word) for word in text.split()]
    if len(values) != 3:
        raise ValueError
    return values
