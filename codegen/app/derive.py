"""``stiction derive``: the error dynamics of a spec's observer, and the conditions on its gains."""

from __future__ import annotations

from codegen.analysis.analysis import Analysis
from codegen.app.derived import Source, derived_from
from codegen.app.readable import analysis_latex, analysis_view
from codegen.base.border import verb
from codegen.base.text import render


@verb
def derive(source: Source) -> Analysis:
    """Ψ, its characteristic polynomial, the gain conditions and margins of a spec's observer.

    Raises:
        BadInput: for a bad spec, or one without an observer.
    """
    return derived_from(source).analysis


def derive_text(analysis: Analysis, latex: bool = False) -> str:
    """The analysis in words, or as LaTeX."""
    if latex:
        return render("text/derive.tex.j2", **analysis_latex(analysis))
    return render("text/derive.txt.j2", **analysis_view(analysis))
