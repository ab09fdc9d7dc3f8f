"""``stiction demo``: all steps of the main job on a shipped example."""

from collections.abc import Callable
from pathlib import Path

from codegen.app.check import check, check_json
from codegen.app.derive import analysis_view, derive
from codegen.app.diagnose import Diagnosed, diagnose
from codegen.app.generate import generate
from codegen.app.simulate import simulate
from codegen.app.verify import verify
from codegen.base.progress import part_of
from codegen.base.resources import resource_folder
from codegen.base.text import render
from codegen.certify.certify import Certificate

SPEC = "belt_axis.yaml"
PLANT = "plants/belt_axis.yaml"
SIMULATED = 0.1
"""Share of the two simulations in the progress; the diagnosis has the rest."""


def run_demo(folder: Path, show: Callable[[str], None], progress: Callable[[str, float], None]) -> Diagnosed:
    """Derive, certify and generate the observer of a belt axis, simulate the axis, and diagnose the simulated log.

    The simulated axis has an effect that its spec lacks.

    Args:
        folder: for the results.
        show: prints a text.
        progress: called with a step and the share of it that is done.
    """
    specs = resource_folder("specs")
    spec = specs / SPEC
    show(render("text/demo_spec.txt.j2", file=SPEC, **check_json(check(spec))))
    show(render("text/demo_derive.txt.j2", **analysis_view(derive(spec))))
    generated = generate(spec, folder / "generated" / "belt_axis")
    if isinstance(generated.outcome, Certificate):
        report = verify(generated.folder / "certificate.json", spec)
        show(
            render("text/demo_certify.txt.j2", certificate=generated.outcome, report=report.report, generated=generated)
        )
    log, test = folder / "train.csv", folder / "test.csv"
    simulate(specs / PLANT, log, part_of(progress, 0, SIMULATED / 2))
    simulate(specs / "plants" / "belt_axis_test.yaml", test, part_of(progress, SIMULATED / 2, SIMULATED))
    show(render("text/demo_log.txt.j2", log=log, test=test))
    result = diagnose(spec, log, test, folder / "diagnosis", progress=part_of(progress, SIMULATED, 1))
    show(result.text(paths=False))
    show(render("text/demo_paths.txt.j2", generated=generated, result=result))
    return result
