"""The registry of the friction laws holds every law in its folder: a class that is forgotten there would be idle."""

from __future__ import annotations

import inspect
import pkgutil
from importlib import import_module

import codegen.friction
from codegen.friction import LAWS, FrictionLaw


def test_every_law_in_the_folder_is_registered() -> None:
    files = [import_module(f"codegen.friction.{each.name}") for each in pkgutil.iter_modules(codegen.friction.__path__)]
    found = {c for file in files for c in vars(file).values() if inspect.isclass(c) and issubclass(c, FrictionLaw)}
    assert {c for c in found if not inspect.isabstract(c)} == {type(law) for law in LAWS.values()}
