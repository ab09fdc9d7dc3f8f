"""Wrong declared values as an alternative explanation to missing effects.

Forward selection keeps parameters within a few tolerances, so that they do not absorb a missing effect. If several are
wrong together, as with an unknown payload, an effect may explain the log in their place. So if the refit ends at that
limit, it is repeated without it, with the tolerances as Gaussian prior only. If that explains more than the effects, or
as much with fewer changes of the declared model, effects are sought in addition to it. A parameter without a tolerance
is not fitted; if another value of it alone would explain a residual that no effect explains, it is reported.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy
from numpy.typing import NDArray

from codegen.base.arrays import Array
from codegen.base.significant import in_percent, with_deserved_digits
from codegen.diagnosis.evidence.estimate import estimate
from codegen.diagnosis.fit.drive import residual_without_levels
from codegen.diagnosis.fit.force_rows import ForceRows, force_rows
from codegen.diagnosis.fit.linear import regressed
from codegen.diagnosis.fit.measure import Drive, driving_force_name, inverse_mass
from codegen.diagnosis.fit.output_error import AT_END, BLOCKS, WITHIN, Fit, segment_cost
from codegen.diagnosis.fit.residual import Problem, evaluate_forces, inverse_dynamics_residual
from codegen.diagnosis.fit.search import Search, tolerances_away
from codegen.diagnosis.fit.trial import in_unit, with_effects, with_values
from codegen.diagnosis.results import Fact, FoundEffect, titles
from codegen.diagnosis.selection.forward_selection import Outcome
from codegen.diagnosis.selection.parsimony import BETTER
from codegen.diagnosis.verdict.admission import Measured, is_shown_worse
from codegen.diagnosis.verdict.answer import Answer
from codegen.mechanics.system import System
from codegen.spec.model import Spec

EXPLAINS = 0.8
"""Least share of the squared force residual that a reported value explains on held-out blocks of the training log."""
FAR_LESS = 1 / 3
"""Effects are refused if another value, or a force in time, leaves less than this share of the squared residual force
that they leave."""
MOST_VALUES = 3
"""Values that one sentence gives."""
MIRRORED = 0.1
"""Relative difference up to which a force counts as −2 times a term of the spec, whose sign may be wrong."""


def released(search: Search, base: Fit, outcome: Outcome) -> tuple[Search, Fit] | None:
    """The search without limits of toleranced parameters, and its refit; None if one effect explains as much."""
    freed = search.without_limits(base)
    if freed is None:
        return None
    rival = base if len(outcome.parts) > 1 else outcome.final
    return freed if is_better(*freed, search, rival) else None


def is_better(free: Search, fit: Fit, search: Search, other: Fit) -> bool:
    """Whether a fit without limits explains the log better than one within them, for its number of changes.

    The score is the log-likelihood, tempered by the share of independent residuals, less ``BETTER`` nats for each
    change of the declared model: an effect, a parameter ``WITHIN`` tolerances or more away, or a link with several such
    parameters (``wrong_links``). The first fit is better if its score is higher by ``BETTER``/2.
    """
    gain = _gain(fit, other)
    return gain + BETTER * (_changes(search, other) - _changes(free, fit)) > BETTER / 2


def _gain(fit: Fit, other: Fit) -> float:
    """Tempered log-likelihood of a fit less that of another, nats."""
    return fit.prior.tempering * (segment_cost(other.residual) - segment_cost(fit.residual))


def _changes(search: Search, fit: Fit) -> int:
    """Number of effects and of values ``WITHIN`` tolerances or more away, where those of ``wrong_links`` count once."""
    values = fit.theta[: len(search.refitted_symbols)]
    far = np.flatnonzero(tolerances_away(search, values) >= AT_END * WITHIN)
    links = wrong_links(search, values)
    if links is None:
        return len(fit.trial.parts) + len(far)
    others = [k for k in far if search.refitted_symbols[k] not in search.problem.changes]
    return len(fit.trial.parts) + len(others) + len(links)


def wrong_links(search: Search, values: Array) -> list[int] | None:
    """Indices of the fewest links of an arm whose wrong numbers explain all link parameters that are far off.

    A load on one link is one change of the model. But it changes up to ten parameters of this link, and some of the
    links before it, to which base parameters assign part of the mass. The distances d of link parameters from their
    declared values, in tolerances, are regressed on the changes C of these by the numbers of the links S in the robot
    file,

        min over z of |d − C_S z|²,

    and links are added to S, the one that leaves least first, until no parameter is left ``WITHIN`` tolerances or more
    away. None if S has more links than half of those parameters, since a link has up to ten numbers and can explain
    errors that have nothing to do with each other, or if no parameter is far off.
    """
    problem = search.problem
    places = [k for k, s in enumerate(search.refitted_symbols) if s in problem.changes]
    if not places:
        return None
    changes = np.array([problem.changes[search.refitted_symbols[k]] for k in places])  # (p, links, numbers)
    size = np.linalg.norm(changes, axis=(1, 2))
    left = off = (values - search.declared)[places] / size
    columns, chosen = changes / size[:, None, None], list[int]()
    many = int((np.abs(off) >= AT_END * WITHIN).sum())
    while (np.abs(left) >= AT_END * WITHIN).any():
        if 2 * (len(chosen) + 1) > many:
            return None
        others = [k for k in range(columns.shape[1]) if k not in chosen]
        tried = {k: regressed(off, columns[:, [*chosen, k]].reshape(len(off), -1))[1] for k in others}
        best = min(tried, key=lambda k: float(tried[k] @ tried[k]), default=None)
        if best is None:
            return None
        left, chosen = tried[best], [*chosen, best]
    return sorted(chosen) or None


def wrong_links_in_words(search: Search, answer: Answer) -> list[Fact]:
    """The fact on the links whose wrong numbers explain all link parameters that an answer reports as wrong."""
    written = answer.adopted
    if written is None or not answer.errors:
        return []
    links = wrong_links(search, np.array([float(written.values[s]) for s in search.refitted_symbols]))
    if links is None:
        return []
    return [Fact.worded("declared value", "links", names=[search.system.positions[k].name for k in links])]


def equal_parameters(search: Search, base: Fit, outcome: Outcome) -> list[Fact]:
    """Facts on parameters that explain the log as well as the single effect of an outcome.

    Example: a mass that is declared too small by ten tolerances gives the same motion as an inertia error.
    """
    freed = search.without_limits(base) if len(outcome.parts) == 1 else None
    if freed is None or _gain(freed[1], outcome.final) < -BETTER:
        return []
    (part,) = outcome.parts
    words = _far_values(search, freed[1])
    return [Fact.worded("declared value", "equal values", values=words, named=part.title)] if words else []


def _far_values(search: Search, fit: Fit) -> str:
    """The words "NAME = … explains" on the values that are ``WITHIN`` tolerances or more away in a fit; else empty.

    Of many values ``MOST_VALUES`` are given, those the most tolerances away, and the names of the others.
    """
    away = tolerances_away(search, fit.theta[: len(search.refitted_symbols)])
    far = [k for k in np.argsort(-away, kind="stable") if away[k] >= AT_END * WITHIN]
    symbols = search.refitted_symbols
    units = [in_unit(search.system, s) for s in symbols]
    values = [
        f"{symbols[k]} = {fit.theta[k]:.4g}{units[k]} in place of the declared "
        f"{search.declared[k]:.4g}{units[k]} ({away[k]:.2g} tolerances away)"
        for k in far[:MOST_VALUES]
    ]
    if others := [symbols[k].name for k in far[MOST_VALUES:]]:
        values.append(f"other values of {', '.join(others)}")
    if len(values) < 2:
        return "".join(f"{one} explains" for one in values)
    return f"{', '.join(values[:-1])} and {values[-1]} explain"


def moved_values(answer: Answer, fit: Fit, problem: Problem, material: float) -> list[Fact]:
    """Facts on values that are written and not reported as wrong, whose interval excludes the declared value.

    ``fit``: of the written values. ``material``: least change of the force, as a share of the drive force.
    """
    written, declared = answer.adopted, problem.system
    if written is None:
        return []
    known = {error.name for error in answer.errors}
    found = estimate(fit).refitted
    drive = Drive(written, problem.motion)
    facts = []
    for s in problem.uncertain:
        was, now = float(declared.values[s]), float(written.values[s])
        low, high = found.get(s.name, (now, (now, now)))[1]
        if s.name in known or was == now or low <= was <= high or not low <= now <= high:
            continue
        as_declared = written.with_parameters({s: declared.values[s]}, {})
        share = drive.share(drive.residual - inverse_dynamics_residual(as_declared, problem.motion))
        if share < material:
            continue
        unit, tolerance = in_unit(declared, s), problem.deviation[s]
        part = abs(now - was) / tolerance
        # A share of a declared zero, as of a symmetric link's moment, does not exist, and one above 1 says nothing.
        size = in_percent(tolerance / abs(was), 3) if tolerance <= abs(was) else f"{tolerance:.3g}{unit}"
        value, *ends = (with_deserved_digits(end, (low, high)) for end in (now, low, high))
        given = {"name": s.name, "unit": unit, "was": was, "part": part, "size": size, "share": share}
        given["drive"] = driving_force_name(declared)
        facts.append(Fact.worded("spec.yaml", "moved value", value=value, ends=ends, **given))
    return facts


def turned_terms(answer: Answer, problem: Problem) -> list[Fact]:
    """Facts on terms of the declared force that have the opposite sign with the accepted effects.

    A term T with the wrong sign is the same as a missing force −2 T, which some effect may represent: an offset, if T
    is a weight; a spring, if T is one. So the force of each effect, and of all together, is compared with −2 T.
    """
    written, motion = answer.augmented, problem.motion
    if answer.verdict != "effect" or written.transmissions:
        return []
    plain = with_values(answer.refit, {s.name: float(v) for s, v in written.values.items()})
    before = inverse_dynamics_residual(plain, motion)
    together = [answer.effects] if len(answer.effects) > 1 else []
    groups: list[tuple[FoundEffect, ...]] = [*((one,) for one in answer.effects), *together]
    gained = [inverse_dynamics_residual(with_effects(plain, group), motion) - before for group in groups]
    facts, reported = [], set()
    for k, x in enumerate(plain.positions):
        used = problem.used[:, k]
        for term, force in _terms_along(plain, k, problem):
            for group, added in zip(groups, gained, strict=True):
                ratio = _mirrored(added[used, k], force[used])
                if ratio is None or abs(term) in reported:
                    continue
                reported.add(abs(term))
                size, unit = float(np.sqrt(np.mean(force[used] ** 2))), plain.force_unit(k)
                given = {"term": term, "on": x.name, "size": size, "unit": unit, "ratio": ratio}
                facts.append(Fact.worded("next", "sign", named=titles(group), **given))
    return facts


def _terms_along(system: System, k: int, problem: Problem) -> list[tuple[sympy.Expr, Array]]:
    """The terms of the sum that is the force on coordinate k, and their low-passed values (N,) along the motion."""
    terms = [term for term in sympy.Add.make_args(system.modelled_force[k]) if term.free_symbols]
    rows = [sympy.Matrix([term if i == k else 0 for i in range(system.degrees_of_freedom)]) for term in terms]
    values = evaluate_forces(system, rows, problem.motion) if rows else np.zeros((0, len(problem.motion.time), 1))
    return [(term, problem.motion.low_pass(one)[:, k]) for term, one in zip(terms, values, strict=True)]


def _mirrored(added: Array, force: Array) -> float | None:
    """The ratio of an added force (N,) to a declared one (N,) if it is about −2 in all samples; else None."""
    power = float(force @ force)
    if power == 0 or not np.all(np.isfinite(added)):
        return None
    ratio = float(added @ force) / power
    left = added - ratio * force
    same = float(left @ left) <= MIRRORED**2 * float(added @ added)
    return ratio if same and abs(ratio + 2) <= 2 * MIRRORED else None


def refused_for_a_value(spec: Spec, answer: Answer, problem: Problem, measured: Measured) -> Answer:
    """The answer without its effects if one value without tolerance explains the residual far better (``FAR_LESS``).

    Example: a payload of an arm fits weaker motors on both of its joints. A true effect leaves only the noise, and no
    value can leave a third of the noise. Several effects are refused for a value that leaves no more than they do: it
    explains as much with fewer changes of the declared model. A value with which held-out free runs are worse refuses
    no effect: the force residual does not show what a load does within the gap of a backlash.
    """
    if answer.verdict not in ("effect", "ambiguous"):
        return answer
    found = _explaining_value(spec, answer.refit, problem)
    if found is None:
        return answer
    left = _left_by_effects(answer, problem)
    if 1 - found.share > left * (FAR_LESS if len(answer.effects) == 1 else 1):
        return answer
    if is_shown_worse(measured(with_values(answer.refit, found.values)), answer.figures[2]):
        return answer
    given = {"named": titles(answer.effects), "name": found.symbol.name, "others": 1 - found.share}
    return answer.refused(Fact.worded("not accepted", "another value", left=left, **given).words)


def _left_by_effects(answer: Answer, problem: Problem) -> float:
    """Share of the refit's squared residual that the effects leave, both after regression on the levels.

    Each coordinate counts as in the share that a value explains: over the refit's square there. With the mean of the
    coordinates' own shares, a joint with nothing but noise would leave half of a residual that is on the other joint.
    """
    plain = inverse_dynamics_residual(answer.refit, problem.motion)
    by_refit = residual_without_levels(problem, answer.refit)
    by_effects = residual_without_levels(problem, answer.augmented)
    before = after = 0.0
    for i, used in enumerate(problem.used.T):
        if used.any():
            power = max(float(plain[used, i] @ plain[used, i]), 1e-300)
            before += float(by_refit[used, i] @ by_refit[used, i]) / power
            after += float(by_effects[used, i] @ by_effects[used, i]) / power
    return after / max(before, 1e-300)


@dataclass(frozen=True)
class ExplainingValue:
    """A parameter without tolerance of which another value would explain the residual.

    Attributes:
        values: name → estimate of it and of the friction levels.
        share: of the squared residual force that this explains on held-out parts of the training log.
    """

    symbol: sympy.Symbol
    values: dict[str, float]
    share: float


def explaining_values(spec: Spec, refit: System, problem: Problem, by_curve: float = 0.0) -> list[Fact]:
    """Facts on the value without tolerance that explains most of the residual of a refit, with advice.

    Args:
        by_curve: share of the squared residual that a curve over a position explains. None is named if that leaves less
            than ``FAR_LESS`` of the square: a constant weight explains most of a gas spring's force.
    """
    found = _explaining_value(spec, refit, problem)
    if found is None or 1 - by_curve < FAR_LESS * (1 - found.share):
        return []
    s, name = found.symbol, found.symbol.name
    given = {"unit": in_unit(refit, s), "value": found.values[name], "declared": float(refit.values[s])}
    said = Fact.worded("declared value", "explaining value", name=name, share=found.share, **given)
    return [said, Fact.worded("next", "give a tolerance", name=name)]


def _explaining_value(spec: Spec, refit: System, problem: Problem) -> ExplainingValue | None:
    """The value without tolerance that explains most of the residual of a refit; None if below ``EXPLAINS``.

    A payload on an arm changes inertia and weight of several coordinates at once; no effect does so, the declared mass
    does. The residual is regressed on its slope by each such value, with the levels, on all coordinates together.
    """
    error = refit.equation_error
    own = [spec.symbol(p.name) for p in spec.parameters]
    taken = {*problem.levels, *problem.uncertain}
    fixed = [s for s in own if s not in taken and s in refit.values and refit.values[s] != 0 and error.has(s)]
    if not fixed:
        return None
    rows = force_rows(refit, problem, [*fixed, *problem.levels])
    levels = list(range(len(fixed), len(fixed) + len(problem.levels)))
    before = _left_on_blocks(rows, levels)
    shares = [1 - _left_on_blocks(rows, [k, *levels]) / before if before > 0 else 0.0 for k in range(len(fixed))]
    for best in np.argsort(-np.array(shares), kind="stable"):
        if shares[best] < EXPLAINS:
            break
        chosen, changes = [fixed[best], *problem.levels], _weights(rows, [best, *levels])
        values = {s.name: float(refit.values[s]) + float(change) for s, change in zip(chosen, changes, strict=True)}
        if _explained_acceleration(refit, with_values(refit, values), problem) >= EXPLAINS:
            return ExplainingValue(fixed[best], values, float(shares[best]))
    return None


def _explained_acceleration(before: System, after: System, problem: Problem) -> float:
    """Share of the squared acceleration M⁻¹ r of the force residual of one system that another one takes away.

    A mass that is in all terms of an equation takes its whole residual force away as it goes to zero, and explains
    nothing. After regression on the levels; −inf for a system whose M(x) is not positive definite along the motion.
    """
    motion = problem.motion
    inverses = [inverse_mass(system, motion) for system in (before, after)]
    if not np.linalg.eigvalsh(inverses[1]).min() > 0:
        return float("-inf")
    forces = [residual_without_levels(problem, system)[:, :, None] for system in (before, after)]
    was, left = ((inverse @ force)[:, :, 0] for inverse, force in zip(inverses, forces, strict=True))
    shares = [
        float(np.sum(left[used, i] ** 2)) / max(float(np.sum(was[used, i] ** 2)), 1e-300)
        for i, used in enumerate(problem.used.T)
        if used.any()
    ]
    return 1 - float(np.mean(shares)) if shares else float("-inf")


def _left_on_blocks(rows: Sequence[ForceRows], columns: Sequence[int]) -> float:
    """What ``columns`` leave of the squared residual on all held-out blocks, each coordinate over its square."""
    ends = max(int(r.sample[-1]) for r in rows) + 1
    blocks = [np.minimum(r.sample * BLOCKS // ends, BLOCKS - 1) for r in rows]
    total = 0.0
    for held in range(BLOCKS):
        change = _weights([_selected(r, b != held) for r, b in zip(rows, blocks, strict=True)], columns)
        for r, b in zip(rows, blocks, strict=True):
            part = _selected(r, b == held)
            rest = part.residual + part.slopes[:, list(columns)] @ change
            total += float(rest @ rest) / _power(r)
    return total


def _selected(rows: ForceRows, chosen: NDArray[np.bool_]) -> ForceRows:
    """The chosen samples of one coordinate."""
    return replace(rows, sample=rows.sample[chosen], residual=rows.residual[chosen], slopes=rows.slopes[chosen])


def _power(rows: ForceRows) -> float:
    """Sum of the squared residuals of one coordinate."""
    return max(float(rows.residual @ rows.residual), 1e-300)


def _weights(rows: Sequence[ForceRows], columns: Sequence[int]) -> Array:
    """Changes of the values of these columns by least squares, each coordinate's residual scaled to norm 1."""
    size = [np.sqrt(_power(r)) for r in rows]
    slopes = np.vstack([r.slopes[:, list(columns)] / s for r, s in zip(rows, size, strict=True)])
    residual = np.concatenate([r.residual / s for r, s in zip(rows, size, strict=True)])
    return np.asarray(-np.linalg.lstsq(slopes, residual, rcond=1e-10)[0], dtype=np.float64)
