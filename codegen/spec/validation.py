"""Validation of a YAML mapping by a pydantic model, with every fault at its line."""

import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from codegen.base.errors import BadInput, Place, nearest_name
from codegen.base.input_files import read_text
from codegen.base.user_text import foreign_letter
from codegen.spec.expression import DECIMAL_COMMA, comma_in_value, with_point
from codegen.spec.quantity import split_quantity
from codegen.spec.yaml_text import load_plain

MOST_FAULTS = 1000
"""Faults of keys that are explained; each takes a millisecond, for the nearest of the known keys."""
_NO_NAME = re.compile(r"\d.*|.*\W.*", re.DOTALL)
"""A key that YAML made of a number behind a decimal comma, or of a key and its value without a blank between them."""
NAMED = "a key is a name with `: ` behind it, and a number has a decimal point"
EXAMPLE = 60
"""Most characters of a value that a message repeats in a suggestion."""
Model = TypeVar("Model", bound=BaseModel)

_EXPECTED = {
    "string_type": "text",
    "string_unicode": "text without half a pair of surrogates",
    "list_type": "a list",
    "dict_type": "a mapping",
    "model_type": "a mapping",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "greater_than_equal": "0 or a positive whole number",
    "int_parsing_size": "a whole number of at most 4300 digits",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
}


def read_model(path: Path, model: type[Model], expected: str) -> Model:
    """A YAML file as an instance of ``model``; ``expected`` names the file. Raises BadInput as ``validate``."""
    document, places = load_plain(read_text(path, expected), path.name)
    return validate(model, document, places, path.name)


def validate(model: type[Model], data: Any, places: Mapping[str, Place], file: str) -> Model:
    """``data`` as an instance of ``model``, whose validators may raise ``ValueError(BadInput)``, without a place.

    Raises BadInput for a missing key, an unknown key or a wrong value; ``others`` has the further faults.
    """
    try:
        return model.model_validate(data)
    except ValidationError as error:
        found = error.errors()[:MOST_FAULTS]
        first, *others = [_explain(fault, found, model, places, file) for fault in _distinct(found, model)]
        first.others = tuple(others)
        raise first from None


def with_known_keys(model: type[Model], data: Any) -> Model | None:
    """``data`` as an instance of ``model`` with unknown keys renamed to the missing key they resemble, or left out.

    Values of the wrong type are left out with their section, or replaced, as ``_without_value`` says. So that further
    faults can be found in the same run. None where this does not make it valid.
    """
    data = deepcopy(data)
    try:
        return model.model_validate(data)
    except ValidationError as error:
        if error.error_count() > MOST_FAULTS:
            return None
        for fault in error.errors():
            if fault["type"] == "extra_forbidden":
                *above, name = _steps(fault)
                section = data
                for step in above:
                    section = section[step]
                meant = nearest_name(str(name), _known_keys(model, above))
                value = section.pop(name, None)
                if meant and meant not in section:
                    section[meant] = value
    try:
        return model.model_validate(data)
    except ValidationError as error:
        for fault in error.errors():
            _without_value(model, data, _steps(fault))
    try:
        return model.model_validate(data)
    except ValidationError:
        return None


def _without_value(model: type[BaseModel], data: Any, steps: Sequence[Any]) -> None:
    """Take a value of the wrong type out of ``data``: a number that must be there is 1, a parameter is left out.

    Of other sections that may be absent, all is left out, since what else they hold may depend on the value. A value in
    a section that must be there remains.
    """
    match steps:
        case ["parameters", name, "value"] if "parameters" in data:
            data["parameters"][name]["value"] = "1"
        case ["observer", "sample_time"] if "observer" in data:
            data["observer"]["sample_time"] = "1"
        case ["parameters", name, *_] if "parameters" in data:
            data["parameters"].pop(name, None)
        case [section, *_] if not model.model_fields[section].is_required():
            data.pop(section, None)


def _distinct(errors: list[ErrorDetails], model: type[BaseModel]) -> list[ErrorDetails]:
    """One of pydantic's errors for each fault of the author, unknown keys first.

    pydantic reports all alternatives of a union; one is chosen: for a gain that is a mapping, the error of its range.
    An unknown key that resembles a missing key of the same section is a misspelt one, so the missing key is not
    reported.
    """
    ordered = sorted(errors, key=lambda e: (e["type"] != "extra_forbidden", e["loc"][-1:] != ("free",)))
    chosen: dict[tuple[int | str, ...], ErrorDetails] = {}
    meant: set[tuple[int | str, ...]] = set()
    for fault in ordered:
        loc = fault["loc"]
        if fault["type"] == "extra_forbidden":
            known = _known_keys(model, _steps(fault)[:-1])
            meant.add((*loc[:-1], nearest_name(str(loc[-1]), known) or ""))
        elif fault["type"] == "missing" and loc in meant:
            continue
        variant = next((k for k, s in enumerate(loc) if _is_variant(s)), len(loc))
        chosen.setdefault(loc[:variant], fault)
    return list(chosen.values())


def _explain(
    fault: ErrorDetails, faults: list[ErrorDetails], model: type[BaseModel], places: Mapping[str, Place], file: str
) -> BadInput:
    steps = _steps(fault)
    key = ""
    for step in steps:
        key += f"[{step}]" if isinstance(step, int) else (f".{step}" if key else str(step))
    place = nearest_place(key, places, file)
    match fault["type"]:
        case "missing":
            examples = _field_examples(model, steps)
            expected = f"`{steps[-1]}:`{f', such as {examples}' if examples else ''}"
            return BadInput(place, f"key `{key}` is missing", expected, code="SPEC003")
        case "extra_forbidden":
            known = _known_keys(model, steps[:-1])
            name = str(steps[-1])
            nearest, expected = nearest_name(name, known), f"one of {', '.join(known)}"
            if _NO_NAME.fullmatch(name):
                expected += f"; {NAMED}"
            elif nearest is None and "parameters" in known and len(steps) > 1:
                expected += f"; a parameter is given as `parameters: {{{name}: …}}`"
            expected += _right_place(model, steps)
            found = f"unknown key `{name}`{foreign_letter(name)}"
            return BadInput(place, found, expected, nearest, code="SPEC004")
        case "value_error" if isinstance(fault["ctx"]["error"].args[0], BadInput):
            refused: BadInput = fault["ctx"]["error"].args[0]
            return refused.at(place)
        case "value_error":
            expected = str(fault["ctx"]["error"]).removeprefix("expected ")
        case "literal_error":
            expected = str(fault["ctx"]["expected"])
            if any(f["type"] == "list_type" and f["loc"][: len(steps)] == fault["loc"][: len(steps)] for f in faults):
                expected += ", or a list"
        case "model_type" if keys := _known_keys(model, steps):
            expected = f"a mapping with {', '.join(keys)}{_as_mapping(fault['input'], keys)}"
        case "list_type" if (keys := _known_keys(model, steps)) != _known_keys(model, steps[:-1]):
            expected = f"a list of mappings with {', '.join(keys)}"
        case other:
            expected = _EXPECTED.get(other, fault["msg"])
            names = [step for step in steps if isinstance(step, str)]
            if other in ("list_type", "dict_type") and names and (examples := _field_examples(model, names)):
                expected += f", as in `{names[-1]}: {examples}`"
    found = fault["input"]
    if found is None and isinstance(steps[-1], str) and _NO_NAME.fullmatch(steps[-1]):
        expected += f"; {NAMED}"
    if fault["type"] in ("value_error", "model_type") and isinstance(found, str) and comma_in_value(found):
        words = f"`{found}` with {DECIMAL_COMMA}"
        return BadInput(place, words, f"a decimal point: {with_point(found)}", code="SPEC006")
    nearest = nearest_name(str(found), re.findall(r"'(\w+)'", expected)) if fault["type"] == "literal_error" else None
    words = "nothing" if found is None else "a mapping" if isinstance(found, dict) else f"`{found}`"
    words = f"a list of {len(found)}" if isinstance(found, list) else words
    code = "SPEC007" if fault["type"] == "greater_than_equal" else "SPEC006"
    return BadInput(place, words, expected, nearest, code=code)


def _as_mapping(found: object, keys: Sequence[str]) -> str:
    """The suggestion of a mapping for a number, a number with a unit, or a unit; "" for anything else."""
    if isinstance(found, bool) or not isinstance(found, (str, int, float)) or len(str(found)) > EXAMPLE:
        return ""
    if {"value", "unit"} <= {*keys}:
        value, unit = split_quantity(str(found)) or (found, "UNIT")
        is_value = unit != "UNIT" or isinstance(found, (int, float))
        return f", as in `{{value: {value}, unit: {unit}}}`" if is_value else ""
    return f", as in `{{unit: {found}}}`" if [*keys] == ["unit"] and isinstance(found, str) else ""


def _steps(fault: ErrorDetails) -> list[Any]:
    """The path of a fault in the file: keys, and numbers of list items."""
    return [s for s in fault["loc"] if isinstance(s, int) or not _is_variant(s)]


def _is_variant(step: object) -> bool:
    """Whether a step of pydantic's path is an alternative of a union, and no key of the file."""
    return isinstance(step, str) and (
        step.startswith(("function-before", "list[", "literal[", "constrained")) or step in ("nullable", "FreeSection")
    )


def nearest_place(key: str, places: Mapping[str, Place], file: str) -> Place:
    """The place of a key: its line, or that of its nearest parent with a line."""
    trimmed = key
    while trimmed and trimmed not in places:
        trimmed = trimmed[: max(trimmed.rfind("."), trimmed.rfind("["), 0)]
    line = places[trimmed].line if trimmed else None
    return Place(file, line, key)


def _known_keys(model: type[BaseModel], steps: Sequence[Any]) -> list[str]:
    return sorted(_section(model, steps).model_fields)


def _right_place(model: type[BaseModel], steps: Sequence[Any]) -> str:
    """The words "; `gains:` belongs under `observer:`" for a known key in the wrong section; "" where none has it."""
    name, fields = steps[-1], model.model_fields
    if name in fields:
        return f"; `{name}:` belongs at the beginning of a line, in no section"
    single = {k: _inner_model(f.annotation) for k, f in fields.items() if get_origin(f.annotation) not in (dict, list)}
    above = [f"`{key}:`" for key, section in single.items() if section and name in section.model_fields]
    return f"; `{name}:` belongs under {' or '.join(above)}" if above else ""


def _field_examples(model: type[BaseModel], steps: Sequence[Any]) -> str:
    """The examples of a key's value in the schema, joined by "or"; "" without any."""
    field = _section(model, steps[:-1]).model_fields.get(steps[-1])
    return " or ".join(str(example).replace("'", "") for example in (field and field.examples) or ())


def _section(model: type[BaseModel], steps: Sequence[Any]) -> type[BaseModel]:
    """The model of the section at these steps of a key, or of the last one above that has a model."""
    section = model
    for step in steps:
        field = section.model_fields.get(step) if isinstance(step, str) else None
        section = (_inner_model(field.annotation) if field else None) or section
    return section


def _inner_model(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_inner_model, get_args(annotation))), None)
