"""Places in a spec of the quantities of the generated code, for messages."""

from collections.abc import Iterator
from contextlib import contextmanager

from codegen.base.errors import BadInput, Place
from codegen.spec.model import Spec

CODE = "generated code"
"""Place of a BadInput about generated code, raised where the spec is not known."""


def place_of(spec: Spec, name: str) -> Place:
    """File and line of a declared name; for a derived one, such as F_hat_rail, those of the name it is made of."""
    keys = _declared(spec)
    if name in keys:
        return spec.place(keys[name])
    before = {n: k for n, k in _heads(spec).items() if name.startswith(f"{n}_") or name == n}
    behind = {n: k for n, k in keys.items() if name.endswith(f"_{n}")}
    found = before or behind
    return spec.place(found[max(found, key=len)] if found else "name")


@contextmanager
def with_place(spec: Spec) -> Iterator[None]:
    """Context that adds a place to a BadInput raised without the spec: that of the name it is about, or of the spec."""
    try:
        yield
    except BadInput as error:
        if error.about is None and error.place.file != CODE:
            raise
        place = Place(spec.place("name").file, None, CODE) if error.about is None else place_of(spec, error.about)
        raise error.at(place) from None


def _declared(spec: Spec) -> dict[str, str]:
    keys = {p.name: f"parameters.{p.name}" for p in spec.parameters}
    keys |= {c.name: f"friction.contacts[{k}].name" for k, c in enumerate(spec.contacts)}
    keys |= {c.velocity: f"coordinates.{c.name}.velocity" for c in spec.coordinates}
    keys |= {c.name: f"coordinates.{c.name}" for c in spec.coordinates}
    return keys | {i.name: f"inputs.{i.name}" for i in spec.inputs}


def _heads(spec: Spec) -> dict[str, str]:
    """First part of the generated name of each gain and of each effect's parameter → its key in the spec."""
    gains = () if spec.observer is None else spec.observer.gains
    keys = {name: f"observer.gains.{name}" for name in gains} | {"sample_time": "observer.sample_time"}
    for k, effect in enumerate(spec.effects):
        for name in effect.parameters:
            keys[f"{effect.kind}_{'_'.join(effect.on)}_{name}"] = f"effects[{k}].parameters.{name}"
    return keys
