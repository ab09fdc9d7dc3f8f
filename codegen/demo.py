"""``stiction demo``: the main job on the embedded default, station by station."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from codegen import pipeline
from codegen.readable import analysis_view, model_view
from codegen.resources import resource_folder
from codegen.stability.certificate.certify import Certificate
from codegen.text import render

SPEC = "belt_axis.yaml"
PLANT = "plants/belt_axis.yaml"


def run_demo(folder: Path, say: Callable[[str], None], tell: Callable[[str, float], None]) -> pipeline.Diagnosed:
    """Derive, certify and generate a belt-driven axis; simulate it with an effect that its spec lacks; find the effect.

    Args:
        folder: where everything is written.
        say: takes each station's words.
        tell: takes progress.
    """
    specs = resource_folder("specs")
    spec = specs / SPEC
    say(render("text/demo_spec.txt.j2", file=SPEC, **model_view(pipeline.check(spec))))
    say(render("text/demo_derive.txt.j2", **analysis_view(pipeline.derive(spec))))
    generated = pipeline.generate(spec, folder / "generated" / "belt_axis")
    if isinstance(generated.outcome, Certificate):
        report = pipeline.verify(generated.folder / "certificate.json", spec)
        say(render("text/demo_certify.txt.j2", certificate=generated.outcome, report=report, generated=generated))
    log, test = folder / "train.csv", folder / "test.csv"
    pipeline.simulate(specs / PLANT, log, lambda share: tell("simulate", share / 2))
    pipeline.simulate(specs / "plants" / "belt_axis_test.yaml", test, lambda share: tell("simulate", (1 + share) / 2))
    say(render("text/demo_log.txt.j2", log=log, test=test))
    result = pipeline.diagnose(spec, log, test, folder / "diagnosis", progress=tell)
    say(render("text/diagnosed.txt.j2", result=result, d=result.diagnosis, paths=False))
    say(render("text/demo_paths.txt.j2", generated=generated, result=result))
    return result
