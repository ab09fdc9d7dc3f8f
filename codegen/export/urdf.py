"""The machine as URDF: the robot file of the spec with the friction that was found, or a file of its own."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from codegen.base.errors import BadInput
from codegen.base.input_files import read_bytes
from codegen.base.text import render
from codegen.export.bodies import links_of
from codegen.export.joints import JointTerms, joint_terms
from codegen.export.mechanism import Mechanism
from codegen.export.numbers import number
from codegen.export.remarks import Remark
from codegen.spec.model import Spec
from codegen.spec.robot_file import LARGEST


def urdf_text(spec: Spec, mechanism: Mechanism, header: list[str]) -> tuple[str, tuple[Remark, ...]]:
    """The file, and what it holds.

    A robot file that the spec names is edited: ``damping`` and ``friction`` of each joint's ``<dynamics>``, and
    ``effort`` of a ``<limit>`` where a saturation is declared. All else stays, byte for byte.
    """
    joints, remarks = joint_terms(spec, mechanism, "URDF", springs=False)
    lines = [*header, *(r.text for r in remarks)]
    if mechanism.tree is not None and mechanism.tree.path is not None:
        labels = {body.joint: body.label for body in mechanism.tree.bodies}
        robot = _edited(spec, mechanism.tree.path, {labels[j.name]: j for j in joints})
        return render("export/edited.urdf.xml.j2", header=lines) + robot, remarks
    pairs = list(zip(links_of(mechanism), joints, strict=True))
    return render("export/robot.urdf.xml.j2", name=spec.name, header=lines, pairs=pairs, n=number), remarks


@dataclass(frozen=True)
class _Change:
    """Bytes from start to end that another text takes the place of."""

    start: int
    end: int
    text: str


def _edited(spec: Spec, path: Path, joints: Mapping[str, JointTerms]) -> str:
    """The robot file without its XML declaration."""
    content = read_bytes(path, "a robot description (URDF)", LARGEST, spec.place("urdf"))
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        expected = "a robot description in UTF-8, to be edited"
        raise BadInput(str(path), "text that is not UTF-8", expected, code="FILE006") from None
    editing = _Editing(content, joints, path)
    for change in sorted(editing.changes, key=lambda c: -c.start):
        content = content[: change.start] + change.text.encode() + content[change.end :]
    text = content.decode("utf-8").removeprefix("\N{ZERO WIDTH NO-BREAK SPACE}").lstrip()
    return text.partition("?>")[2].lstrip() if text.startswith("<?xml") else text


class _Editing:
    """Where a robot file is to be changed; the parser gives the bytes at which tags begin."""

    def __init__(self, content: bytes, joints: Mapping[str, JointTerms], path: Path) -> None:
        self.changes: list[_Change] = []
        self._content, self._joints, self._path = content, joints, path
        self._open: list[str] = []
        self._joint: JointTerms | None = None
        self._has_dynamics = False
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.StartDoctypeDeclHandler = self._refuse
        self._parser.Parse(content, True)

    def _refuse(self, *_: object) -> None:
        expected = "a robot description without one"
        raise BadInput(str(self._path), "a document type declaration", expected, code="SPEC030")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self._open.append(tag)
        if self._open == ["robot", "joint"]:
            self._joint, self._has_dynamics = self._joints.get(attributes.get("name", "")), False
        elif self._open == ["robot", "joint", "dynamics"] and self._joint is not None:
            self._has_dynamics = True
            self._set(attributes, {"damping": self._joint.damping, "friction": self._joint.friction})
        elif self._open == ["robot", "joint", "limit"] and self._joint is not None and self._joint.effort is not None:
            self._set(attributes, {"effort": self._joint.effort})

    def _set(self, attributes: dict[str, str], values: dict[str, float]) -> None:
        """Another text for those attributes of the tag that have another value."""
        there = {name: value for name, value in values.items() if name in attributes or value != 0}
        new = {name: number(value) for name, value in there.items() if not _is(attributes.get(name, ""), value)}
        if new:
            start = self._parser.CurrentByteIndex
            end = end_of_tag(self._content, start)
            self.changes.append(_Change(start, end, with_attributes(self._content[start:end].decode("utf-8"), new)))

    def _end(self, tag: str) -> None:
        joint = self._joint
        if self._open == ["robot", "joint"] and joint is not None and not self._has_dynamics:
            at = self._parser.CurrentByteIndex
            if joint.damping or joint.friction:
                new = f'  <dynamics damping="{number(joint.damping)}" friction="{number(joint.friction)}"/>\n  '
                self.changes.append(_Change(at, at, new))
        self._open.pop()


def _is(text: str, value: float) -> bool:
    try:
        return float(text) == value
    except ValueError:  # a limit's effort, which nothing has read before
        return False


def end_of_tag(content: bytes, start: int) -> int:
    """The byte after a tag's ``>``, which may stand in a quoted value too."""
    quote = b""
    for at in range(start, len(content)):
        sign = content[at : at + 1]
        if quote:
            quote = b"" if sign == quote else quote
        elif sign in (b'"', b"'"):
            quote = sign
        elif sign == b">":
            return at + 1
    return len(content)


def with_attributes(tag: str, values: Mapping[str, str]) -> str:
    """A start tag with other values of some attributes; the rest of it stays as it is written."""
    for name, value in values.items():
        written = quoteattr(value)
        there = re.search(rf"\s{name}\s*=\s*(\"[^\"]*\"|'[^']*')", tag)
        if there is not None:
            tag = tag[: there.start(1)] + written + tag[there.end(1) :]
            continue
        end = len(tag) - (2 if tag.endswith("/>") else 1)
        body = tag[:end].rstrip()
        tag = f"{body} {name}={written}{tag[len(body) :]}"
    return tag
