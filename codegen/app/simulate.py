"""``stiction simulate``: a log of the plant of a spec."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from codegen.app.derived import Source, derived_from
from codegen.base.border import verb
from codegen.base.errors import refuse_unknown
from codegen.base.files import refuse_target
from codegen.base.result import Result, named
from codegen.simulate.closed_loop import simulate as simulate_plant
from codegen.simulate.loop_run import Excursion, excursions, write_log

PLANTS = ("own", "mujoco")


@dataclass(frozen=True, repr=False)
class Simulated(Result):
    """The result of ``simulate``: a written log.

    Attributes:
        excursions: of the motion from the spec's envelope, the largest first.
        notes: on what another simulator's plant represents approximately, or not at all.
        gain, share: ``gain`` of ``cancellation:`` and ``cancel`` of ``simulation:``; the input cancels their product
            times the friction estimate. None if it cancels none.
    """

    template = "simulated"
    path: Path
    excursions: tuple[Excursion, ...]
    gain: float | None = None
    share: float | None = None
    notes: tuple[str, ...] = ()

    @property
    def summary(self) -> Mapping[str, object]:
        left = ", ".join(e.name for e in self.excursions)
        return {"log": self.path, "outside the envelope": left or "never"}

    @property
    def content(self) -> dict[str, Any]:
        excursions = [asdict(e) for e in self.excursions]
        of_plant = named(self, "gain share notes")
        return {"format": "stiction-simulation/1", "log": str(self.path), "excursions": excursions, **of_plant}

    def text(self, **options: object) -> str:
        """The result in words; ``paths``: whether the log is named."""
        return super().text(**{"paths": True, **options})


@verb
def simulate(
    source: Source, out: str | Path, progress: Callable[[str, float], None] | None = None, plant: str = PLANTS[0]
) -> Simulated:
    """Write a log of the plant of a spec, with its declared effects, driven as its ``simulation:`` section says.

    Args:
        out: the log, .csv.
        progress: called with the step and the share of the work that is done, 0 to 1.
        plant: ``own``, or ``mujoco``: the exported model in MuJoCo.

    Raises:
        BadInput: for a bad spec or one without ``simulation:``, another plant, a MuJoCo that
            is not installed or cannot represent the machine, or a file that cannot be written.
    """
    refuse_unknown(plant, PLANTS, "--plant", "", " or ".join(PLANTS), code="CALL001")
    target = Path(out)
    refuse_target(target, {"the spec itself": Path(source)}, (".csv", ".txt"))
    machine = derived_from(source)
    spec, system = machine.spec, machine.system
    make_plant, notes = None, tuple[str, ...]()
    if plant != PLANTS[0]:
        from codegen.export.mujoco_plant import mujoco_plant

        make_plant, model = mujoco_plant(spec, system)
        notes = tuple(remark.text for remark in model.remarks if remark.held != "exact")
    run = simulate_plant(spec, system, partial(progress, "simulate") if progress else None, make_plant=make_plant)
    write_log(target, spec, run)
    share = spec.simulation.cancel if spec.simulation is not None else None
    gain = float(spec.cancellation.gain) if spec.cancellation is not None else 1.0
    return Simulated(target, excursions(spec, run), None if share is None else gain, share, notes)
