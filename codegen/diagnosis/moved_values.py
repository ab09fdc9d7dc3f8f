"""Parameters that the written spec has at another value than was declared, within what their tolerance allows.

A parameter with a tolerance is refitted before any effect is credited. Where it goes so far that it is an error, the
verdict says so; where it stays nearer, the value is written all the same, and a reader must know it.
"""

from __future__ import annotations

from codegen.diagnosis.answer import Answer
from codegen.diagnosis.estimate import estimate
from codegen.diagnosis.measure import Drive
from codegen.diagnosis.output_error import Fit
from codegen.diagnosis.residual import Problem, inverse_dynamics_residual


def moved_values(answer: Answer, fit: Fit, problem: Problem, material: float) -> list[str]:
    """In words for a remark: the parameters whose interval excludes the declared value, and where that matters.

    Args:
        fit: in which the written values were found.
        material: share of the drive force that the change must make.
    """
    written, declared = answer.adopted, problem.system
    if written is None:
        return []
    told = {error.name for error in answer.errors}
    found = estimate(fit).moved
    drive = Drive(written, problem.motion)
    words = []
    for s in problem.uncertain:
        was, now = float(declared.values[s]), float(written.values[s])
        low, high = found.get(s.name, (now, (now, now)))[1]
        if s.name in told or was == now or low <= was <= high or not low <= now <= high:
            continue
        as_declared = written.with_parameters({s: declared.values[s]}, {})
        share = drive.share(drive.residual - inverse_dynamics_residual(as_declared, problem.motion))
        if share < material:
            continue
        unit, tolerance = declared.units[s], problem.deviation[s]
        behind = "" if unit == "1" else f" {unit}"
        part = abs(now - was) / tolerance
        where = "within" if part <= 1 else f"{part:.2g} times"
        of = f"{where} its tolerance of {100 * tolerance / abs(was):.3g} %"
        words.append(
            f"the written spec has {s.name} = {now:.5g}{behind} in place of {was:.5g}{behind} ({of}; 95 %: {low:.6g} "
            f"to {high:.6g}): a change of {100 * share:.2g} % of the drive force"
        )
    return words
