"""The shape of a spec file as a JSON Schema, for an editor that completes and checks keys as one types."""

from __future__ import annotations

from typing import Any

from codegen.spec.schema import SpecDocument

DIALECT = "https://json-schema.org/draft/2020-12/schema"
OF_A_ROBOT = ("coordinates", "friction")
"""Sections that a robot file fills in."""


def json_schema() -> dict[str, Any]:
    """The JSON Schema (2020-12) of the text of a spec, from the models that ``validate`` reads it by.

    It knows keys, and where a number, a text or a list belongs; names, units and expressions are ``check``'s.
    """
    schema = SpecDocument.model_json_schema()
    required = [key for key in schema["required"] if key not in OF_A_ROBOT]
    robot = {"required": ["urdf"], "properties": {"urdf": {"not": {"type": "null"}}}}
    choice = {"if": robot, "else": {"required": list(OF_A_ROBOT)}}
    title = "A machine, its friction and its observer"
    return {"$schema": DIALECT, **schema, **choice, "title": title, "required": required}
