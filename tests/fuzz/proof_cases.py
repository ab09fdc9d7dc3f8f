"""Certificates and proofs about the C with damage that knows their format, through their checkers.

That what is accepted is true is tested in tests/checker; here it is that the checker ends, and says what is wrong.
"""

from __future__ import annotations

import copy
import hashlib
import json
import random
from functools import cache
from pathlib import Path
from typing import Any

from codegen.checker import verify

from .case import Case, Stage
from .hostile import NAMES, TEXTS
from .spec_cases import damaged_text
from .verdict import through_main

GENERATED = Path(__file__).parents[2] / "generated"
FOLDERS = (
    *("one_mass", "rig", "rig_to", "emps", "one_mass_dfo", "rig_dfob", "two_mass_gto", "one_mass_domain"),
    *("two_link_arm",),
)
TWIN = "__init__.py"
KERNEL = ("proof.json", "ellipsoid.json")
"""A proof about the C, and what noise and drift do by it, which `verify` reads beside it."""
RATIONALS = (
    *(
        *("0", "1", "-1", "1/2", "-3/7", "1/0", "0/0", "1/-2", "-0", "007", "1.5", "1e5", "9" * 200),
        *("1/" + "9" * 200, "9" * 5000, "٣"),
    ),
    *("1 /2", "+1", "", " 1", "1/2/3", "--1", "nan", "inf", "0x1", "1_0", "1/1" + "0" * 300, "-" + "9" * 400, "½"),
)
OPERATORS = ("+", "*", "neg", "/", "^", "abs", "sin", "cos", "exp", "sqrt", "tan", "log", "", "eval", "__import__")


@cache
def proofs() -> tuple[tuple[str, str], ...]:
    """(Folder, file) of every shipped proof that is checked in a moment."""
    found = [(folder, path.name) for folder in FOLDERS for path in sorted((GENERATED / folder).glob("*.json"))]
    return tuple((folder, name) for folder, name in found if name != "manifest.json")


def proof(seed: int) -> Case:
    """The damaged proof of that number, the certificate that it rests on and its twin beside it."""
    dice = random.Random(f"proof {seed}")
    folder, name = dice.choice(proofs())
    here = GENERATED / folder
    if name in KERNEL:
        return _of_the_kernel(here, name, dice)
    beside = [path for path in map(here.joinpath, KERNEL) if path.exists()]
    files = {path.name: path.read_bytes() for path in (here / name, *beside, *here.glob(f"{folder}.[ch]"))}
    if dice.random() < 0.15:
        source = f"{folder}.{dice.choice('ch')}"
        files[source] = damaged_text(files[source].decode(), dice).encode("utf-8", "surrogatepass")
        content = json.loads(files[name])
        named = content["subject"].get("files", {})
        if source in named and dice.random() < 0.8:  # a certificate of just this code
            named[source] = hashlib.sha256(files[source]).hexdigest()
        files[name] = json.dumps(content).encode()
    else:
        files[name] = damaged(files[name].decode(), dice).encode("utf-8", "surrogatepass")
    return Case(files, stages(name))


def _of_the_kernel(here: Path, name: str, dice: random.Random) -> Case:
    """A damaged proof about the C or a damaged claim of noise and drift, or both sound beside damaged C."""
    beside = [path for path in map(here.joinpath, KERNEL) if path.exists()]
    files = {path.name: path.read_bytes() for path in (*beside, *here.glob(f"{here.name}.[ch]"))}
    name = name if dice.random() < 0.7 else dice.choice(sorted(files))
    damage = damaged if name in KERNEL else damaged_text
    files[name] = damage(files[name].decode(), dice).encode("utf-8", "surrogatepass")
    alone = (Stage("ellipsoid.json itself", through_main("verify", "ellipsoid.json")),) * ("ellipsoid.json" in files)
    return Case(files, (Stage("verify", through_main("verify", "proof.json")), *alone))


def stages(name: str) -> tuple[Stage, ...]:
    """By the checker, and by the verb."""

    def by_checker() -> None:
        try:
            verify.check(Path(name).read_text("utf-8"), Path())
        except (json.JSONDecodeError, UnicodeDecodeError, OSError):
            return  # which the verb says in words
        except verify.Refused as error:
            if len(str(error)) > 1000:
                raise ValueError(f"a refusal of {len(str(error))} characters: {str(error)[:80]}") from None

    return (Stage("verify.py", by_checker), Stage("verify", through_main("verify", name)))


def spots(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    found = [path]
    inner = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in inner:
        found += spots(value, (*path, key))
    return found


def at(node: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        node = node[key]
    return node


def damaged(text: str, dice: random.Random) -> str:
    content = json.loads(text)
    for _ in range(dice.choice([1, 1, 2, 3])):
        paths = spots(content)
        path = dice.choice(paths[1:])
        holder, key, old = at(content, path[:-1]), path[-1], at(content, path)
        other = at(content, dice.choice(paths))
        expression: Any = dice.choice(["1", "x", "0"])
        for _ in range(dice.choice([1, 3, 30, 900])):
            expression = [dice.choice(OPERATORS[:10]), expression] if dice.random() < 0.7 else ["*", expression, "2"]
        values = [None, True, 0, -1, 1.5, 10**30, "", [], {}, [old], {"a": old}, [[]], copy.deepcopy(other), expression]
        values += [
            ["^", "2", "9" * 9],
            ["^", "x", "-5"],
            ["/", "1", "0"],
            ["exp", "9" * 30],
            ["sqrt", "-1"],
            ["cos"],
            [dice.choice(OPERATORS), "1", "2", "3"],
        ]
        match dice.randrange(6):
            case 0:
                del holder[key]
            case 1 | 2:
                holder[key] = dice.choice(RATIONALS)
            case 3:
                holder[key] = dice.choice([*NAMES, *TEXTS])
            case 4:
                holder[key] = dice.choice(values)
            case _:
                if isinstance(holder, list):
                    holder[key : key + 1] = [copy.deepcopy(old)] * dice.choice([2, 3, 40])
                else:
                    holder[dice.choice([*holder, *NAMES])] = copy.deepcopy(old)
        if not isinstance(content, dict) or len(content) < 2:
            break
    made = json.dumps(content, ensure_ascii=dice.random() < 0.9)
    if dice.random() < 0.15:
        made = damaged_text(made, dice)
    if dice.random() < 0.03:
        made = dice.choice(
            [
                "[" * 100000,
                '{"a":' * 5000,
                made + made,
                made[: len(made) // 2],
                "NaN",
                '"' + "x" * 10**6 + '"',
                made.replace('"claim"', '"claim": "", "claim"'),
            ]
        )
    return made
