"""``stiction derive``: the error dynamics of a spec's observer, and the conditions on its gains."""

from __future__ import annotations

from pathlib import Path

from codegen.analysis.analysis import Analysis, analyse
from codegen.app.readable import analysis_latex, analysis_view
from codegen.base.border import verb
from codegen.base.text import render
from codegen.observers import observer_of
from codegen.spec import read_spec


@verb
def derive(path: str | Path) -> Analysis:
    """Ψ, its characteristic polynomial, the gain conditions and margins of a spec's observer.

    Raises:
        BadInput: for a bad spec, or one without an observer.
    """
    spec = read_spec(path)
    return analyse(spec, observer_of(spec))


def derive_text(analysis: Analysis, latex: bool = False) -> str:
    """The analysis in words, or as LaTeX."""
    if latex:
        return render("text/derive.tex.j2", **analysis_latex(analysis))
    return render("text/derive.txt.j2", **analysis_view(analysis))
