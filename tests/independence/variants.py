"""Every machine with every observer: a spec's text with its observer, laws and effects changed, and the two built."""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from friction.samples import DYNAMIC, draw
from observers.cases import seeded
from ruamel.yaml import YAML

from codegen.effects.declare import add_declared_effects
from codegen.friction import LAWS
from codegen.mechanics import build_system
from codegen.observers import Observer, build_observer
from codegen.spec import Spec, parse_spec
from tests.machines import CART, TEXTS

SPECS = Path(__file__).parents[2] / "specs"
SHIPPED = [str(path.relative_to(SPECS).with_suffix("")) for path in sorted(SPECS.rglob("*.yaml"))]
SHIPPED = [name for name in SHIPPED if not name.startswith(("gallery/", "data/"))]  # the others' machines
# The cart's third contact slides dependently; without the rail, U depends on x and every observer is admitted.
ROD = CART.replace('[[1, 0, "l*cos(q)"], [0, 1, 1]]', '[[1, "l*cos(q)"], [0, 1]]').replace("name: cart", "name: rod")
ROD = ROD.replace("    - {name: rail, law: coulomb, a: 2, unit: N}\n", "")
WRITTEN = {f"written_{name}": text for name, text in TEXTS.items()} | {"rod": ROD}
MACHINES = [*SHIPPED, *WRITTEN]
STATE_LAWS = [name for name in DYNAMIC if LAWS[name].drives == "state"]
SHAPES = {"": {}, "2": {"exponent": 2}, "1/2": {"exponent": 0.5}, "h": {"h": "s + 0.3*s**2 + tanh(2*s)"}}
LEVEL, FORCE, STATE = ("cfo", "gcfo"), ("to", "gto", "mgto"), ("dfo", "gdfo")
SINGLE = ("cfo", "to", "dfo")
H = 0.0005
TRUE_LEVELS = (0.5, 4.0)


@dataclass(frozen=True)
class Variant:
    """One observer on one machine.

    Attributes:
        option: the h of a level observer, or the law of a state observer; "" for the others.
        effects: whether the machine has declared effects, some of which act through g and some through contacts.
    """

    machine: str
    kind: str
    velocity: str
    option: str
    effects: bool

    @property
    def name(self) -> str:
        parts = (self.machine, self.kind, self.velocity, self.option, "effects" if self.effects else "")
        return "-".join(p.replace("/", "_") for p in parts if p)

    def generator(self, word: str) -> np.random.Generator:
        return seeded(word, self.name)


def text_of(machine: str) -> str:
    return WRITTEN[machine] if machine in WRITTEN else (SPECS / f"{machine}.yaml").read_text()


@cache
def contents(machine: str) -> dict[str, Any]:
    return dict(YAML(typ="safe").load(text_of(machine)))


@cache
def shape(machine: str) -> tuple[list[str], list[str], list[str]]:
    """The machine's coordinates, contacts and inputs."""
    spec = parse_spec(text_of(machine), SPECS / f"{machine}.yaml")
    return [c.name for c in spec.coordinates], [c.name for c in spec.contacts], [w.name for w in spec.inputs]


def variants() -> list[Variant]:
    """The whole product."""
    found = []
    for machine in MACHINES:
        coordinates, contacts, _ = shape(machine)
        for kind in (*LEVEL, *FORCE, *STATE):
            if kind in SINGLE and len(coordinates) + len(contacts) > 2:
                continue
            if kind not in ("to", "gto") and len(contacts) > len(coordinates):
                continue  # refused: contacts that slide dependently
            options = list(SHAPES) if kind in LEVEL else STATE_LAWS if kind in STATE else [""]
            found += [
                Variant(machine, kind, velocity, option, effects)
                for option in options
                for velocity in ("measured", "estimated")
                for effects in (False, True)
            ]
    return found


def write(variant: Variant) -> str:
    """The variant's spec."""
    generator = variant.generator("spec")
    entries = {k: v for k, v in contents(variant.machine).items() if k not in ("simulation", "log", "effects")}
    coordinates, contacts, inputs = shape(variant.machine)
    observer: dict[str, Any] = {"kind": variant.kind, "velocity": variant.velocity, "sample_time": H}
    observer["gains"] = _gains(variant, len(coordinates), len(contacts), generator)
    if variant.kind in LEVEL:
        observer |= SHAPES[variant.option]
    if variant.kind in STATE:
        laws = {name: _law(variant.option, k) for k, name in enumerate(contacts)}
        ranged = any(c["name"] not in laws for c in entries.get("friction", {}).get("contacts", ()))
        if "urdf" in entries or "lagrangian" in entries or ranged:  # the observer's assumption, in place of the plant's
            observer["laws"] = laws
        else:
            entries["friction"] = {
                **entries["friction"],
                "contacts": [
                    {k: v for k, v in c.items() if k in ("name", "unit", "bodies", "along")} | laws[c["name"]]
                    for c in entries["friction"]["contacts"]
                ],
            }
        entries["envelope"] = dict(entries.get("envelope", {})) | {f"a_{c}": list(TRUE_LEVELS) for c in contacts}
    entries["observer"] = observer
    if variant.effects:
        entries["effects"] = _effects(coordinates, contacts, inputs)
    return _dumped(entries)


def build(variant: Variant) -> tuple[Spec, Observer]:
    spec = parse_spec(write(variant), SPECS / f"{variant.machine}.yaml")
    return spec, build_observer(spec, add_declared_effects(build_system(spec), spec))


def _effects(coordinates: list[str], contacts: list[str], inputs: list[str]) -> list[dict[str, Any]]:
    first, last = contacts[0], contacts[-1]
    placed: list[tuple[str, str, dict[str, float]]] = [
        ("viscous", first, {"b": 0.4}),
        ("stribeck", last, {"delta": 0.7, "v_s": 0.3}),
        ("viscous_asymmetry", last, {"d_b": 0.2}),
        ("coulomb_asymmetry", first, {"d": 0.0002}),
        ("quadratic_drag", coordinates[-1], {"c": 0.6}),
        ("cogging", coordinates[0], {"amplitude": 0.5, "period": 0.2, "phase": 0.4}),
        ("inertia_error", coordinates[0], {"delta": 0.1}),
        ("input_gain", inputs[0], {"gain": 1.1}),
    ]
    return [{"kind": kind, "on": on, "parameters": p} for kind, on, p in placed]


def _gains(variant: Variant, n: int, contacts: int, generator: np.random.Generator) -> dict[str, Any]:
    """Full matrices, diagonal above three coordinates; the diagonal has the sign that stability wants, the rest any."""

    def full(rows: int, columns: int, sign: float) -> Any:
        matrix = generator.uniform(-3, 3, (rows, columns)) * (n <= 3)
        k = min(rows, columns)
        matrix[range(k), range(k)] = sign * generator.uniform(2, 20, k)
        return [[round(float(e), 4) for e in row] for row in matrix]

    rows = n if variant.kind in ("to", "gto") else contacts
    if variant.kind in LEVEL:
        gains = {"K_F": full(contacts, contacts, 1)}
    elif variant.kind in FORCE:
        gains = {"K_1": full(rows, n, -1), "K_2": full(rows, n, -1)}
    else:
        sign = -1 if variant.velocity == "estimated" else 1
        gains = {"K_a": full(contacts, contacts, sign), "K_f1": full(contacts, n, 1), "K_f2": full(contacts, n, 1)}
    return gains | ({"K_v": full(n, n, 1)} if variant.velocity == "estimated" else {})


def _law(law: str, seed: int) -> dict[str, Any]:
    return {"law": law, **{name: round(value, 6) for name, value in draw(law, seed).items()}}


def _dumped(entries: dict[str, Any]) -> str:
    stream = io.StringIO()
    YAML(typ="safe").dump(entries, stream)
    return stream.getvalue()
