"""``Machine``: a spec, what is derived from it, and the verbs as its methods."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import MethodType
from typing import TYPE_CHECKING, Generic, TypeVar

from codegen.app.derived import Derived
from codegen.app.verify import Verified, verify, verify_machine
from codegen.base.border import verb
from codegen.spec import read_spec

if TYPE_CHECKING:
    from codegen.analysis.analysis import Analysis
    from codegen.app.cancel import CancelReport
    from codegen.app.certify import Certified
    from codegen.app.diagnose import Diagnosed
    from codegen.app.export import Exported
    from codegen.app.gains import GainReport
    from codegen.app.generate import Generated
    from codegen.app.simulate import Simulated
    from codegen.app.watch import Watched
    from codegen.replay.over_log import Replayed

Result = TypeVar("Result")
STAGES = ("spec", "system", "observer", "analysis", "program", "outcome", "files")
"""Properties of a machine, as in docs/how-to/python.md."""


class _Verb(Generic[Result]):
    """A verb as a method: the function of that name in its module, which is imported at the first access."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, machine: object, owner: type) -> Callable[..., Result]:
        function: Callable[..., Result] = getattr(import_module(f"codegen.app.{self._name}"), self._name)
        return function if machine is None else MethodType(function, machine)


class Machine(Derived):
    """A spec, all that is derived from it, and the verbs, with the arguments of the functions of these names."""

    cancel: _Verb[CancelReport] = _Verb()
    certify: _Verb[Certified] = _Verb()
    check: _Verb[Machine] = _Verb()
    derive: _Verb[Analysis] = _Verb()
    diagnose: _Verb[Diagnosed] = _Verb()
    export: _Verb[Exported] = _Verb()
    gains: _Verb[GainReport] = _Verb()
    generate: _Verb[Generated] = _Verb()
    replay: _Verb[Replayed] = _Verb()
    simulate: _Verb[Simulated] = _Verb()
    watch: _Verb[Watched] = _Verb()

    def __dir__(self) -> list[str]:
        """The verbs and the stages, without internal methods."""
        verbs = [name for name, value in vars(Machine).items() if isinstance(value, _Verb)]
        return sorted([*verbs, "verify", *STAGES])

    @verb
    def verify(self, certificate: str | Path | None = None) -> Verified:
        """Check a certificate of this machine by the independent checker; by default that of ``files``."""
        return verify_machine(self) if certificate is None else verify(certificate, self.spec.path)


@verb
def load(path: str | Path) -> Machine:
    """The machine of a spec file.

    Raises BadInput for a file that is no spec; other faults are reported by ``check`` and the other verbs.
    """
    return Machine(read_spec(path))
