"""``Machine``: a spec, what is derived from it, and the verbs as its methods."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from codegen.app.derived import Derived
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
    from codegen.app.overrides import Overrides
    from codegen.app.verify import Verified
    from codegen.app.watch import Watched
    from codegen.replay.over_log import Replayed
    from codegen.simulate.simulated import Simulated

File = str | Path


class Machine(Derived):
    """A spec, all that follows from it, and the verbs; a verb's module is imported when it is first called."""

    def check(self) -> Machine:
        """Refuse what any other verb would refuse of the spec, all but its proof; the machine itself."""
        from codegen.app.check import check

        check(self)
        return self

    def derive(self) -> Analysis:
        """Ψ, its characteristic polynomial, the gain conditions and margins."""
        from codegen.app.derive import derive

        return derive(self)

    def gains(self, folder: File | None = None, over: Sequence[str] = ()) -> GainReport:
        """Which gains are stable over the envelope, with what margin, and which to take."""
        from codegen.app.gains import gains

        return gains(self, folder, over)

    def certify(self, out: File | None = None) -> Certified:
        """The certificate or refusal, bounds on the error, and the largest sample times."""
        from codegen.app.certify import certify

        return certify(self, out)

    def generate(
        self,
        folder: File | None = None,
        check_only: bool = False,
        uncertified: bool = False,
        overrides: Overrides | None = None,
    ) -> Generated:
        """Write C, Python, certificate and README."""
        from codegen.app.generate import generate

        return generate(self, folder, check_only, uncertified, overrides)

    def simulate(
        self,
        out: File,
        progress: Callable[[float], None] | None = None,
        method: str = "steps",
        plant: str = "own",
    ) -> Simulated:
        """Write a log of the plant, driven as the spec's ``simulation:`` section says."""
        from codegen.app.simulate import simulate

        return simulate(self, out, progress, method, plant)

    def export(
        self,
        to: str,
        out: File,
        on: str | None = None,
        counts: int | None = None,
        gear: float | None = None,
        into: File | None = None,
    ) -> Exported:
        """Write the machine in another format, such as a model of MuJoCo."""
        from codegen.app.export import export

        return export(self, to, out, on, counts, gear, into)

    def diagnose(
        self,
        log: File | Sequence[File],
        test: File | Sequence[File] | None = None,
        out: File | None = None,
        description: File | None = None,
        columns: Mapping[str, str] | None = None,
        progress: Callable[[str, float], None] | None = None,
        propose: bool = False,
        material: str | float | None = None,
    ) -> Diagnosed:
        """Find the effect that the model lacks in a measured log."""
        from codegen.app.diagnose import diagnose

        return diagnose(self, log, test, out, description, columns, progress, propose, material)

    def verify(self, certificate: File | None = None) -> Verified:
        """Check a certificate of this machine by the independent checker; by default that of ``files``."""
        from codegen.app.verify import verify, verify_machine

        return verify_machine(self) if certificate is None else verify(certificate, self.spec.path)

    def cancel(
        self, folder: File | None = None, hunt: bool = False, progress: Callable[[float], None] | None = None
    ) -> CancelReport:
        """Which friction the inputs can cancel, and the input that does it best."""
        from codegen.app.cancel import cancel

        return cancel(self, folder, hunt, progress)

    def replay(
        self,
        log: File,
        out: File | None = None,
        description: File | None = None,
        columns: Mapping[str, str] | None = None,
        only: Sequence[str] = (),
    ) -> Replayed:
        """Run the generated observer over a log."""
        from codegen.app.replay import replay

        return replay(self, log, out, description, columns, only)

    def watch(
        self,
        log: File,
        columns: Mapping[str, str] | None = None,
        dwell: float | str | None = None,
        follow: bool = False,
    ) -> Watched:
        """Run the observer over rows as they arrive; hold its estimates against the certified bound."""
        from codegen.app.watch import watch

        return watch(self, log, columns, dwell, follow)


@verb
def load(path: File) -> Machine:
    """The machine of a spec file.

    Raises:
        BadInput: for a file that is no spec; what else is wrong with it is said by ``check`` and by the other verbs.
    """
    return Machine(read_spec(path))
