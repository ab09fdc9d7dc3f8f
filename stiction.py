"""Friction observers from a specification: derived, certified, generated, and checked against measured data.

    import stiction

    machine = stiction.load("specs/one_mass.yaml")
    machine.derive()                  # Ψ, gain conditions, margins
    machine.certify()                 # the certificate, or why there is none
    machine.generate("out")           # C and Python
    machine.diagnose("log.csv")       # the effect that the model lacks

A verb is a method of ``Machine`` and a function of this module, ``stiction.derive("specs/one_mass.yaml")``, with the
same typed result. A bad spec or log raises ``BadInput``, a certificate that does not hold ``Refused``; any other
exception is a fault of the tool. The libraries that a verb needs are imported when it is first asked for.
"""

from __future__ import annotations

import gc
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

_OFFERED = {
    "app.cancel": ("cancel", "CancelReport"),
    "app.certify": ("certify", "write_certificate", "Certified"),
    "app.check": ("check",),
    "app.derive": ("derive",),
    "app.derived": ("Overrides",),
    "app.diagnose": ("diagnose", "Diagnosed"),
    "app.export": ("export", "Exported"),
    "app.gains": ("gains", "GainReport"),
    "app.generate": ("generate", "Generated", "generate_fmu", "GeneratedFmu"),
    "app.init": ("init",),
    "app.machine": ("load", "Machine"),
    "app.replay": ("replay", "Replayed"),
    "app.simulate": ("simulate", "Simulated"),
    "app.smt_lib": ("write_smt",),
    "app.verify": ("verify", "Verified"),
    "app.watch": ("watch", "Watched"),
    "base.errors": ("BadInput",),
    "base.progress": ("progress",),
    "checker.verify": ("Refused",),
}
"""Module of ``codegen`` → what of it is offered here."""
_PLACES = {name: module for module, names in _OFFERED.items() for name in names}
INTERRUPTED = 130


def _find_own_codegen() -> None:
    """Import the ``codegen`` that lies beside this file: the working directory may hold a module of that name.

    Raises:
        ImportError: where another ``codegen`` has been imported already.
    """
    here = str(Path(__file__).resolve().parent)
    sys.path.insert(0, here)
    try:
        found = import_module("codegen").__file__
    finally:
        sys.path.remove(here)
    if found is None or Path(found).resolve().parent.parent != Path(here):
        raise ImportError(f"stiction needs its own package codegen, and {found} was imported under that name before")


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("codegen.base.version").VERSION
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__])
    return getattr(import_module(f"codegen.{_PLACES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)


def main() -> None:
    """The command ``stiction``; an interrupt while its libraries are being loaded ends it as one during a verb does."""
    gc.set_threshold(100_000, 50, 50)  # libraries make a million objects that stay: looking through them takes long
    try:
        from codegen.app.cli import main as run

        run()
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(INTERRUPTED)


_find_own_codegen()

__all__ = sorted([*_PLACES, "__version__", "main"])

if __name__ == "__main__":
    main()
