"""What holds of every kind of observer, found by the registry: a new kind is tested without a line here."""

from __future__ import annotations

import pkgutil
from importlib import import_module
from itertools import product
from pathlib import Path

import pytest

import codegen.observers
from codegen.analysis.error_dynamics import derive_error_dynamics
from codegen.base.errors import BadInput
from codegen.observers import OBSERVERS, Observer, ObserverKind, observer_of
from codegen.program import build_program, lower
from codegen.spec import parse_spec

ONE = (Path(__file__).parents[2] / "specs" / "one_mass.yaml").read_text(encoding="utf-8")
CONTACTS = ("law: coulomb, a: 50", "law: dahl, a: 50, c: 100")
"""A contact of constant level, and one with a state: one of the two is what a kind is for."""


def on_one_mass(kind: str, velocity: str) -> Observer:
    """The observer on one mass with gains of 1 or -1, of whichever signs and contact it admits."""
    gains = [gain for gain in OBSERVERS[kind].gains if gain != "K_v" or velocity == "estimated"]
    faults = []
    for contact, signs in product(CONTACTS, product((1, -1), repeat=len(gains))):
        text = ONE.replace(CONTACTS[0], contact).replace("kind: cfo", f"kind: {kind}")
        text = text.replace("velocity: estimated", f"velocity: {velocity}")
        written = ", ".join(f"{gain}: {sign}" for gain, sign in zip(gains, signs, strict=True))
        try:
            return observer_of(parse_spec(text.replace("K_F: 10, K_v: 100", written), Path("one.yaml")))
        except BadInput as fault:
            faults.append(str(fault))
    raise AssertionError(faults)


def test_every_kind_in_the_folder_is_registered() -> None:
    package = codegen.observers
    files = [import_module(f"{package.__name__}.{each.name}") for each in pkgutil.iter_modules(package.__path__)]
    kinds = [kinds for file in files for kinds in vars(file).values() if isinstance(kinds, dict)]
    found = {n: kind for each in kinds for n, kind in each.items() if isinstance(kind, ObserverKind)}
    assert found == OBSERVERS


@pytest.mark.parametrize("velocity", ["measured", "estimated"])
@pytest.mark.parametrize("kind", OBSERVERS)
def test_it_is_what_it_says_of_itself(kind: str, velocity: str) -> None:
    """Its gains are those that it reads; its errors are of contacts or not; its equations have Ψ and code.

    ``derive_error_dynamics`` raises where e = 0 is no equilibrium of an observer that does not say so.
    """
    said, observer = OBSERVERS[kind], on_one_mass(kind, velocity)
    idle = {"K_v"} if velocity == "measured" else set()
    assert {gain.name for gain in observer.gains} == {*said.gains} - idle
    of_friction = [error for error in observer.errors if error.of != "velocity"]
    assert of_friction and all((error.contact is not None) == said.by_contact for error in of_friction)
    dynamics = derive_error_dynamics(observer)
    assert dynamics.jacobian.shape == (len(observer.errors),) * 2
    assert lower(build_program(observer)).operations().additions > 0


@pytest.mark.parametrize("kind", OBSERVERS)
def test_a_general_form_takes_the_same_gains_and_options(kind: str) -> None:
    """Who is told to write the general form's name has nothing else to change."""
    general = OBSERVERS[OBSERVERS[kind].general or kind]
    assert general.general == ""
    assert (general.gains, general.options) == (OBSERVERS[kind].gains, OBSERVERS[kind].options)
