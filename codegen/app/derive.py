"""``stiction derive``: the error dynamics of a spec's observer and the gain conditions."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from textwrap import fill
from typing import Any

import sympy

from codegen.analysis.analysis import Analysis
from codegen.analysis.conditions import Condition
from codegen.app.check import free_gains
from codegen.app.derived import Source, derived_from
from codegen.base.border import verb
from codegen.base.result import named
from codegen.base.text import render
from codegen.spec.functions import Magnitude

LONGEST_ENTRY, LONGEST_PRINTED = 60, 400
"""Most operations of an entry of a printed matrix, and of any printed expression; longer ones are in --json alone."""
WIDTH, WIDEST_ROW = 110, 150
"""Width, in characters, at which a long expression is continued on the next line; largest width of a printed matrix."""


@verb
def derive(source: Source) -> Analysis:
    """Derive Ψ, its characteristic polynomial, the gain conditions and margins of a spec's observer.

    Free gains are at the middle of their ranges; only the numbers depend on that choice.

    Raises BadInput for a bad spec, or one without an observer.
    """
    machine = derived_from(source)
    free = tuple(free_gains(machine))
    return replace(machine.nominal.analysis, free=free) if free else machine.analysis


def derive_text(analysis: Analysis, latex: bool = False) -> str:
    """The analysis in words, or as LaTeX."""
    if latex:
        return render("text/derive.tex.j2", **analysis_latex(analysis))
    return render("text/derive.txt.j2", **analysis_view(analysis))


def analysis_view(analysis: Analysis) -> dict[str, Any]:
    """The variables of the text of ``stiction derive``."""
    dynamics = analysis.dynamics
    only = analysis.blocks[0].polynomial if len(analysis.blocks) == 1 else None
    coefficients = {} if only is None else {f"c{len(only) - 1 - k}": c for k, c in enumerate(only)}
    rows = [[_entry(e) for e in dynamics.jacobian.row(i)] for i in range(dynamics.jacobian.rows)]
    wide = sum(max(map(len, column)) + 3 for column in zip(*rows, strict=True)) > WIDEST_ROW
    return {
        "analysis": analysis,
        "observer": dynamics.observer,
        "rows": rows,
        "equations": _equations([e.symbol.name for e in dynamics.observer.errors], rows) if wide else [],
        "same": dynamics.sampled == dynamics.in_force(dynamics.jacobian) or dynamics.sampled == dynamics.jacobian,
        "factors": [
            (_polynomial_words(f.polynomial), _powers(f.polynomial), [e.name for e in f.errors])
            for f in analysis.blocks
        ],
        "modes": analysis.modes,
        "dynamics": dynamics,
        "routh": [_condition(c, coefficients) for c in analysis.routh],
        "jury": [_condition(c, coefficients) for c in analysis.jury],
        "free": _free(analysis),
        "signs": [s.name for s in dynamics.observer.signs if dynamics.jacobian.has(s)],
    }


def analysis_json(analysis: Analysis) -> dict[str, Any]:
    """The JSON object of ``stiction derive --json``: SymPy expressions as text."""
    dynamics = analysis.dynamics
    return {
        "format": "stiction-derivation/1",
        "observer": named(dynamics.observer, "kind velocity"),
        "error": [{"name": e.symbol.name, "meaning": e.meaning, "unit": e.unit} for e in dynamics.observer.errors],
        "psi": [[str(e) for e in dynamics.jacobian.row(i)] for i in range(dynamics.jacobian.rows)],
        "sampled": [[str(e) for e in dynamics.sampled.row(i)] for i in range(dynamics.sampled.rows)],
        "inverse_mass": {w.name: [i, j] for w, (i, j) in dynamics.inverse_mass.items()},
        "slopes": {s.name: str(e) for s, e in dynamics.slopes.items()},
        "characteristic_polynomial": _texts(analysis.polynomial),
        "factors": [{"error": [e.name for e in f.errors], "polynomial": _texts(f.polynomial)} for f in analysis.blocks],
        "modes": analysis.modes
        and named(
            analysis.modes,
            "lambda_of=product smallest_lambda=smallest largest_lambda=largest largest_sample_time=sample_time",
        ),
        "routh_hurwitz": [_condition_json(c) for c in analysis.routh],
        "jury": [_condition_json(c) for c in analysis.jury],
        "free_gains_taken": {name: value for name, value, _ in _free(analysis)},
        "sample_time": float(dynamics.observer.sample_time),
        **named(analysis, "spectral_abscissa spectral_radius largest_sample_time stable"),
    }


def analysis_latex(analysis: Analysis) -> dict[str, Any]:
    """The variables of the text of ``stiction derive --latex``."""
    dynamics = analysis.dynamics
    s = sympy.Symbol("s")
    polynomial = None
    if analysis.polynomial is not None:
        order = len(analysis.polynomial) - 1
        polynomial = " + ".join(
            sympy.latex(s ** (order - k))
            if k == 0
            else rf"\left({sympy.latex(c)}\right) {sympy.latex(s ** (order - k)) if k < order else ''}"
            for k, c in enumerate(analysis.polynomial)
        )
    return {
        "psi": sympy.latex(sympy.Matrix(dynamics.jacobian)),
        "sampled": sympy.latex(sympy.Matrix(dynamics.sampled)),
        "polynomial": polynomial,
        "routh": [(c.label, sympy.latex(c.expression)) for c in analysis.routh],
        "jury": [(c.label, sympy.latex(c.expression)) for c in analysis.jury],
    }


def _free(analysis: Analysis) -> list[tuple[str, float, str]]:
    """Name, chosen value and unit of each free gain."""
    observer = analysis.dynamics.observer
    return [(s.name, float(v), observer.gain_units[s]) for s, v in observer.gains.items() if s.name in analysis.free]


def _powers(polynomial: tuple[Any, ...] | None) -> list[tuple[str, str]]:
    """(power of s, coefficient) for each term, highest first."""
    if polynomial is None:
        return []
    order = len(polynomial) - 1
    return [(f"c{order - k}", _written(c)) for k, c in enumerate(polynomial) if k]


def _polynomial_words(polynomial: tuple[Any, ...] | None) -> str:
    """The polynomial in its coefficients: s^2 + c1 s + c0."""
    if polynomial is None:
        return ""
    order = len(polynomial) - 1
    powers = [f"s^{k}" if k > 1 else "s" if k == 1 else "" for k in range(order, -1, -1)]
    return " + ".join([powers[0], *(f"c{order - k} {powers[k]}".strip() for k in range(1, order + 1))])


def _entry(expression: Any) -> str:
    """An entry of a printed matrix; of a long one, its number of operations."""
    operations = int(sympy.count_ops(expression))
    return str(expression) if operations <= LONGEST_ENTRY else f"({operations} operations: printed by --json)"


def _equations(errors: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Each row of de/dt = Ψ e as an equation, ``e_v' = (-K_v - d/m)*e_v + (-1/m)*e_a_rail``, on several lines."""
    equations = []
    for error, row in zip(errors, rows, strict=True):
        terms = [f"({entry})*{other}" for entry, other in zip(row, errors, strict=True) if entry != "0"]
        text = f"{error}' = {' + '.join(terms) or '0'}"
        equations.append(fill(text, WIDTH, subsequent_indent=" " * 8, break_long_words=False, break_on_hyphens=False))
    return equations


def _printed(expression: Any, indent: int) -> str:
    """An expression wrapped to several lines, all but the first indented; for a very long one, where to find it."""
    operations = int(sympy.count_ops(expression))
    if operations > LONGEST_PRINTED:
        return f"({operations} operations: printed by --json)"
    return fill(f"{expression}", WIDTH, subsequent_indent=" " * indent, break_long_words=False, break_on_hyphens=False)


def _written(expression: Any) -> str:
    """A coefficient of a polynomial; a short one is factored."""
    short = int(sympy.count_ops(expression)) <= LONGEST_ENTRY and not expression.has(Magnitude)
    return _printed(sympy.factor(expression) if short else expression, 7)


def _condition(c: Condition, coefficients: Mapping[str, Any]) -> tuple[str, str, float, bool]:
    """A condition as (label, expression, value, holds); a long coefficient that was printed is named by its label."""
    known = not c.readable and coefficients.get(c.label) == c.expression
    return c.label, c.label if known else _printed(c.expression, 12), c.value, c.holds


def _texts(polynomial: tuple[Any, ...] | None) -> list[str] | None:
    return None if polynomial is None else [str(c) for c in polynomial]


def _condition_json(c: Condition) -> dict[str, Any]:
    return {"name": c.label, "greater_than_zero": str(c.expression), "smallest_value": c.value, "holds": c.holds}
